"""Steps are taken in their order, only if named, and each is reported."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.field_file import FieldMap
from fem_seal.patch import Patch
from fem_seal.scene import Scene
from fem_seal.surface import (
    Preparation,
    Spectrum,
    detrended,
    fill,
    measured_surface,
    periodic_cell,
    prepare,
    self_affine,
    twin,
)

CELL = self_affine(Spectrum(0.8, 32, 4), (48, 40), (48, 40), rms_height=1.0, seed=2)


def measured(periodic=False):
    """A tilted piece with holes."""
    values = CELL.values[:36, :30] + 0.3 * np.arange(36)[:, None]
    values[10:13, 8:12] = np.nan
    return FieldMap(values, CELL.spacing, periodic)


def test_nothing_unless_named():
    found = FieldMap(CELL.values, CELL.spacing, True)
    prepared = prepare(found, Preparation())
    assert np.array_equal(prepared.field.values, CELL.values)
    assert prepared.field is prepared.measured
    assert [step.name for step in prepared.steps] == ["read"]


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
    expected = twin(periodic_cell(prepared.measured, "mirror"), 3)
    assert np.array_equal(prepared.field.values, expected.values)
    names = ["read", "crop", "detrend plane", "fill harmonic", "mirror", "twin"]
    assert [step.name for step in prepared.steps] == names
    counts = [step.missing for step in prepared.steps]
    assert counts == [12, 12, 12, 0, 0, 0]
    # A tilt of 0.3 over 32 rows has an rms height of 0.3 · 32 / √12, the cell one of 1 at most.
    before, after = (prepared.steps[k].rms_height for k in (1, 2))
    assert before > 0.3 * 32 / 12**0.5 - 1
    assert after < 1.1


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
    # Who says that it repeats is believed.
    assert prepare(FieldMap(found.values, CELL.spacing, True), Preparation()).field.periodic


def pressed(folder, model="gfmd", **fields):
    np.savez(folder / "a.npz", heights=tilted(3) * 1e-7, spacing=[1e-6, 1e-6])
    load = {"area_fraction": 0.1}
    return Scene.from_mapping(
        {
            "surface": {"kind": "file", "path": str(folder / "a.npz"), **fields},
            "solid": {"contact_modulus": 1e7},
            "contact": {"model": model, **load},
            "output": {"products": ["contact"]},
        }
    )


def test_a_map_that_does_not_repeat_is_not_pressed(tmp_path):
    """Refused with three ways out, each of which is one; the bearing model repeats nothing."""
    with pytest.raises(InvalidInput) as refused:
        Patch(pressed(tmp_path)).contact  # noqa: B018
    ways = ({"periodic": True}, {"detrend": "plane"}, {"make_periodic": "mirror"})
    for way in ways:
        [(name, value)] = way.items()
        assert f"{name} = {str(value).lower() if value is True else repr(value)}" in str(
            refused.value
        )
        assert Patch(pressed(tmp_path, **way)).contact.gap.periodic
    assert not Patch(pressed(tmp_path, model="bearing")).contact.gap.periodic


def test_unsaid_map_may_be_made_periodic():
    """And its spectrum is then taken as that of a piece, through a window."""
    prepared = prepare(FieldMap(CELL.values, CELL.spacing, None), Preparation(make_periodic="hann"))
    assert prepared.field.periodic
    assert not prepared.measured.periodic


def test_errors_name_the_file(tmp_path):
    np.savez(tmp_path / "a.npz", heights=measured().values, spacing=[1, 1])
    with pytest.raises(InvalidInput, match=r"heights in .*a\.npz: 12 of 1080 points are missing"):
        measured_surface(tmp_path / "a.npz")
