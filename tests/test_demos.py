"""Every demo runs, keeps its claims and draws something."""

import inspect
import runpy

import numpy as np
import pytest
from project import ROOT, SMALL_PICTURES, printed_by

DEMOS = sorted(path.stem for path in (ROOT / "demos").glob("*.py"))
# 64 and 128 samples a period are the fewest; the library's tests have contacts next to closing.
DEAR = "closing_saddle"

# Arguments of main that make a demo small; the others are small by themselves.
SMALL = {
    "certified_leak": {"n": 96, "rtol": 0.2, "smooth": 48},
    "closing_contact": {
        "loads": 2,
        "changes": ("surface.shape=[32, 32]", "surface.short_wavelength=12.5 um"),
    },
    "closing_saddle": {},
    "gas_that_slips": {"n": 32, "rtol": 0.3, "points": 3},
    "how_contact_is_solved": {"n": 64},
    "ordinary_dolfinx": {},
    "how_the_lift_is_solved": {"n": 24},
    "when_does_the_fluid_matter": {"n": 32, "shares": (0.01, 0.1, 0.9)},
    "when_is_a_limit_kept": {"n": 96},
    "where_must_i_polish": {"n": 64, "tries": 1, "rtol": 0.1},
}
# From the command line of Python: FEniCSx and VTK must be loaded in this order in one process.
FRESH = ("closing_contact",)
RUN = f"""
import runpy, sys
from pathlib import Path
{SMALL_PICTURES}
main = runpy.run_path(sys.argv[1], run_name="demo")["main"]
assert main(out=Path(sys.argv[2]), **eval(sys.argv[3])) is not None
"""


def test_the_dear_demo_finds_what_it_imports():
    assert callable(runpy.run_path(str(ROOT / "demos" / f"{DEAR}.py"), run_name="demo")["main"])


@pytest.mark.parametrize("name", DEMOS)
def test_a_demo_is_read_in_one_sitting(name):
    assert len((ROOT / "demos" / f"{name}.py").read_text().splitlines()) <= 150


def test_a_verdict_without_a_lower_end_is_not_drawn():
    demo = runpy.run_path(str(ROOT / "demos/when_is_a_limit_kept.py"), run_name="demo")
    with pytest.raises(AssertionError, match="no lower end on 32 x 32 samples"):
        demo["point"](32, 9.0, "resolved")


@pytest.mark.render
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name == DEAR)) for name in DEMOS]
)
def test_demo_keeps_its_claims(name, tmp_path, here, capsys):
    """The claims are asserted in `main`; the result is what they were asserted of."""
    demo = str(ROOT / "demos" / f"{name}.py")
    if name in FRESH:
        said = printed_by("-c", RUN, demo, tmp_path, repr(SMALL[name]), cwd=tmp_path)
    else:
        main = runpy.run_path(demo, run_name="demo")["main"]
        draws = "out" in inspect.signature(main).parameters
        assert main(**({"out": tmp_path} if draws else {}), **SMALL[name]) is not None
        said = capsys.readouterr().out
    assert said.strip(), "a demo says what it has found"
    pictures = list(tmp_path.rglob("*.png"))
    assert pictures, "a demo draws what it claims"
    for picture in pictures:
        assert coloured_part(picture) > 1e-3, f"{picture.name} has axes alone"


def coloured_part(picture) -> float:
    """Part of the pixels with a colour; axes and text are grey.

    One curve across the picture gives 0.002.
    """
    from matplotlib.image import imread

    return np.mean(np.ptp(imread(picture)[..., :3], axis=2) > 0.1)
