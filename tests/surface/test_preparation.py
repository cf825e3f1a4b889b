"""Steps are taken in their order, only if named, and each is told."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.field_file import FieldMap
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
    flat = detrended(fill(cut, "harmonic", 0.1), "plane")
    assert np.array_equal(prepared.measured.values, flat.values)
    assert not prepared.measured.periodic
    expected = twin(periodic_cell(prepared.measured, "mirror"), 3)
    assert np.array_equal(prepared.field.values, expected.values)
    names = ["read", "crop", "fill harmonic", "detrend plane", "mirror", "twin"]
    assert [step.name for step in prepared.steps] == names
    counts = [step.statistics.missing for step in prepared.steps]
    assert counts == [12, 12, 0, 0, 0, 0]
    # A tilt of 0.3 over 32 rows has an rms height of 0.3 · 32 / √12, the cell one of 1 at most.
    before, after = (prepared.steps[k].statistics.rms_height for k in (2, 3))
    assert before > 0.3 * 32 / 12**0.5 - 1
    assert after < 1.1


@pytest.mark.parametrize("said", [True, None])
def test_repeats_unless_somebody_denies_it(said):
    found = FieldMap(CELL.values, CELL.spacing, said)
    assert prepare(found, Preparation()).field.periodic
    assert not prepare(FieldMap(CELL.values, CELL.spacing, False), Preparation()).field.periodic


def test_unsaid_map_may_be_made_periodic():
    """And its spectrum is then taken as that of a piece, through a window."""
    prepared = prepare(FieldMap(CELL.values, CELL.spacing, None), Preparation(make_periodic="hann"))
    assert prepared.field.periodic
    assert not prepared.measured.periodic


def test_errors_name_the_mend():
    with pytest.raises(InvalidInput, match=r"12 of 1080 points are missing; .*fill = 'harmonic'"):
        prepare(measured(), Preparation(detrend="plane"))
    with pytest.raises(InvalidInput, match="repeats already; leave make_periodic out"):
        prepare(measured(periodic=True), Preparation(fill="linear", make_periodic="cut"))


def test_errors_name_the_file(tmp_path):
    np.savez(tmp_path / "a.npz", heights=measured().values, spacing=[1, 1])
    with pytest.raises(InvalidInput, match=r"heights in .*a\.npz: 12 of 1080 points are missing"):
        measured_surface(tmp_path / "a.npz")
