"""Height files come back as they were written, and bad ones are refused by name."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.field_file import Stated
from fem_seal.surface import load_heights

HEIGHTS = np.arange(12.0).reshape(3, 4) * 1e-7


def test_npz(tmp_path):
    np.savez(tmp_path / "a.npz", heights=HEIGHTS, spacing=[1e-6, 2e-6])
    field = load_heights(tmp_path / "a.npz")
    assert np.array_equal(field.values, HEIGHTS)
    assert field.spacing == (1e-6, 2e-6)
    for said in (True, False):
        np.savez(tmp_path / "b.npz", heights=HEIGHTS, spacing=[1e-6, 2e-6], periodic=said)
        assert load_heights(tmp_path / "b.npz").periodic is said


def test_npy(tmp_path):
    np.save(tmp_path / "a.npy", HEIGHTS.astype(np.float32))
    field = load_heights(tmp_path / "a.npy", Stated(unit="nm", size=(3e-6, 8e-6)))
    assert field.spacing == (1e-6, 2e-6)
    # Heights in single precision.
    assert field.values == pytest.approx(HEIGHTS * 1e-9, rel=1e-7, abs=0)
    with pytest.raises(InvalidInput, match=r'unit; say it .* unit = "um"'):
        load_heights(tmp_path / "a.npy", Stated(size=(3e-6, 8e-6)))
    with pytest.raises(InvalidInput, match=r'give its size, such as size = \["1 mm", "1 mm"\]'):
        load_heights(tmp_path / "a.npy", Stated(unit="nm"))


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"gap": HEIGHTS}, "no array 'heights'"),
        ({"heights": HEIGHTS}, "give its size"),
        ({"heights": HEIGHTS, "spacing": [1, 0]}, "spacing"),
        ({"heights": HEIGHTS * np.nan, "spacing": [1, 1]}, "12 of 12 points are missing"),
        ({"heights": HEIGHTS + np.inf, "spacing": [1, 1]}, "infinite"),
        ({"heights": HEIGHTS[0], "spacing": [1, 1]}, "two-dimensional"),
        ({"heights": HEIGHTS * 1j, "spacing": [1, 1]}, "real numbers"),
        ({"heights": np.array(["a"]), "spacing": [1, 1]}, "real numbers"),
    ],
)
def test_bad_contents(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InvalidInput, match=message):
        load_heights(tmp_path / "a.npz")


def test_bad_files(tmp_path):
    with pytest.raises(InvalidInput, match="does not exist"):
        load_heights(tmp_path / "none.npz")
    (tmp_path / "folder.npz").mkdir()
    with pytest.raises(InvalidInput, match="cannot be read: Is a directory"):
        load_heights(tmp_path / "folder.npz")
    (tmp_path / "text.npz").write_text("heights")
    with pytest.raises(InvalidInput, match="cannot be read"):
        load_heights(tmp_path / "text.npz")
    np.save(tmp_path / "object.npy", np.array([{}]), allow_pickle=True)
    with pytest.raises(InvalidInput, match="cannot be read"):
        load_heights(tmp_path / "object.npy")
