"""Numbers that files write where a point is missing, such as -9999 or 1e38."""

import numpy as np

from fem_seal.errors import InvalidInput

# Numbers that programs write for missing points: in terrain and instrument files, in 16 and 32
# bits, NetCDF's default fill value, the largest float and double.
CUSTOMARY = (
    999.0, 9999.0, 99999.0, 32767.0, 32768.0, 65535.0, 2147483647.0, 2147483648.0,
    1e20, 1e30, 9.969209968386869e36, 1e37, 1e38, 1.70141e38, float(np.finfo(np.float32).max),
    1e99, 1e300, float(np.finfo(float).max),
)  # fmt: skip
# Single precision rounds 1e38 by this much.
SINGLE_ROUNDING = 1e-6
# An extreme value that occurs more than once, but at less than half of the points, counts as a
# mark if its distance from the other values over their range exceeds MARK_RATIO. This ratio is
# about 0 for clipped peaks, a lapped plateau and a saturated detector; for the flat floor of
# pockets it is depth over roughness, some tens at most. For a customary number 1 will do.
MARK_RATIO = 100.0


def without_marked(values: np.ndarray, missing: float) -> np.ndarray:
    """Replace a number that marks missing points, known to single precision, by NaN."""
    marked = np.isclose(values, missing, rtol=SINGLE_ROUNDING, atol=0)
    return np.where(marked, np.nan, values)


def suspected_mark(values: np.ndarray) -> tuple[float, int] | None:
    """Largest or smallest value if it looks like a mark of missing points, and its frequency.

    It looks like one if it recurs and its distance from all other values is more than `MARK_RATIO`
    times their range, or if it is a customary mark and this distance is more than their range.
    """
    measured = values[~np.isnan(values)]
    if not measured.size:
        return None
    for extreme in (measured.max(), measured.min()):
        others = measured[measured != extreme]
        if not others.size:
            return None  # a smooth face
        count = measured.size - others.size
        # Halve both, so that the difference of the largest doubles does not overflow.
        distance = np.abs(others / 2 - extreme / 2).min()
        spread = others.max() / 2 - others.min() / 2
        customary = np.isclose(abs(extreme), CUSTOMARY, rtol=SINGLE_ROUNDING, atol=0).any()
        recurs = 1 < count < measured.size / 2 and spread > 0
        if (recurs and distance / MARK_RATIO > spread) or (customary and distance > spread):
            return float(extreme), int(count)
    return None


def refuse_markers(values: np.ndarray, what: str) -> None:
    """Refuse heights whose largest or smallest value looks like a mark of missing points."""
    mark = suspected_mark(values)
    if mark is None:
        return
    extreme, count = mark
    times = "once" if count == 1 else f"{count} times"
    raise InvalidInput(
        f"{extreme:g} stands {times} in {what}, far from all other heights, as if it marked "
        f"missing points: set missing = {extreme:g} if it does, or missing = 'none' if it is a "
        "height"
    )
