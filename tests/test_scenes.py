"""Every scene of demos/scenes runs, keeps its bounds and is read back from its folder."""

import pytest
from project import ROOT

from fem_seal import run
from fem_seal.results import Result
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene

SCENES = sorted((ROOT / "demos" / "scenes").glob("*.toml"))

# Fields that make a scene small enough for a test; the others are small by themselves. Pictures are
# drawn by test_cli.py of a patch, by test_first_verdict.py of a seal, by scene/test_shapes.py of a
# shape. The windows of `o-ring-measured` are pressed by test_first_verdict.py; `leak-experiment` is
# a seal as `o-ring`, `blasted_twin` a map as `blasted`.
SMALL = {
    "face-seal": ["output.products=['leak_rate', 'mesh']"],
    "first": [
        *("surface.shape=[64, 64]", "surface.short_wavelength=6.4 um", "flow.rtol=0.2"),
        "output.products=['contact', 'leak_rate', 'mesh']",
    ],
    "flange": ["output.products=['leak_rate']"],
    "gas": [
        *("surface.shape=[64, 64]", "surface.short_wavelength=128 um"),
        "limit.leak_rate=1e-5 mbar l/s",  # the smoother surface leaks less
    ],
    "leak-experiment": [
        *("surface.shape=[32, 32]", "surface.short_wavelength=126 um"),
        *("seal.patches=2", "seal.rtol=0.9"),
    ],
    "o-ring": [
        *("surface.shape=[32, 32]", "surface.short_wavelength=6.3 um"),
        *("seal.patches=1", "seal.rtol=0.9", "output.products=['seal']"),
    ],
    "o-ring-measured": [
        *("seal.patches=2", "seal.window=['25 um', '25 um']", "seal.rtol=0.9"),
        "output.products=['contact', 'seal']",
    ],
    "plate-with-holes": ["output.products=['leak_rate']"],
    "verdict": [
        *("surface.shape=[64, 64]", "surface.short_wavelength=128 um"),
        "limit.leak_rate=0.02 ml/h",  # few samples: what a finer grid would change is wide
    ],
}

SLOW = {"blasted_twin", "leak-experiment", "o-ring-measured"}


def test_small_fields_are_of_scenes_that_exist():
    assert set(SMALL) <= {path.stem for path in SCENES}


@pytest.mark.render
@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SLOW)) for path in SCENES],
    ids=lambda path: path.stem,
)
def test_scene_runs(path, tmp_path):
    scene = Scene.from_file(path, SMALL.get(path.stem, []))
    result = run(scene, tmp_path / "out")
    assert Result.from_folder(tmp_path / "out") == result
    assert result.converged, result.reason
    for name in result.files:
        assert (tmp_path / "out" / name).stat().st_size > 0
    leak = result.leak_rate
    if leak is not None and leak.lower is not None:
        assert leak.lower <= leak.value <= leak.upper
    decisions = {"sealed", "leaking"} if scene.limit is None else {"within limit", "above limit"}
    if scene.limit is not None and scene.seal is not None and scene.seal.patches < 3:
        decisions = {"undecided"}  # too few to say how much others differ
    assert result.verdict is None or result.verdict.decision in decisions
    assert all(text for _, text in summary_of(result))
