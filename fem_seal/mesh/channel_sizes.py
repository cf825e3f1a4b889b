"""Mesh sizes that follow the width of the channels: small between contacts, large in the open."""

import numpy as np

from fem_seal.mesh.gap_source import GapSource
from fem_seal.mesh.gmsh_process import Rectangle, SizeField

NARROW = 0.1  # of the mean gap: what is lower bounds a channel
GROWTH = 0.5  # edge length over the distance to the nearest bank of a channel
FINEST_RASTER = 1500  # points along the longer side


def channel_sizes(
    gap: GapSource, rectangle: Rectangle, smallest: float, largest: float
) -> SizeField:
    """Edge lengths min(largest, smallest + d/2), d the distance to where a channel ends.

    A channel of width w, between places where the gap is below a tenth of its mean, is thus cut
    into triangles no larger than w/4 + `smallest`; contact patches get coarser inside as well.

    Parameters
    ----------
    gap : the gap
    rectangle : that holds the shape
    smallest, largest : edge lengths [m]
    """
    from scipy.ndimage import distance_transform_edt

    size = np.array([rectangle.x1 - rectangle.x0, rectangle.y1 - rectangle.y0])
    step = max(smallest, size.max() / FINEST_RASTER)
    counts = np.maximum(np.ceil(size / step).astype(int) + 1, 2)
    spacing = size / (counts - 1)
    i, j = np.indices(counts)
    points = np.stack([i.ravel(), j.ravel()], axis=1) * spacing + (rectangle.x0, rectangle.y0)
    heights = gap.anywhere(points).reshape(counts)
    heights = np.where(np.isfinite(heights), heights, 0.0)
    wide = heights > NARROW * heights.mean()
    distance = np.full(counts, np.inf)
    for side in (wide, ~wide):
        # Without a bank there is nothing to be near to.
        if not side.all():
            inside = distance_transform_edt(side, sampling=spacing)
            distance = np.where(side, inside, distance)
    sizes = np.minimum(smallest + GROWTH * distance, largest)
    return SizeField(sizes, (rectangle.x0, rectangle.y0), tuple(spacing))
