"""Mesh sizes that follow the width of the channels: small in narrow channels, else large."""

import numpy as np

from fem_seal.mesh.gap_source import GapSource
from fem_seal.mesh.gmsh_process import Box, SizeField

NARROW = 0.1  # a channel ends where the gap falls below this part of its mean
GROWTH = 0.5  # growth of the edge length with the distance to the nearest bank of a channel
FINEST_RASTER = 1500  # largest number of points along the longer side


def channel_sizes(gap: GapSource, rectangle: Box, smallest: float, largest: float) -> SizeField:
    """Edge lengths min(largest, smallest + d/2), d the distance to the nearest bank of a channel.

    The banks are the lines where the gap is a tenth of its mean. Edges in a channel of width w are
    thus no longer than w/4 + `smallest`; contact patches get coarse triangles inside as well.
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
    channel = heights > NARROW * heights.mean()
    distance = np.full(counts, np.inf)
    for region in (channel, ~channel):
        # A region that covers the whole rectangle has no bank: its distance stays infinite.
        if not region.all():
            to_bank = distance_transform_edt(region, sampling=spacing)
            distance = np.where(region, to_bank, distance)
    sizes = np.minimum(smallest + GROWTH * distance, largest)
    return SizeField(sizes, (rectangle.x0, rectangle.y0), tuple(spacing))
