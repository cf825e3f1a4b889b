"""Arrays, maps and numbers as they come from elsewhere."""

from pathlib import Path

import numpy as np
import pytest
from extreme_gaps import adaptive
from project import leak_rate
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.flow.marking import Tuning
from fem_seal.grid import GridField
from fem_seal.limits import Limits
from fem_seal.patch import Patch
from fem_seal.scene import Scene

PART = "Input"
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

LAST_DIGITS = 1e-13  # sums may differ with the alignment of the arrays
NOT_POSITIVE = (0.0, -1.0, np.inf, np.nan)

# --- arrays --------------------------------------------------------------------------------------


def frozen(values, folder):
    copy = values.copy()
    copy.setflags(write=False)
    return copy


def mapped(values, folder):
    np.save(folder / "gap.npy", values)
    return np.load(folder / "gap.npy", mmap_mode="r")


LAYOUTS = {
    "Fortran order": lambda values, folder: np.asfortranarray(values),
    "read-only": frozen,
    "strided": lambda values, folder: np.repeat(values, 2, 0)[::2],
    "memory-mapped": mapped,
}


@pytest.fixture(scope="module")
def single():
    """A rough gap in single precision, and its leak rate in double."""
    values = rough_gap((16, 16), 0.3, 4).values.astype(np.float32)
    return values, adaptive(GridFilm(GridField(values.astype(float), (1.0, 1.0), periodic=True)))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_array_layouts(layout, single, tmp_path, show):
    """Single precision in other layouts of memory."""
    values, reference = single
    array = LAYOUTS[layout](values, tmp_path)
    writeable = array.flags.writeable
    leak = adaptive(GridFilm(GridField(array, (1.0, 1.0), periodic=True)))
    assert (leak.lower, leak.upper) == pytest.approx(
        (reference.lower, reference.upper), rel=LAST_DIGITS, abs=0
    )
    assert array.flags.writeable == writeable
    show("right", "the same bounds to the last digits")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf], ids=str)
def test_not_finite(bad, show):
    """Values of a gap that are not finite."""
    with pytest.raises(InvalidInput, match="1 of 4 grid values are not finite") as error:
        GridField(np.array([[1.0, bad], [1, 1]]), (1, 1))
    show("refused", str(error.value))


@pytest.mark.parametrize("shape", [(0, 4), (4,), (2, 2, 2)], ids=["empty", "line", "volume"])
def test_shapes(shape, show):
    """Arrays that are empty, or not two-dimensional."""
    with pytest.raises(InvalidInput, match="needs a two-dimensional array") as error:
        GridField(np.ones(shape), (1, 1))
    show("refused", str(error.value))


@pytest.mark.parametrize("spacing", NOT_POSITIVE, ids=str)
def test_spacings(spacing, show):
    """Spacings of samples that are no length."""
    with pytest.raises(InvalidInput, match="spacing") as error:
        GridField(np.ones((4, 4)), (1.0, spacing))
    show("refused", str(error.value))


# --- numbers -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "bad"),
    [
        pytest.param(name, bad, id=f"{name} {bad}")
        for name in ("viscosity", "pressure_drop", "rtol")
        for bad in NOT_POSITIVE
    ],
)
def test_flow_numbers(name, bad, show):
    """Viscosity, pressure drop and tolerance that are not positive numbers."""
    with pytest.raises(InvalidInput, match=f"{name} = {bad} must be a positive number") as error:
        adaptive(GridFilm(GridField(np.ones((4, 4)), (1.0, 1.0))), **{name: bad})
    show("refused", str(error.value))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: {"margin": -1.0}, "margin = -1.0 must not be negative"),
        (lambda: {"limits": Limits(unknowns=-3)}, "unknowns = -3 must not be negative"),
        (lambda: {"tuning": Tuning(theta=5)}, "theta = 5 must lie between 0 and 1"),
        (lambda: {"tuning": Tuning(cut=2)}, "cut = 2 must lie between 0 and 1"),
    ],
)
def test_numbers_that_steer_the_flow(make, message):
    """A negative margin would narrow the bounds of a decision."""
    with pytest.raises(InvalidInput, match=message):
        leak_rate(
            GridFilm(GridField(np.ones((4, 4)), (1.0, 1.0))), viscosity=1, pressure_drop=1, **make()
        )


# --- measured maps -------------------------------------------------------------------------------


def pressed_map(heights, folder, small_scene):
    """The contact of a map in micrometres, as a file that says nothing but its unit."""
    path = Path("map.npz")
    np.savez(folder / path, heights=heights, spacing=[1.0, 1.0], unit="um")
    small_scene["surface"] = {"kind": "file", "path": str(path)}
    return Patch(Scene.from_mapping(small_scene, folder)).contact


@pytest.mark.parametrize("number", [-9999.0, -32768.0, 1e38, 3.4028234663852886e38], ids=str)
def test_marks_of_missing_points(number, tmp_path, small_scene, show):
    """Maps in which a number marks missing points."""
    heights = rough_gap((32, 32), 0.3, 4).values.copy()
    heights[3, 4:6] = number
    with pytest.raises(InvalidInput, match="set missing = ") as error:
        pressed_map(heights, tmp_path, small_scene)
    show("refused", str(error.value).replace(f"{tmp_path.resolve()}/", ""))


def test_flat_places(tmp_path, small_scene, show):
    """Maps with flat places: lapped, and with pockets of one depth."""
    heights = np.minimum(rough_gap((32, 32), 0.3, 4).values, 0.5)
    heights[8:12, 8:12] = -20.0
    assert 0 < pressed_map(heights, tmp_path, small_scene).contact_area_fraction < 1
    show("right", "pressed as they are")


def test_maps_that_do_not_repeat(tmp_path, small_scene, show):
    """Maps with a tilt, of which nobody has said whether they repeat."""
    heights = rough_gap((32, 32), 0.3, 4).values + np.linspace(0, 9, 32)[:, None]
    with pytest.raises(InvalidInput, match="make_periodic") as error:
        pressed_map(heights, tmp_path, small_scene)
    show("refused", str(error.value).replace(f"{tmp_path.resolve()}/", ""))
