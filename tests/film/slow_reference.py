"""Neighbour pairs of each connectivity written out pixel by pixel, and what they join."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def edges(shape, connectivity, periodic):
    """All pairs of neighbouring sites of a grid, from the definition of the connectivity."""
    nx, ny = shape
    for i in range(nx):
        for j in range(ny):
            pairs = [((i, j), (i + 1, j)), ((i, j), (i, j + 1))]
            rising, falling = ((i, j), (i + 1, j + 1)), ((i + 1, j), (i, j + 1))
            if connectivity == "8":
                pairs += [rising, falling]
            if connectivity == "triangulation":
                pairs += [rising if (i + j) % 2 == 0 else falling]
            for a, b in pairs:
                crosses_x = max(a[0], b[0]) == nx
                crosses_y = max(a[1], b[1]) == ny
                if (crosses_x and not periodic[0]) or (crosses_y and not periodic[1]):
                    continue
                yield (a[0] % nx, a[1] % ny), (b[0] % nx, b[1] % ny)


def pieces(mask, connectivity, periodic):
    """Number of the cluster of each site, -1 outside the mask."""
    number = np.arange(mask.size).reshape(mask.shape)
    joined = [
        (number[a], number[b])
        for a, b in edges(mask.shape, connectivity, periodic)
        if mask[a] and mask[b]
    ]
    ends = tuple(np.array(joined, dtype=int).reshape(-1, 2).T)
    graph = coo_matrix((np.ones(len(joined)), ends), shape=(mask.size, mask.size))
    found = connected_components(graph, directed=False)[1].reshape(mask.shape)
    return np.where(mask, found, -1)


def spans(mask, connectivity, periodic_sides):
    """Whether a cluster has sites in the first and in the last row."""
    found = pieces(mask, connectivity, (False, periodic_sides))
    return bool(({*found[0]} & {*found[-1]}) - {-1})
