"""Remarks about a contact that touches everywhere or hardly anywhere, and about steep gaps."""

import re

import numpy as np
import pytest
from project import leak_scene, scene_of_samples

from fem_seal.patch import Patch
from fem_seal.quantities.cautions import cautions
from fem_seal.scene import Scene
from fem_seal.solved import solve

LOOSE = {"pressure_drop": 1e5, "rtol": 0.9}  # no remark is about the flow
ROUGH = np.random.default_rng(3).random((9, 9)) * 1e-7
TOUCHING = np.where(ROUGH < 3e-8, 0, ROUGH)


def pressed(modulus=1e7, **contact):
    return {
        "surface": scene_of_samples(32, short_wavelength="8 um")["surface"],
        "solid": {"contact_modulus": modulus},
        "contact": contact,
        "output": {"products": ["contact"]},
    }


def shaped(kind, formula, **fields):
    """The gap of a formula; the size of its face stands in none of the remarks."""
    sizes = {"length": 0.01, "width": 0.005, "mesh_size": 0.001}
    if kind != "rectangle":
        sizes = {"inner_radius": 0.02, "outer_radius": 0.025, "mesh_size": 0.003}
    shape = {"kind": kind, "gap_expression": formula, **sizes, **fields}
    return leak_scene(shape=shape, flow=LOOSE)


def under(outlet, **fluid):
    """A fluid from 2 bar to a pressure at the outlet."""
    return {"fluid": fluid, "flow": {"inlet_pressure": 2e5, "outlet_pressure": outlet, "rtol": 0.9}}


GAS, SLIPS = {"kind": "gas", "temperature": 293}, "slip of the gas at the walls"
RIGHT = "are the heights, the load and the modulus in the right units"
# Samples of a given gap, if that is one; sections of the scene; words of each caution.
CAUTIONS = {
    "Pa meant in MPa": (None, pressed(pressure=1.0), [f"1 sample is in contact, .* {RIGHT}"]),
    "MPa meant in Pa": (None, pressed(pressure=1e9), [f"all samples .*, .* gap is 0: {RIGHT}"]),
    "touch, in one sample as it should": (None, pressed(pressure=0.0), []),
    "pressed": (None, pressed(pressure=2e5), []),
    # Pressures go with E*: with a slope of 0.1 the peaks are some tenths of it.
    "peaks": (None, pressed(1e12, pressure=1e10), ["GPa, which no metal bears"]),
    "no peaks": (None, pressed(1e10, pressure=1e8), []),
    # Faces 32 um long and nearly flat, so that their slopes do not tell.
    "higher than the patch": (None, pressed(mean_gap=1e-3), ["no thin film on a length of 32 um"]),
    # A formula has no unit: 5 µm written as 5 are five metres of gap.
    "a formula in metres": (None, shaped("rectangle", "5e-6 + x / 100"), []),
    "a formula in micrometres": (None, shaped("rectangle", "5 + x"), ["no thin film"]),
    # In a ring theta jumps from π to -π, and 1 + theta/8 with it; in a sector it does not.
    "a jump": (None, shaped("face-seal", "1e-6 * (1 + theta / 8)"), ["jumps by 785.4 nm"]),
    "no jump": (None, shaped("face-seal", "1e-6 * (1 + abs(theta) + sin(2 * theta) / 8)"), []),
    "a sector": (None, shaped("sector", "1e-6 * (1 + theta / 8)", angle=5.0), []),
    "a liquid": (TOUCHING, under(1e5, viscosity=1e-3), []),
    "a liquid that boils, in wrong units": (
        TOUCHING,
        under(1e3, viscosity=1e6),
        [r"fluid.viscosity = 1e\+06 Pa s", "liquid may boil or cavitate"],
    ),
    "a gas": (TOUCHING, under(0, **GAS, viscosity=2e-5, molar_mass=0.004), [SLIPS]),
    # The viscosity of water, g/mol without the unit, 20 °C as 20 K.
    "a gas in wrong units": (
        TOUCHING,
        under(0, **GAS | {"temperature": 20}, viscosity=1e-3, molar_mass=4),
        [SLIPS, "fluid.viscosity = 0.001 Pa s", "fluid.molar_mass = 4", "fluid.temperature"],
    ),
    "a given gap": (TOUCHING, {}, []),
    # Roundings of another program, everything in contact, and heights in µm taken for metres.
    "open": (ROUGH + 1e-9, {}, ["no sample is in contact.* gap.contact_below"]),
    "open, by its roundings": (ROUGH + 1e-9, {"gap": {"contact_below": "2 nm"}}, []),
    "closed": (0 * ROUGH, {}, ["all samples are in contact, and the mean gap is 0"]),
    "steep": (1e6 * TOUCHING, {}, ["are heights and spacing in the same unit"]),
    # A row of pixels is as long as a pixel, and a gap far lower is a thin film.
    "a row": (
        np.full((1, 4), 1e-9),
        {"flow": LOOSE | {"representation": "constant"}},
        ["no sample is in contact"],
    ),
}


@pytest.mark.parametrize(("gap", "sections", "words"), CAUTIONS.values(), ids=CAUTIONS)
def test_cautions(gap, sections, words, scene_of_gap):
    """These and no others."""
    if gap is not None:
        given = scene_of_gap(gap, flow=LOOSE)
        sections = given | sections | {"gap": given["gap"] | sections.get("gap", {})}
    said = solve(Scene.from_mapping(sections)).cautions
    assert len(said) == len(words), said
    assert all(re.search(part, text) for part, text in zip(words, said, strict=True)), said


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
    gap = scene_of_gap(TOUCHING, (1e-6, spacing), flow=LOOSE)
    patch = Patch(Scene.from_mapping(gap | {"shape": kinds["grid" not in shape] | shape}))
    assert words in (cautions(patch, None) or ("",))[-1]
    assert bool(cautions(patch, None)) == bool(words)


@pytest.mark.parametrize(("unit", "height", "steep"), [(1e-6, 1e-5, True), (1.0, 1.5, False)])
def test_slopes_of_a_polar_gap_are_over_its_arcs(unit, height, steep, scene_of_gap):
    """g = height θ from r = 2 to 8 units has slopes of height/r, whatever the unit of the radius:
    here of up to 5, and of 0.75 at most, while dg/dθ is 1e-5 and 1.5."""
    values = height * 0.05 * np.tile(np.arange(9), (9, 1))
    sector = {"kind": "sector", "angle": 0.4, "mesh_size": unit, "grid": "polar"}
    radii = {"inner_radius": 2 * unit, "outer_radius": 8 * unit, "grid_origin": [2 * unit, 0]}
    scene = scene_of_gap(values, (unit, 0.05), flow=LOOSE) | {"shape": sector | radii}
    said = cautions(Patch(Scene.from_mapping(scene)), None)
    assert any("the gap has slopes of" in sentence for sentence in said) == steep
