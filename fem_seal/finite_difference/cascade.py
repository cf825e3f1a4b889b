"""The letter's cascade of grids: each half as coarse as the last, its pressure the next guess.

On a coarse grid the conductivity of a block is Bruggeman's effective medium of its sub-points
(W. B. Dapp et al., Phys. Rev. Lett. 108, 244301 (2012)); the pressure is relaxed, interpolated to
the next grid, and relaxed again, down to the samples themselves.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.finite_difference.relaxation import energy, relax
from fem_seal.finite_difference.stencil import FlowGrid, Network
from fem_seal.theory.bruggeman import effective_conductivity

# Blocks along the shorter side of the coarsest grid.
COARSEST = 4
# Relative conductivity of blocks that Bruggeman closes; a guess has to be defined there too.
CLOSED_BLOCK = 1e-6
# Tolerances of what is only a first guess for the next grid.
BLOCK_RTOL = 1e-3
GUESS_TOL = 1e-6
# Tolerance of what stands for the exact pressure.
EXACT_TOL = 1e-12


@dataclass(frozen=True, eq=False)
class CoarseGrid:
    """Cells of a coarse grid, each a block of samples.

    conductivity : (cx, cy) [m^3/(Pa s)]
    edges_x, edges_y : (cx + 1,), (cy + 1,) [m]
    periodic : whether y = 0 and y = Ly are the same line
    """

    conductivity: np.ndarray
    edges_x: np.ndarray
    edges_y: np.ndarray
    periodic: bool

    def network(self) -> Network:
        """Links between cell centres, each cell in series with its neighbour, and to the ends."""
        K, dx, dy = self.conductivity, np.diff(self.edges_x), np.diff(self.edges_y)
        half_x = 0.5 * dx[:, None] / (K * dy)
        half_y = 0.5 * dy / (K * dx[:, None])
        x = 1 / np.concatenate([half_x[:1], half_x[:-1] + half_x[1:], half_x[-1:]])
        beyond = np.roll(half_y, -1, axis=1) if self.periodic else half_y[:, 1:]
        y = 1 / ((half_y if self.periodic else half_y[:, :-1]) + beyond)
        return Network(x, np.pad(y, ((1, 1), (0, 0))), self.periodic)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates of the network's nodes along x (the two ends included) and y [m]."""
        centres_x, centres_y = (0.5 * (e[:-1] + e[1:]) for e in (self.edges_x, self.edges_y))
        return np.concatenate([self.edges_x[:1], centres_x, self.edges_x[-1:]]), centres_y


@dataclass(frozen=True)
class InitialError:
    """How good first guesses are at the finest grid, against the converged pressure.

    Energy excess is (energy of the guess - Q) / Q at unit pressure drop; rms is the root mean
    square pressure error over the carrying nodes, in units of the pressure drop.

    mean_field_energy, mean_field_rms : of the uniform gradient
    cascade_energy, cascade_rms : of the cascade's guess
    """

    mean_field_energy: float
    cascade_energy: float
    mean_field_rms: float
    cascade_rms: float

    @property
    def energy_reduction(self) -> float:
        """Mean-field energy excess over the cascade's."""
        return self.mean_field_energy / self.cascade_energy

    @property
    def rms_reduction(self) -> float:
        """Mean-field pressure error over the cascade's."""
        return self.mean_field_rms / self.cascade_rms


def coarse_grid(grid: FlowGrid, block: int) -> CoarseGrid:
    """Coarsen a gap's samples by Bruggeman's effective medium.

    Parameters
    ----------
    grid : the finest grid
    block : samples along the side of a block; the last blocks may be smaller

    Returns
    -------
    CoarseGrid; conductivity in units of the largest cubed gap.
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
    """Where blocks of samples begin and end [m]; samples on the rim stand for half a pixel."""
    count, spacing = grid.sites.gap.shape[axis], grid.sites.spacing[axis]
    first = grid.sites.origin[axis] - 0.5 * spacing
    edges = first + spacing * np.append(np.arange(0, count, block), count)
    return edges if grid.sites.periodic[axis] else np.clip(edges, 0.0, grid.size[axis])


def first_guess(grid: FlowGrid) -> np.ndarray:
    """Pressure that the cascade brings to the finest grid.

    Parameters
    ----------
    grid : the finest grid

    Returns
    -------
    (mx, my) float, from 1 at the inlet to 0 at the outlet

    Raises
    ------
    NotConverged
        If the relaxation of a coarse grid fails.
    """
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
    """Bilinear interpolation from nodes (x, y); constant beyond the outermost y, or periodic."""
    along_x = np.array([np.interp(new_x, x, column) for column in values.T])
    return np.array([np.interp(new_y, y, row, period=period) for row in along_x.T])


def initial_error(grid: FlowGrid) -> InitialError:
    """Compare the cascade's guess with the uniform gradient, both against the converged pressure.

    Parameters
    ----------
    grid : the finest grid, leaking

    Returns
    -------
    InitialError

    Raises
    ------
    NotConverged
        If a relaxation fails.
    """
    guess = first_guess(grid)
    mean_field = np.broadcast_to(1 - grid.nodes_x[:, None] / grid.nodes_x[-1], guess.shape)
    exact = relax(grid.network, grid.carrying, guess, tol=EXACT_TOL)
    excess, rms = [], []
    for start in (mean_field, guess):
        excess.append(energy(grid.network, start, grid.carrying) / exact.energy - 1)
        rms.append(float(np.sqrt(np.mean((start - exact.pressure)[grid.carrying] ** 2))))
    return InitialError(excess[0], excess[1], rms[0], rms[1])
