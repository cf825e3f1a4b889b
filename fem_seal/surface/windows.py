"""Longest wavelength of a map, and the roughness that windows of the map keep.

A window that is cut out of a map and levelled loses most of the waves that are longer than the
window. docs/theory/scales-apart.md derives how much.
"""

from dataclasses import replace

import numpy as np

from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField
from fem_seal.surface.detrending import detrended
from fem_seal.surface.missing import fill
from fem_seal.surface.spectrum_fit import map_spectrum

LONGER = 0.1  # part of the mean square height in waves longer than the longest one that counts
# Least width of a window in longest wavelengths. About π n waves of that length fit into a window n
# of them wide, so its mean square height scatters by 1/√(π n): by 28 % at n = 4, and at n = 1 by
# 56 %. Levelling by a plane takes 0.2 % of the rms height at n = 4, and 13 % at n = 1.
WAVES = 4.0
# Part of the rms height that windows may lose without a warning. Windows at least two waves wide
# lose up to 1.3 %. A gap that is 3 % smaller conducts 9 % less: less than the bounds leave open.
MOST_LOST = 0.03


def levelled_map(heights: FieldMap) -> GridField:
    """Heights [m] without tilt, unless the map repeats, and without holes."""
    if not heights.periodic:
        heights = detrended(heights, "plane")
    filled = fill(heights, 1.0)
    return GridField(filled.values, filled.spacing, bool(filled.periodic))


def longest_wavelength(heights: GridField) -> float | None:
    """Wavelength [m] above which a tenth of the mean square height lies, of a `levelled_map`.

    None if it is longer than the map: a wave that fits less than twice into a map that does not
    repeat cannot be told from a longer one.
    """
    spectrum = map_spectrum(heights)
    power = np.cumsum(spectrum.density * spectrum.modes)
    longest = 2 * np.pi / spectrum.wavenumber[np.searchsorted(power, LONGER * power[-1])]
    if not heights.periodic and longest > min(heights.size) / 2:
        return None
    return float(longest)


def kept_roughness(heights: GridField, window: tuple[float, float], trend: str) -> float:
    """Rms height of the windows of a map, each levelled, over that of the levelled map.

    The windows lie side by side from the first corner of the map on, as many as it holds.
    The lengths of a window [m] are at most those of the map, the trend is one of `detrended`.
    """
    whole = FieldMap(heights.values, heights.spacing, False)
    nx, ny = (max(round(side / d), 2) for side, d in zip(window, heights.spacing, strict=True))
    variances = [
        detrended(replace(whole, values=whole.values[i : i + nx, j : j + ny]), trend).values.var()
        for i in range(0, heights.shape[0] - nx + 1, nx)
        for j in range(0, heights.shape[1] - ny + 1, ny)
    ]
    return float(np.sqrt(np.mean(variances) / detrended(whole, trend).values.var()))
