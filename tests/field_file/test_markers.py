"""Numbers that mark missing points are no heights; flat places of real surfaces are heights."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.field_file import HEIGHT_NAMES, Stated, read_map
from fem_seal.field_file.markers import refuse_markers, without_marked
from fem_seal.surface import Spectrum, self_affine

# In micrometres: rms 1, about 6 from top to bottom.
ROUGH = self_affine(Spectrum(0.8, 32, 4), (64, 64), (64, 64), rms_height=1.0, seed=4).values
HOLES = np.random.default_rng(1).random(ROUGH.shape) < 0.03


def marked(number, heights=ROUGH):
    return np.where(HOLES, number, heights)


@pytest.mark.parametrize("dtype", [float, np.float32])
@pytest.mark.parametrize(
    "number", [-9999.0, -999.0, -32768.0, 65535.0, 1e38, -1e30, 3.4028235e38, 1e4, -12345.0]
)
def test_markers_are_refused_and_named(number, dtype):
    heights = marked(number).astype(dtype).astype(float)
    with pytest.raises(InvalidInput, match=r"set missing = .* or missing = 'none'"):
        refuse_markers(heights, "a map")
    # Taken for missing they leave the heights, also where single precision has rounded the mark.
    left = without_marked(heights, number)
    assert np.array_equal(np.isnan(left), HOLES)
    refuse_markers(left, "a map")


def test_a_single_customary_marker_is_refused():
    heights = ROUGH.copy()
    heights[3, 5] = -9999.0
    with pytest.raises(InvalidInput, match="-9999 stands once in a map"):
        refuse_markers(heights, "a map")


def test_zero_as_a_marker():
    """Heights from 1 m above: 0 lies 166 times their spread away."""
    with pytest.raises(InvalidInput, match="0 stands"):
        refuse_markers(marked(0.0, ROUGH + 1000.0), "a map")


def flat_places():
    """Surfaces with a recurring highest or lowest height that is one."""
    high, low = np.quantile(ROUGH, [0.9, 0.3])
    pockets = (np.indices(ROUGH.shape) // 8 % 4 == 0).all(axis=0)
    land = 0.1 * ROUGH  # 0.6 from top to bottom
    return {
        "saturated detector": np.clip(ROUGH, low, high),
        "lapped plateau": np.minimum(ROUGH, np.quantile(ROUGH, 0.4)),
        "clipped at the end of 16 bits": np.clip(np.rint(2e4 * ROUGH), -32768, 32767),
        "flat pockets in a rough land": np.where(pockets, -20.0, land),
        "rough pockets in a lapped land": np.where(pockets, land - 100.0, 0.0),
        "grooves of one depth in a flat face": np.where(pockets, -5.0, 0.0),
        "a face without roughness": np.zeros_like(ROUGH),
        "one grain of dust": ROUGH + 1e4 * (np.arange(ROUGH.size).reshape(ROUGH.shape) == 77),
        "few steps of a coarse instrument": np.rint(ROUGH),
        "all missing": np.full_like(ROUGH, np.nan),
    }


@pytest.mark.parametrize("name", flat_places())
@pytest.mark.parametrize("sign", [1, -1])
def test_flat_places_are_heights(name, sign):
    """Passes by not raising: none of these maps holds a value that stands for "missing"."""
    refuse_markers(sign * flat_places()[name], "a map")


def test_whether_it_is_a_height_may_be_said(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, heights=marked(-9999.0), spacing=[1, 1], unit="um")
    with pytest.raises(InvalidInput, match=r"-9999 stands \d+ times in .*a.npz"):
        read_map(path, HEIGHT_NAMES, heights=True)
    named = read_map(path, HEIGHT_NAMES, Stated(missing=-9999), heights=True)
    assert named.missing == HOLES.sum()
    said = read_map(path, HEIGHT_NAMES, Stated(missing="none"), heights=True)
    assert said.missing == 0
    # A gap has contact, which recurs and may lie far from a wide film.
    assert read_map(path, HEIGHT_NAMES).missing == 0
