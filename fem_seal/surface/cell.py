"""Cropping of height maps, and periodic cells made of maps that are not periodic."""

import numpy as np

from fem_seal.arguments import require_known
from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField

# By name, as SciPy has it. The Tukey window rises and falls over an eighth of each side.
WINDOWS = {"hann": "hann", "tukey": ("tukey", 0.25)}
# A Hann window w correlates neighbouring waves: the variance of a mean over many waves grows by the
# factor mean w⁴ / (mean w²)² along each axis (P. D. Welch, IEEE Trans. Audio Electroacoust. 15, 70
# (1967)).
HANN_DEPENDENCE = 35 / 18


def cropped(field: FieldMap, crop: tuple[tuple[float, float], tuple[float, float]]) -> FieldMap:
    """Samples of a map inside a rectangle ((x0, x1), (y0, y1)) [m] from the first sample on.

    Ends are included. The part is not periodic unless the rectangle is the whole map.
    """
    slices = []
    for name, (start, end), d, n in zip("xy", crop, field.spacing, field.values.shape, strict=True):
        # A sample on the edge, up to rounding, is inside.
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
        s.start == 0 and s.stop >= n for s, n in zip(slices, field.values.shape, strict=True)
    )
    return FieldMap(field.values[tuple(slices)], field.spacing, field.periodic if whole else False)


def periodic_cell(field: GridField, how: str) -> GridField:
    """Make a periodic cell of heights [m] without missing points.

    "cut": the map itself, with a jump across the seam. "mirror": the map and its mirror images,
    twice as long and wide, with a kink at the seam. "hann", "tukey": the deviation from the mean
    times this window, which is 0 at the border; the Tukey window is 1 except on an eighth of the
    length at each end.
    """
    require_known(("cut", "mirror", *WINDOWS), how, "make_periodic")
    values = field.values
    if how == "mirror":
        # The first and last rows lie on the mirror lines and are not doubled: 2 (n - 1) samples.
        values = np.pad(values, [(0, max(n - 2, 0)) for n in values.shape], mode="reflect")
    elif how in WINDOWS:
        values = values.mean() + (values - values.mean()) * window(how, field.shape)
    return GridField(values, field.spacing, periodic=True)


def window(name: str, shape: tuple[int, int]) -> np.ndarray:
    """Weights (nx, ny) of a periodic window: 0 in the first row and column, 1 in the middle."""
    from scipy.signal import get_window

    return np.multiply.outer(*(get_window(WINDOWS[name], n) for n in shape))
