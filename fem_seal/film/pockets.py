"""Nominal area that belongs to each site of a film."""

import numpy as np

from fem_seal.film.lattice import Lattice


def site_areas(sites: Lattice) -> np.ndarray:
    """∫ φ_i dA of every site in pixel areas: 1, or a third of the area of the site's triangles."""
    mx, my = sites.gap.shape
    if sites.connectivity != "triangulation":
        return np.ones((mx, my))
    pixels = (mx - 1, my if sites.seam else my - 1)
    even = np.add.outer(np.arange(pixels[0]), np.arange(pixels[1])) % 2 == 0
    # A corner on the pixel's diagonal belongs to both of its triangles, each half a pixel.
    rising = np.where(even, 1 / 3, 1 / 6)
    falling = np.where(even, 1 / 6, 1 / 3)
    area = np.zeros((mx, pixels[1] + 1))
    area[:-1, :-1] += rising
    area[1:, 1:] += rising
    area[1:, :-1] += falling
    area[:-1, 1:] += falling
    if sites.seam:
        area[:, 0] += area[:, -1]
        area = area[:, :-1]
    return area
