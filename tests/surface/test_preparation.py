"""Preparation of maps: crop, trend, holes, periodic cell, taken in their order and reported."""

import numpy as np
import pytest
from project import scene_of_samples

from fem_seal.errors import InvalidInput
from fem_seal.field_file import FieldMap
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene import Scene
from fem_seal.surface import (
    MapStatistics,
    Preparation,
    Spectrum,
    cropped,
    detrended,
    fill,
    measured_surface,
    periodic_cell,
    prepare,
    self_affine,
    twin,
)

CELL = self_affine(Spectrum(0.8, 32, 4), (48, 40), (48, 40), rms_height=1.0, seed=2)
ROUGH = self_affine(Spectrum(0.8, 32, 4), (64, 48), (64, 48), rms_height=1.0, seed=4)
# A piece of it has a border that does not fit together.
PIECE = GridField(ROUGH.values[:40, :30], (1.0, 1.0))
NX, NY = 24, 17
SPACING = (2.0, 0.5)
X, Y = np.meshgrid(SPACING[0] * np.arange(NX), SPACING[1] * np.arange(NY), indexing="ij")
LINEAR = 3 + 0.2 * X - 0.7 * Y
# Real parts of (x + iy)^2 and its cube: differences of second order are exact up to cubes.
HARMONIC = LINEAR + 0.03 * (X**2 - Y**2) + 0.01 * X * Y + 1e-3 * (X**3 - 3 * X * Y**2)
TRENDS = {
    "mean": 4 + 0 * X,
    "plane": 4 - 2 * X + 0.5 * Y,
    "quadratic": 4 - 2 * X + 0.5 * Y + X**2 - 3 * X * Y + 0.2 * Y**2,
}


def measured(periodic=False):
    """A tilted piece with holes."""
    values = CELL.values[:36, :30] + 0.3 * np.arange(36)[:, None]
    values[10:13, 8:12] = np.nan
    return FieldMap(values, CELL.spacing, periodic)


def test_all_steps_in_their_order():
    plan = Preparation(
        crop=((2, 33), (1, 28)),
        fill="harmonic",
        detrend="plane",
        make_periodic="mirror",
        twin_seed=3,
    )
    prepared = prepare(measured(), plan)
    cut = FieldMap(measured().values[2:34, 1:29], CELL.spacing, False)
    flat = fill(detrended(cut, "plane"), 0.1)
    assert np.array_equal(prepared.measured.values, flat.values)
    assert not prepared.measured.periodic
    # A piece of the twin as large as the map, mirrored as the map is.
    whole = twin(periodic_cell(prepared.measured, "mirror"), 3)
    expected = periodic_cell(GridField(whole.values[:32, :28], CELL.spacing), "mirror")
    assert np.array_equal(prepared.field.values, expected.values)
    names = ["read", "crop", "detrend plane", "fill harmonic", "mirror", "twin"]
    assert [step.name for step in prepared.steps] == names
    counts = [step.missing for step in prepared.steps]
    assert counts == [12, 12, 12, 0, 0, 0]
    # A tilt of 0.3 over 32 rows has an rms height of 0.3 √((32² - 1)/12), more without the points
    # of the hole, which is near the middle. The cell has one of 1: a piece of it at most the root
    # of how many times more points the cell has, and less about its plane.
    before, after = (prepared.steps[k].rms_height for k in (1, 2))
    of_piece = (CELL.values.size / (32 * 28 - 12)) ** 0.5
    assert before > 0.3 * ((32**2 - 1) / 12) ** 0.5 - of_piece
    assert after < of_piece


@pytest.mark.parametrize("trend", ["mean", "plane", "quadratic"])
def test_the_trend_is_that_of_the_known_points(trend):
    """A quarter of a bowl is missing, whose filled points would pull the trend towards them.

    After the fit the known residuals are orthogonal to the trend's polynomials, to rounding.
    """
    x, y = np.meshgrid(np.linspace(-1, 1, 36), np.linspace(-1, 1, 30), indexing="ij")
    values = CELL.values[:36, :30] + 5 * x + 20 * (x - 0.5) ** 2
    values[5:30, 3:12] = np.nan
    known = ~np.isnan(values)
    plan = Preparation(fill="harmonic", max_missing=0.5, detrend=trend)
    left = prepare(FieldMap(values, CELL.spacing, False), plan).field.values[known]
    terms = {"mean": [0 * x + 1], "plane": [x, y], "quadratic": [x**2, x * y, y**2]}
    for term in terms[trend]:
        assert abs(left @ term[known]) < 1e-9 * np.abs(values[known]).sum()


def tilted(rise):
    """A cell that repeats, plus a tilt along x: its seam is the rise."""
    return CELL.values + rise * np.arange(48)[:, None] / 48


@pytest.mark.parametrize(("rise", "repeats"), [(0, True), (3, False)])
def test_an_unsaid_map_repeats_if_its_seam_does(rise, repeats):
    """The seam of the cell is about 1, that of the tilt 3 over a rms step of 0.3 or so."""
    found = FieldMap(tilted(rise), CELL.spacing, None)
    prepared = prepare(found, Preparation())
    assert (prepared.steps[-1].seam <= 2) is repeats
    assert prepared.field.periodic is repeats
    # The tilt was all that did not repeat.
    assert prepare(found, Preparation(detrend="plane")).field.periodic
    # Made to repeat, the spectrum is taken as that of a piece, through a window.
    cell = prepare(found, Preparation(make_periodic="hann"))
    assert (cell.field.periodic, cell.measured.periodic) == (True, False)
    # Who says that it repeats is believed. Nothing is done unless it is named.
    said = prepare(FieldMap(found.values, CELL.spacing, True), Preparation())
    assert said.field.periodic
    assert np.array_equal(said.field.values, found.values)
    assert [step.name for step in said.steps] == ["read"]


def pressed(folder, model="gfmd", **fields):
    np.savez(folder / "a.npz", heights=tilted(3) * 1e-7, spacing=[1e-6, 1e-6])
    surface = {"kind": "file", "path": str(folder / "a.npz"), **fields}
    contact = {"model": model, "area_fraction": 0.1}
    return Patch(Scene.from_mapping(scene_of_samples(8) | {"surface": surface, "contact": contact}))


def test_a_map_that_does_not_repeat_is_not_pressed(tmp_path):
    """Refused with three ways out, each of which is one; the bearing model repeats nothing."""
    with pytest.raises(InvalidInput) as refused:
        pressed(tmp_path).contact  # noqa: B018
    ways = ({"periodic": True}, {"detrend": "plane"}, {"make_periodic": "mirror"})
    for way in ways:
        [(name, value)] = way.items()
        assert f"{name} = {str(value).lower() if value is True else repr(value)}" in str(
            refused.value
        )
        assert pressed(tmp_path, **way).contact.gap.periodic, way
    assert not pressed(tmp_path, model="bearing").contact.gap.periodic


def test_errors_name_the_file(tmp_path):
    np.savez(tmp_path / "a.npz", heights=measured().values, spacing=[1, 1])
    with pytest.raises(InvalidInput, match=r"heights in .*a\.npz: 12 of 1080 points are missing"):
        measured_surface(tmp_path / "a.npz")


# Trends.


@pytest.mark.parametrize(
    ("trend", "shape"),
    [("mean", X), ("plane", X * Y), ("quadratic", X**3), ("quadratic", X * Y**2)],
)
def test_higher_orders_stay(trend, shape):
    assert detrended(FieldMap(shape, (1, 1), None), trend).values.std() > 0.1


@pytest.mark.parametrize("trend", TRENDS)
def test_nothing_is_left_of_the_trend_itself(trend):
    """Its rounding error would be the roughness of a flat face, which no solver presses flat."""
    heights = np.where(X < 44, 1e-6 * TRENDS[trend], np.nan)
    left = detrended(FieldMap(heights, (1, 1), None), trend).values
    np.testing.assert_array_equal(left, 0 * heights)


def test_map_that_repeats_keeps_its_seam():
    """A sine of one period has a plane of least squares, and a jump where that is taken away."""
    sine = np.sin(2 * np.pi * np.arange(NX) / NX)[:, None] * np.ones((NX, NY))
    assert MapStatistics.of(detrended(FieldMap(sine, (1, 1), None), "plane")).seam > 5
    level = detrended(FieldMap(sine + 4, (1, 1), True), "mean")
    assert level.periodic
    np.testing.assert_allclose(level.values, sine, rtol=0, atol=1e-14)


# Missing points.


def with_holes(values):
    """Single points, a block, a slit and two holes that touch at a corner; none at the border."""
    holed = values.copy()
    for hole in (
        *((3, 3), (slice(6, 12), slice(4, 9)), (slice(14, 22), 2)),
        *((slice(15, 18), slice(9, 12)), (slice(18, 21), slice(12, 15))),
    ):
        holed[hole] = np.nan
    return FieldMap(holed, SPACING, None)


def test_exact():
    """To the rounding of some dozen operations on numbers as large as the field."""
    holed, largest = with_holes(HARMONIC), np.abs(HARMONIC).max()
    filled = fill(holed, 0.3)
    known = ~np.isnan(holed.values)
    assert np.array_equal(filled.values[known], HARMONIC[known])
    np.testing.assert_allclose(filled.values, HARMONIC, rtol=0, atol=1e-13 * largest)


def test_harmonic_hole_at_the_border_has_no_slope_across_it():
    """A corner that is missing: the film of a constant rim is that constant."""
    holed = np.full((8, 8), 2.5)
    holed[:3, :4] = np.nan
    filled = fill(FieldMap(holed, (1, 2), None), 0.3)
    np.testing.assert_allclose(filled.values, 2.5, rtol=1e-14)


def test_limit_is_a_fraction_of_all_points():
    """One of 408 points; less is refused (test_refused.py)."""
    holed = LINEAR.copy()
    holed[5, 5] = np.nan
    assert fill(FieldMap(holed, SPACING, None), 1 / 408).missing == 0
    assert np.array_equal(fill(FieldMap(LINEAR, SPACING, None), 0).values, LINEAR)


# Crop and periodic cell.


@pytest.mark.parametrize("unit", [1.0, 1e-6, 0.1])
def test_crop_keeps_the_samples_inside(unit):
    """Samples on the edges count as inside in any unit: 3 × 0.1 is not 0.3 in binary."""
    whole = FieldMap(PIECE.values, (unit, 2 * unit), True)
    part = cropped(whole, ((3 * unit, 12 * unit), (4 * unit, 9 * unit)))
    assert np.array_equal(part.values, PIECE.values[3:13, 2:5])
    assert (part.spacing, part.periodic) == (whole.spacing, False)
    assert cropped(whole, ((0, 40 * unit), (0, 60 * unit))).periodic


def test_mirrored_cell_is_even_about_its_mirror_lines():
    """h(-x) = h(x) about the first and the last row."""
    cell = periodic_cell(PIECE, "mirror")
    assert cell.shape == (78, 58)
    assert cell.periodic
    # Twice the rectangle of the samples.
    assert cell.size == tuple(2 * length for length in PIECE.size)
    assert np.array_equal(cell.values[:40, :30], PIECE.values)
    for axis in (0, 1):
        mirrored = np.roll(np.flip(cell.values, axis), 1, axis)
        assert np.array_equal(mirrored, cell.values)


@pytest.mark.parametrize(("name", "end"), [("hann", 1 / 2), ("tukey", 1 / 8)])
def test_windows_fade_to_the_mean(name, end):
    """As sin² over a part of the length at each end, 0 at the border and 1 in the middle."""
    mean = PIECE.values.mean()
    places = (np.arange(n) / n for n in PIECE.shape)
    rises = (np.minimum(np.minimum(x, 1 - x) / end, 1) for x in places)
    along, across = (np.sin(np.pi / 2 * rise) ** 2 for rise in rises)
    expected = mean + np.outer(along, across) * (PIECE.values - mean)
    np.testing.assert_allclose(periodic_cell(PIECE, name).values, expected, rtol=0, atol=1e-14)


def test_seam_of_a_piece_its_mirror_and_a_cell():
    """A cut piece jumps at its seam; a mirrored piece and a periodic surface do not."""
    # The rms of 48 independent differences has a spread of 1/√(2 · 48): two of them.
    assert MapStatistics.of(ROUGH).seam == pytest.approx(1, abs=2 / np.sqrt(2 * 48))
    assert MapStatistics.of(periodic_cell(PIECE, "cut")).seam > 3
    # A mirror line stands once: across the seam is the first difference inside.
    assert MapStatistics.of(periodic_cell(PIECE, "mirror")).seam < 1.5
    tilted = np.add.outer(np.arange(9.0), np.zeros(5))
    assert MapStatistics.of(GridField(tilted, (1, 1))).seam == 8
