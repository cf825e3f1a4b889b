"""Arrays and numbers as they come from elsewhere."""

import numpy as np
import pytest
from gaps import bracketed
from project import leak_rate
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.flow.marking import Tuning
from fem_seal.grid import GridField
from fem_seal.limits import Limits


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


@pytest.mark.parametrize("layout", LAYOUTS)
def test_single_precision_in_any_layout(layout, tmp_path):
    """The bounds of the same numbers in double precision; sums may differ with the alignment."""
    values = rough_gap((16, 16), 0.3, 4).values.astype(np.float32)
    array = LAYOUTS[layout](values, tmp_path)
    writeable = array.flags.writeable
    leak, reference = (
        bracketed(GridFilm(GridField(one, (1.0, 1.0), periodic=True)), 0.05)
        for one in (array, values.astype(float))
    )
    assert leak.bounds == pytest.approx(reference.bounds, rel=1e-13)
    assert array.flags.writeable == writeable


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_refused(bad):
    with pytest.raises(InvalidInput, match="1 of 4 grid values are not finite"):
        GridField(np.array([[1.0, bad], [1, 1]]), (1, 1))


@pytest.mark.parametrize("shape", [(0, 4), (4,), (2, 2, 2)])
def test_arrays_that_are_no_grid_are_refused(shape):
    with pytest.raises(InvalidInput, match="needs a two-dimensional array"):
        GridField(np.ones(shape), (1, 1))


@pytest.mark.parametrize("name", ["spacing", "viscosity", "pressure_drop", "rtol"])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.inf, np.nan])
def test_what_is_no_positive_number_is_refused(name, bad):
    def leak(spacing=1.0, **numbers):
        film = GridFilm(GridField(np.ones((4, 4)), (1.0, spacing)))
        return leak_rate(film, **{"viscosity": 1.0, "pressure_drop": 1.0} | numbers)

    with pytest.raises(InvalidInput, match=rf"{name} (= {bad} )?must be .*positive"):
        leak(**{name: bad})


@pytest.mark.parametrize(
    ("option", "message"),
    [
        # A negative margin would narrow the bounds of a decision.
        (lambda: {"margin": -1.0}, "margin = -1.0 must be a finite number >= 0"),
        (
            lambda: {"limits": Limits(unknowns=-3)},
            "unknowns = -3 must be a finite number >= 0",
        ),
        (lambda: {"tuning": Tuning(theta=5)}, "theta = 5 must lie between 0 and 1"),
        (lambda: {"tuning": Tuning(cut=2)}, "cut = 2 must lie between 0 and 1"),
        (lambda: {"tuning": Tuning(ceiling=np.nan)}, "ceiling = nan must be above 0"),
    ],
)
def test_numbers_that_steer_the_flow(option, message):
    film = GridFilm(GridField(np.ones((4, 4)), (1.0, 1.0)))
    with pytest.raises(InvalidInput, match=message):
        leak_rate(film, viscosity=1, pressure_drop=1, **option())
