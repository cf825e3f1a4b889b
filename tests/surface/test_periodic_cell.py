"""Cropping of maps and periodic cells: samples, symmetry, windows, statistics of the seam."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.field_file import FieldMap
from fem_seal.grid import GridField
from fem_seal.surface import MapStatistics, Spectrum, cropped, periodic_cell, self_affine
from fem_seal.surface.cell import window

ROUGH = self_affine(Spectrum(0.8, 32, 4), (64, 48), (64, 48), rms_height=1.0, seed=4)
# A piece of it has a border that does not fit together.
PIECE = GridField(ROUGH.values[:40, :30], (1.0, 1.0))


@pytest.mark.parametrize("unit", [1.0, 1e-6, 0.1])
def test_crop_keeps_the_samples_inside(unit):
    """Samples on the edges count as inside in any unit: 3 × 0.1 is not 0.3 in binary."""
    whole = FieldMap(PIECE.values, (unit, 2 * unit), True)
    part = cropped(whole, ((3 * unit, 12 * unit), (4 * unit, 9 * unit)))
    assert np.array_equal(part.values, PIECE.values[3:13, 2:5])
    assert (part.spacing, part.periodic) == (whole.spacing, False)


def test_crop_to_the_whole_map_stays_periodic():
    whole = FieldMap(ROUGH.values, (1.0, 1.0), True)
    same = cropped(whole, ((0, 64), (0, 48)))
    assert np.array_equal(same.values, whole.values)
    assert same.periodic


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


def test_cut_keeps_the_samples_and_marks_them_periodic():
    cell = periodic_cell(PIECE, "cut")
    assert np.array_equal(cell.values, PIECE.values)
    assert cell.periodic


@pytest.mark.parametrize("name", ["hann", "tukey"])
def test_windows_fade_to_the_mean(name):
    cell = periodic_cell(PIECE, name)
    mean = PIECE.values.mean()
    np.testing.assert_allclose(cell.values[0], mean, rtol=1e-14)
    np.testing.assert_allclose(cell.values[:, 0], mean, rtol=1e-14)
    assert np.abs(cell.values - mean).max() <= np.abs(PIECE.values - mean).max()


def test_hann_window_keeps_three_eighths_of_the_power():
    """Mean of sin⁴ is 3/8 along each axis, exactly on an even grid of more than four samples."""
    assert np.mean(window("hann", (12, 10)) ** 2) == pytest.approx((3 / 8) ** 2, rel=1e-14)


def test_tukey_window_is_one_inside():
    n = 80
    inside = window("tukey", (n, n))[n // 2]
    ends = n / 8  # an eighth of the length at each end
    assert np.array_equal(inside == 1, np.abs(np.arange(n) - n / 2) <= n / 2 - ends)


def test_seam_of_a_piece_its_mirror_and_a_cell():
    """A cut piece jumps at its seam; a mirrored piece and a periodic surface do not."""
    assert MapStatistics.of(ROUGH).seam == pytest.approx(1, abs=0.3)  # spread of 48 differences
    assert MapStatistics.of(periodic_cell(PIECE, "cut")).seam > 3
    # A mirror line stands once: across the seam is the first difference inside.
    assert MapStatistics.of(periodic_cell(PIECE, "mirror")).seam < 1.5
    tilted = np.add.outer(np.arange(9.0), np.zeros(5))
    assert MapStatistics.of(GridField(tilted, (1, 1))).seam == 8


def test_unknown_choice():
    with pytest.raises(InvalidInput, match="make_periodic = 'wrap' is unknown; choose from cut"):
        periodic_cell(PIECE, "wrap")
