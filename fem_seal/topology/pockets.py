"""Pockets: open parts of the gap connected to neither inlet nor outlet, which trap fluid."""

import numpy as np

from fem_seal.grid import GridField
from fem_seal.topology import clusters
from fem_seal.topology.lattice import Lattice, lattice


def trapped(gap: GridField, sides: str, representation: str) -> np.ndarray:
    """Mask of the open samples in pockets.

    Parameters
    ----------
    gap : GridField
        Gap [m], zero in contact.
    sides : "wall" or "periodic"
    representation : "linear" or "constant"

    Returns
    -------
    bool array of the shape of gap.vertices() (linear) or gap.values (constant)

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    return sites.on_samples(_trapped_sites(sites))


def trapped_volume(gap: GridField, sides: str, representation: str) -> float:
    """Volume of fluid in the pockets, exact for the gap as represented.

    Sum of g_i ∫ φ_i dA over the sites i in pockets; φ_i is the hat function of vertex i (linear)
    or 1 on pixel i (constant).

    Parameters
    ----------
    gap, sides, representation : as in `trapped`

    Returns
    -------
    float [m^3]

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    volumes = sites.gap * (_site_areas(sites) * gap.spacing[0] * gap.spacing[1])
    return float(volumes[_trapped_sites(sites)].sum())


def _trapped_sites(sites: Lattice) -> np.ndarray:
    """(mx, my) bool: open sites whose cluster has no site on the inlet or the outlet."""
    labels, count = clusters.label(sites.open, sites.connectivity, sites.periodic)
    at_an_end = np.zeros(count + 1, dtype=bool)
    at_an_end[labels[0]] = True
    at_an_end[labels[-1]] = True
    return sites.open & ~at_an_end[labels]


def _site_areas(sites: Lattice) -> np.ndarray:
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
