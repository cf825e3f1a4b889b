"""Fluid trapped in pockets of the gap that reach neither inlet nor outlet."""

import numpy as np

from fem_seal.grid import GridField
from fem_seal.topology import clusters
from fem_seal.topology.lattice import Lattice, lattice


def trapped(gap: GridField, sides: str, representation: str) -> np.ndarray:
    """Open samples in pockets, which are connected to neither inlet nor outlet.

    Parameters
    ----------
    gap : gap in metres, zero in contact
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
    """Volume of the pockets [m^3], exact for the gap as represented.

    Parameters
    ----------
    gap, sides, representation : as in `trapped`

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        As in `lattice.lattice`.
    """
    sites = lattice(gap, sides, representation)
    volumes = sites.gap * (_site_areas(sites) * gap.spacing[0] * gap.spacing[1])
    return float(volumes[_trapped_sites(sites)].sum())


def _trapped_sites(sites: Lattice) -> np.ndarray:
    labels, count = clusters.label(sites.open, sites.connectivity, sites.periodic)
    at_an_end = np.zeros(count + 1, dtype=bool)
    at_an_end[labels[0]] = True
    at_an_end[labels[-1]] = True
    return sites.open & ~at_an_end[labels]


def _site_areas(sites: Lattice) -> np.ndarray:
    """Integral of each site's nodal function, in pixels: 1 or a third of its triangles' area."""
    mx, my = sites.gap.shape
    if sites.connectivity != "triangulation":
        return np.ones((mx, my))
    pixels = (mx - 1, my if sites.seam else my - 1)
    even = np.add.outer(np.arange(pixels[0]), np.arange(pixels[1])) % 2 == 0
    rising = np.where(even, 1 / 3, 1 / 6)  # corners on the diagonal belong to both triangles
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
