"""Remarks about a contact that touches everywhere or hardly anywhere, and about steep gaps."""

import numpy as np
import pytest
from project import leak_scene, scene_of_samples

from fem_seal import run
from fem_seal.patch import Patch
from fem_seal.quantities.remarks import cautions
from fem_seal.render.report import report
from fem_seal.results import Result
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.solved import solve

LOOSE = {"pressure_drop": 1e5, "rtol": 0.9}  # no remark is about the flow


def pressed(pressure, modulus=1e7):
    return Scene.from_mapping(
        {
            "surface": scene_of_samples(32, "8 um")["surface"],
            "solid": {"contact_modulus": modulus},
            "contact": {"pressure": pressure},
            "output": {"products": ["contact"]},
        }
    )


@pytest.mark.parametrize(
    ("pressure", "words"),
    [
        (1e9, "all samples are in contact, and the mean gap is 0"),
        (1.0, "sample is in contact, too few"),
        (0.0, None),  # touch: one sample is all there should be
        (2e5, None),
    ],
)
def test_contact_everywhere_or_hardly_anywhere(pressure, words):
    """A pressure in Pa that was meant in MPa, and the other way round."""
    result = solve(pressed(pressure)).result()
    assert len(result.cautions) == (words is not None)
    if words:
        assert words in result.cautions[0]
        assert "right units" in result.cautions[0]


GAS = {"kind": "gas", "viscosity": 2e-5, "molar_mass": 0.004, "temperature": 293}


@pytest.mark.parametrize(
    ("fluid", "outlet", "words"),
    [
        ({"viscosity": 1e-3}, 1e5, []),
        ({"viscosity": 1e6}, 1e3, ["fluid.viscosity = 1e+06 Pa s", "liquid may boil or cavitate"]),
        (GAS, 0, []),
        (
            {"kind": "gas", "viscosity": 1e-3, "molar_mass": 4, "temperature": 20},
            0,
            [f"fluid.{name}" for name in ("viscosity = 0.001 Pa s", "molar_mass = 4", "temp")],
        ),
    ],
)
def test_a_fluid_in_wrong_units_or_that_boils(fluid, outlet, words, given):
    """A gas with the viscosity of water, g/mol without the unit, 20 °C as 20 K."""
    flow = LOOSE | {"pressure_drop": None, "inlet_pressure": 2e5, "outlet_pressure": outlet}
    scene = given(np.ones((4, 4)) * 1e-6).with_({"fluid": fluid, "flow": flow})
    said = [text for text in solve(scene).cautions if text.startswith(("fluid.", "the liquid"))]
    assert len(said) == len(words)
    assert all(part in text for part, text in zip(words, said, strict=True))


@pytest.mark.parametrize(("modulus", "unbearable"), [(1e12, True), (1e10, False)])
def test_a_peak_pressure_that_no_metal_bears(modulus, unbearable):
    """Pressures go with E*: with a slope of 0.1 the peaks are some tenths of it."""
    solved = solve(pressed(0.01 * modulus, modulus))
    assert (solved.patch.elastic.pressure.values.max() > 1e10) == unbearable
    assert any("no metal bears" in text for text in solved.cautions) == unbearable


@pytest.fixture
def given(scene_of_gap):
    """Scene of a gap from an array, with more fields of its section."""

    def scene(gap, **fields):
        sections = scene_of_gap(gap, flow=LOOSE)
        return Scene.from_mapping(sections | {"gap": sections["gap"] | fields})

    return scene


@pytest.mark.parametrize(("formula", "thick"), [("5e-6 + x / 100", False), ("5 + x", True)])
def test_a_formula_in_micrometres_is_no_thin_film(formula, thick):
    """A formula has no unit: 5 µm written as 5 are five metres of gap on 10 mm by 5 mm."""
    shape = {"kind": "rectangle", "length": 0.01, "width": 0.005, "mesh_size": 0.001}
    scene = leak_scene(shape=shape | {"gap_expression": formula}, flow=LOOSE)
    cautions = solve(Scene.from_mapping(scene)).result().cautions
    assert [("no thin film" in caution) for caution in cautions] == [True] * thick


@pytest.mark.parametrize(
    ("kind", "formula", "jumps"),
    [
        ({"kind": "face-seal"}, "1e-6 * (1 + theta / 8)", True),
        ({"kind": "face-seal"}, "1e-6 * (1 + abs(theta) + sin(2 * theta) / 8)", False),
        ({"kind": "sector", "angle": 5.0}, "1e-6 * (1 + theta / 8)", False),
    ],
)
def test_a_gap_that_jumps_with_theta(kind, formula, jumps):
    """In a ring theta jumps from π to -π, and 1 + theta/8 with it; in a sector it does not."""
    ring = {"inner_radius": 0.02, "outer_radius": 0.025, "mesh_size": 0.003}
    scene = leak_scene(shape={**kind, **ring, "gap_expression": formula}, flow=LOOSE)
    cautions = solve(Scene.from_mapping(scene)).result().cautions
    assert [("jumps by 785.4 nm" in caution) for caution in cautions] == [True] * jumps


def test_a_gap_higher_than_the_patch_is_no_thin_film():
    """A mean gap of 1 mm over faces 32 um long: nearly flat, so that its slopes do not tell."""
    data = pressed(1e5).model_dump()
    data["contact"] = {"mean_gap": 1e-3}
    [caution] = solve(Scene.from_mapping(data)).result().cautions
    assert "no thin film" in caution


def test_a_row_of_pixels_is_as_long_as_a_pixel(given):
    """It has a length, and a gap far lower is a thin film."""
    scene = given(np.full((1, 4), 1e-9)).with_({"flow.representation": "constant"})
    cautions = solve(scene).result().cautions
    assert not any("no thin film" in caution for caution in cautions)


ROUGH = np.random.default_rng(3).random((9, 9)) * 1e-7


def test_given_gaps(given):
    """Roundings of another program, everything in contact, and heights in µm taken for metres."""
    [open_] = solve(given(ROUGH + 1e-9)).result().cautions
    assert "no sample is in contact" in open_
    assert "gap.contact_below" in open_
    assert not solve(given(ROUGH + 1e-9, contact_below="2 nm")).result().cautions
    [closed] = solve(given(0 * ROUGH)).result().cautions
    assert "all samples are in contact, and the mean gap is 0" in closed
    touching = np.where(ROUGH < 3e-8, 0, ROUGH)
    assert not solve(given(touching)).result().cautions
    [steep] = solve(given(1e6 * touching)).result().cautions
    assert "are heights and spacing in the same unit?" in steep


@pytest.mark.parametrize(
    ("shape", "spacing", "words"),
    [
        ({"mesh_size": "1 um"}, 1e-6, ""),
        ({"mesh_size": "4 um", "smallest_size": "1 um"}, 1e-6, ""),
        ({"mesh_size": "2 um"}, 1e-6, "mesh_size = 2 um is coarser than the samples of the gap, 1"),
        ({"mesh_size": "4 um", "smallest_size": "2 um"}, 1e-6, "shape.smallest_size = 2 um is"),
        # The samples at the outer rim, 8 um away, are 0.4 um apart.
        ({"mesh_size": "1 um", "grid": "polar"}, 0.05, "samples of the gap, 400 nm apart"),
        ({"mesh_size": "1 um", "grid": "polar"}, 0.2, ""),
    ],
)
def test_a_mesh_coarser_than_its_samples(shape, spacing, words, scene_of_gap):
    """Compared with the smaller of the distances; a mesh file by its median edge."""
    strip, ring = {"length": "8 um", "width": "8 um"}, {"inner_radius": 2e-6, "outer_radius": 8e-6}
    kinds = {"kind": "sector", "angle": 0.4} | ring, {"kind": "strip"} | strip
    gap = scene_of_gap(np.where(ROUGH < 3e-8, 0, ROUGH), (1e-6, spacing), flow=LOOSE)
    patch = Patch(Scene.from_mapping(gap | {"shape": kinds["grid" not in shape] | shape}))
    assert words in (cautions(patch, None) or ("",))[-1]
    assert bool(cautions(patch, None)) == bool(words)


def test_cautions_are_shown_everywhere(given, tmp_path):
    folder = tmp_path / "out"
    result = run(given(1e6 * np.where(ROUGH < 3e-8, 0, ROUGH)), folder)
    [caution] = Result.from_folder(folder).cautions
    assert ("caution", caution) in summary_of(result)
    assert caution in report(folder).read_text(encoding="utf-8")
