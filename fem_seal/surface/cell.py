"""A map that does not repeat, cut out and made a cell that does."""

from collections.abc import Callable

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField
from fem_seal.registry import choose

# Fraction of each side over which the Tukey window rises and falls again, together.
TUKEY_TAPER = 0.25


def cropped(found: FieldMap, crop: tuple[tuple[float, float], tuple[float, float]]) -> FieldMap:
    """Keep the samples inside a rectangle; what is left does not repeat any more.

    Parameters
    ----------
    found : heights
    crop : ((x0, x1), (y0, y1)) [m] from the first sample, ends included

    Raises
    ------
    InvalidInput
        If the rectangle leaves the map, or fewer than two samples a side lie inside.
    """
    slices = []
    for name, (start, end), d, n in zip("xy", crop, found.spacing, found.values.shape, strict=True):
        # A sample on the edge to rounding is inside.
        first, last = int(np.ceil(start / d - 1e-6)), int(np.floor(end / d + 1e-6))
        if start < 0 or last > n:
            raise InvalidInput(
                f"crop in {name} from {start:g} m to {end:g} m leaves the map, which is "
                f"{n * d:g} m long"
            )
        if min(last, n - 1) - first < 1:
            raise InvalidInput(
                f"crop in {name} from {start:g} m to {end:g} m holds fewer than two of the "
                f"samples, which are {d:g} m apart"
            )
        slices.append(slice(first, last + 1))
    whole = all(
        s.start == 0 and s.stop >= n for s, n in zip(slices, found.values.shape, strict=True)
    )
    return FieldMap(found.values[tuple(slices)], found.spacing, found.periodic if whole else False)


def periodic_cell(field: GridField, how: str) -> GridField:
    """Make a periodic cell of a map.

    Parameters
    ----------
    field : heights; missing points filled
    how : "cut": as it is, with a jump across the seam; "mirror": the map and its mirror images,
        twice as long and wide, with a kink at the seam; "hann", "tukey": the deviation from the
        mean is weighted by this window, which is 0 at the border (the Tukey window is 1 but on
        an eighth of the length at each end)

    Returns
    -------
    GridField, periodic.

    Raises
    ------
    InvalidInput
        If `how` is unknown.
    """
    make = choose(CELLS, how, "make_periodic")
    return GridField(make(field.values), field.spacing, periodic=True)


def window(name: str, shape: tuple[int, int]) -> np.ndarray:
    """Weights (nx, ny) of a window that repeats: 0 on the first line of samples along each side."""
    from scipy.signal.windows import hann, tukey

    windows = {
        "hann": lambda n: hann(n, sym=False),
        "tukey": lambda n: tukey(n, TUKEY_TAPER, sym=False),
    }
    return np.multiply.outer(*(windows[name](n) for n in shape))


def _cut(values: np.ndarray) -> np.ndarray:
    return values


def _mirror(values: np.ndarray) -> np.ndarray:
    # The first and last lines are mirror lines and stand once, so the period is 2 (n - 1) samples.
    return np.pad(values, [(0, max(n - 2, 0)) for n in values.shape], mode="reflect")


def _windowed(name: str) -> Callable[[np.ndarray], np.ndarray]:
    def weigh(values: np.ndarray) -> np.ndarray:
        mean = values.mean()
        return mean + (values - mean) * window(name, values.shape)

    return weigh


CELLS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "cut": _cut,
    "mirror": _mirror,
    "hann": _windowed("hann"),
    "tukey": _windowed("tukey"),
}
