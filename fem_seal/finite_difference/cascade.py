"""The letter's cascade of grids: each halves the spacing of the last and starts from its pressure.

On every grid the network equations Σ_b c_ab (p_b - p_a) = 0 of `solver` are relaxed. On a coarse
grid a cell is a block of samples, and its conductivity K that of their Bruggeman medium,

    mean over the block of (g³ - K)/(g³ + K) = 0,

and c_ab puts the halves of two neighbouring cells in series. The pressure is interpolated to the
next grid and relaxed again, down to the samples themselves (W. B. Dapp et al., Phys. Rev. Lett.
108, 244301 (2012)).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.finite_difference.relaxation import relax
from fem_seal.finite_difference.stencil import FlowGrid, Network
from fem_seal.theory.bruggeman import effective_conductivity

# Least number of cells along the shorter side of the coarsest grid.
COARSEST = 4
# Least conductivity of a cell over the largest one: cells with K = 0 need a pressure too.
CLOSED_BLOCK = 1e-6
# Tolerances of the effective conductivity and of the energy on the coarse grids; their pressure is
# only a first guess for the next grid.
BLOCK_RTOL = 1e-3
GUESS_TOL = 1e-6


@dataclass(frozen=True, eq=False)
class CoarseGrid:
    """Cells of a coarse grid, each a block of samples."""

    #: (cx, cy), effective conductivity of the cells, in units of the largest g³
    conductivity: np.ndarray
    edges_x: np.ndarray  #: (cx + 1,), ends of the cells along x [m]
    edges_y: np.ndarray  #: (cy + 1,), ends along y [m]
    periodic: bool  #: whether y = 0 and y = Ly are the same line

    def network(self) -> Network:
        """Links between the centres of neighbouring cells, and to the two ends."""
        K, dx, dy = self.conductivity, np.diff(self.edges_x), np.diff(self.edges_y)
        half_x = 0.5 * dx[:, None] / (K * dy)
        half_y = 0.5 * dy / (K * dx[:, None])
        x = 1 / np.concatenate([half_x[:1], half_x[:-1] + half_x[1:], half_x[-1:]])
        next_y = np.roll(half_y, -1, axis=1) if self.periodic else half_y[:, 1:]
        y = 1 / ((half_y if self.periodic else half_y[:, :-1]) + next_y)
        return Network(x, np.pad(y, ((1, 1), (0, 0))), self.periodic)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates of the nodes along x, with the two ends, and along y [m]."""
        centres_x, centres_y = (0.5 * (e[:-1] + e[1:]) for e in (self.edges_x, self.edges_y))
        return np.concatenate([self.edges_x[:1], centres_x, self.edges_x[-1:]]), centres_y


def coarse_grid(grid: FlowGrid, block: int) -> CoarseGrid:
    """Group the samples of a gap into blocks, each a cell of Bruggeman's effective medium.

    A block has `block` samples along its side; the last ones may be smaller.
    """
    sites = grid.sites
    cubes = (sites.gap / sites.gap.max()) ** 3
    nx, ny = (-(-n // block) for n in cubes.shape)
    padded = np.full((nx * block, ny * block), np.nan)
    padded[: cubes.shape[0], : cubes.shape[1]] = cubes
    samples = padded.reshape(nx, block, ny, block).transpose(0, 2, 1, 3).reshape(nx, ny, -1)
    present = np.isfinite(samples)
    K = effective_conductivity(
        np.where(present, samples, 0.0), weights=present.astype(float), rtol=BLOCK_RTOL
    )
    K = np.maximum(K, CLOSED_BLOCK * K.max()) if K.any() else np.ones(K.shape)
    return CoarseGrid(
        K, _block_edges(grid, 0, block), _block_edges(grid, 1, block), sites.periodic[1]
    )


def _block_edges(grid: FlowGrid, axis: int, block: int) -> np.ndarray:
    """Coordinates [m] of the sides of the blocks; a vertex on the boundary covers half a pixel."""
    count, spacing = grid.sites.gap.shape[axis], grid.sites.spacing[axis]
    first = grid.sites.origin[axis] - 0.5 * spacing
    edges = first + spacing * np.append(np.arange(0, count, block), count)
    return edges if grid.sites.periodic[axis] else np.clip(edges, 0.0, grid.size[axis])


def first_guess(grid: FlowGrid) -> np.ndarray:
    """Pressure (mx, my), from 1 to 0, of the cascade on the finest grid before it is relaxed."""
    sites = grid.sites
    period = grid.size[1] if sites.periodic[1] else None
    x, y, pressure = grid.nodes_x[[0, -1]], np.zeros(1), np.array([[1.0], [0.0]])
    levels = max(0, int(np.log2(min(sites.gap.shape) / COARSEST)))
    for level in range(levels, 0, -1):
        coarse = coarse_grid(grid, 2**level)
        guess = _interpolate(x, y, pressure, *coarse.nodes(), period)
        everywhere = np.ones(guess.shape, dtype=bool)
        pressure = relax(coarse.network(), everywhere, guess, GUESS_TOL).pressure
        x, y = coarse.nodes()
    nodes_y = sites.origin[1] + sites.spacing[1] * np.arange(sites.gap.shape[1])
    return _interpolate(x, y, pressure, grid.nodes_x, nodes_y, period)


def _interpolate(
    x: np.ndarray,
    y: np.ndarray,
    values: np.ndarray,
    new_x: np.ndarray,
    new_y: np.ndarray,
    period: float | None,
) -> np.ndarray:
    """Bilinear interpolation from nodes (x, y); constant beyond the outer y unless periodic."""
    along_x = np.array([np.interp(new_x, x, column) for column in values.T])
    return np.array([np.interp(new_y, y, row, period=period) for row in along_x.T])
