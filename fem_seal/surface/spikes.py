"""Single points of a measured map far from their neighbours: spikes of the instrument.

The *roughness of a point* is its height above the median of the 5 by 5 points around it. A tilt, a
step or the edge of a plateau leaves it 0. A point counts as an outlier if its distance from the
median and from each neighbour, on the same side, exceeds `OUTLIER_SIGMAS` times the spread σ of
that roughness over the map; so does a group of up to `GROUP_POINTS` such points. Corners, ridges
and scratches have neighbours at their own height, or are longer.

No point of a Gaussian surface is so far away. An outlier on its own is also `OUTLIER_SIGMAS` of
these units σ from the mean of its eight neighbours, a linear combination of Gaussian heights, whose
standard deviation is about σ for white noise and less for smoother surfaces: of 1000² points
1000² · 2 Q(8) = 1e-9 are expected there.
"""

from dataclasses import replace

import numpy as np

from fem_seal.field_file.recorded import FieldMap
from fem_seal.grid import GridField
from fem_seal.surface.detrending import detrended

OUTLIER_SIGMAS = 8.0  # distance of an outlier in units of the roughness of points
GROUP_POINTS = 9  # points of the largest group: 3 x 3
AROUND = 5  # points along a side of the square of neighbours
# Part of the points whose roughness is below 1.96 σ if it is Gaussian. The median would be 0 on a
# face that is flat at more than half of its points; at most a twentieth may be outliers.
QUANTILE, OF_SIGMA = 0.95, 1.96


def outliers(heights: FieldMap | GridField) -> np.ndarray:
    """Points (nx, ny) far from the median of their neighbours, true or false."""
    from scipy import ndimage

    missing = np.isnan(heights.values)
    if missing.all():
        return missing
    # The step of heights that were written with few digits; one step is no outlier.
    step = np.diff(np.unique(heights.values[~missing])).min(initial=np.inf)
    values = detrended(heights, "mean" if heights.periodic else "plane").values
    nearest = ndimage.distance_transform_edt(missing, return_distances=False, return_indices=True)
    # The border is a mirror, in which no point sees itself.
    above = values - ndimage.median_filter(values[tuple(nearest)], AROUND, mode="mirror")
    limit = OUTLIER_SIGMAS * max(np.quantile(np.abs(above[~missing]), QUANTILE) / OF_SIGMA, step)
    far = np.abs(above) > limit
    # Heights of the neighbours that are neither missing nor far themselves.
    highest = ndimage.maximum_filter(np.where(far | missing, -np.inf, values), 3, mode="mirror")
    lowest = ndimage.minimum_filter(np.where(far | missing, np.inf, values), 3, mode="mirror")
    apart = np.where(above > 0, values - highest, lowest - values) > limit
    groups, count = ndimage.label(far, np.ones((3, 3)))
    size = np.bincount(groups.ravel(), minlength=count + 1)
    together = np.bincount(groups.ravel(), (far & ~apart).ravel(), count + 1)
    kept = (size <= GROUP_POINTS) & (together == 0)
    kept[0] = False
    return kept[groups]


def without_outliers(heights: FieldMap) -> FieldMap:
    """Map whose outliers are missing."""
    return replace(heights, values=np.where(outliers(heights), np.nan, heights.values))


def spikes_caution(count: int) -> str | None:
    """Sentence about the outliers that a map keeps; None without any."""
    if not count:
        return None
    points = "1 point stands" if count == 1 else f"{count} points stand"
    return (
        f"{points} out far from the neighbours, as spikes of an instrument do, and spikes hold the "
        "faces apart: set surface.outliers = 'missing' and surface.fill, unless they are real"
    )
