"""Errors of two first guesses of the pressure: the letter's cascade and the mean field.

The cascade solves the network equations Σ_b c_ab (p_b - p_a) = 0 on ever finer grids, and takes the
pressure of each as the first guess on the next one. On a coarse grid a cell is a block of samples,
and its conductivity K that of their Bruggeman medium,

    mean over the block of (g³ - K)/(g³ + K) = 0,

and c_ab puts the halves of two neighbouring cells in series (W. B. Dapp et al., Phys. Rev. Lett.
108, 244301 (2012)). The coarse equations are solved to far below the error of the guess, which
therefore depends on the last coarse grid alone, of two samples a block.
"""

from dataclasses import dataclass

import numpy as np

from demos.letter.contacts import SIDES, VISCOSITY, RoughCase, at_area
from demos.letter.flows import SEED
from fem_seal.coupling.multigrid import by_multigrid
from fem_seal.film import GridFilm
from fem_seal.finite_difference.elimination import conductance
from fem_seal.finite_difference.stencil import Stencil, flow_grid
from fem_seal.theory.bruggeman import effective_conductivity

# Most samples along a side for which the solved pressure is computed as well.
PRESSURE_UP_TO = 1024
BLOCK = 2  # samples along the side of a block
# Least conductivity of a cell over the largest one: cells with K = 0 need a pressure too.
CLOSED_BLOCK = 1e-6
# Relative tolerances of a block's conductivity, and of the pressures.
BLOCK_RTOL, TOLERANCE = 1e-3, 1e-8


@dataclass(frozen=True)
class CascadeStart:
    """Errors of the uniform pressure gradient and of the cascade's guess in one contact."""

    case: RoughCase
    model: str
    area: float  #: A/A0
    #: (energy of the guess - Q)/Q at unit pressure drop
    mean_field_energy: float
    cascade_energy: float
    #: rms error of the pressure over the carrying nodes and the pressure drop; None if not computed
    mean_field_rms: float | None
    cascade_rms: float | None

    @property
    def energy_gain(self) -> float:
        """How many times better the energy of the cascade's guess is."""
        return self.mean_field_energy / self.cascade_energy

    @property
    def pressure_gain(self) -> float | None:
        """The same of the pressure."""
        return self.mean_field_rms / self.cascade_rms if self.cascade_rms else None


def cascade_start(case: RoughCase, model: str, area: float) -> CascadeStart:
    """Measure both first guesses in one contact of the first seed."""
    gap = at_area(case.surface(SEED), model, area).gap
    errors = initial_errors(GridFilm(gap, SIDES), pressure=case.n <= PRESSURE_UP_TO)
    return CascadeStart(case, model, area, *errors)


def initial_errors(film: GridFilm, pressure: bool) -> list[float | None]:
    """Energy excess of mean field and cascade, and the rms errors of both if asked for.

    The elimination gives Q, exact to rounding: the energies need no solved pressure.
    """
    grid = flow_grid(film, VISCOSITY, "linear-gap")
    carrying, exact = grid.carrying, conductance(grid.stencil)
    mean_field = np.broadcast_to(np.linspace(1, 0, len(carrying))[:, None], carrying.shape)
    starts = mean_field, first_guess(film.sites.gap)
    laplacian = grid.stencil.laplacian(carrying)
    powers = [start.ravel() @ (laplacian @ start.ravel()) for start in starts]
    excess = [float(power) / exact - 1 for power in powers]
    if not pressure:
        return [*excess, None, None]
    solved = solved_pressure(grid.stencil, carrying)
    errors = [(start - solved)[carrying] for start in starts]
    return [*excess, *(float(np.sqrt(np.mean(error**2))) for error in errors)]


def first_guess(gap: np.ndarray) -> np.ndarray:
    """The cascade's pressure (mx, my), from 1 to 0, at the samples of a gap with periodic sides."""
    stencil, x, y = blocks(gap)
    pressure = solved_pressure(stencil, np.ones(stencil.shape, dtype=bool))
    # Bilinear between the centres of the blocks.
    (mx, my), columns = gap.shape, pressure.T
    along_x = np.array([np.interp(np.arange(mx), x, column) for column in columns])
    return np.array([np.interp(np.arange(my), y, row, period=my) for row in along_x.T])


def blocks(gap: np.ndarray) -> tuple[Stencil, np.ndarray, np.ndarray]:
    """Stencil of the blocks of a gap (mx, my), and coordinates of its nodes in samples.

    Nodes are the two ends and, between them, the centres of the blocks. The last blocks are smaller
    where the samples do not fill them.
    """
    cubes = (gap / gap.max()) ** 3
    nx, ny = (-(-n // BLOCK) for n in cubes.shape)
    padded = np.full((nx * BLOCK, ny * BLOCK), np.nan)
    padded[: cubes.shape[0], : cubes.shape[1]] = cubes
    samples = padded.reshape(nx, BLOCK, ny, BLOCK).transpose(0, 2, 1, 3).reshape(nx, ny, -1)
    weights = np.isfinite(samples).astype(float)
    K = effective_conductivity(np.nan_to_num(samples), weights=weights, rtol=BLOCK_RTOL)
    K = np.maximum(K, CLOSED_BLOCK * K.max())
    # Each sample stands for the pixel around it; those of the first and last row lie on the ends.
    edges_x, edges_y = (
        np.append(np.arange(0, n, BLOCK), n) - 0.5 for n in (cubes.shape[0], cubes.shape[1])
    )
    edges_x = edges_x.clip(0, cubes.shape[0] - 1)
    dx, dy = np.diff(edges_x)[:, None], np.diff(edges_y)
    half_x, half_y = 0.5 * dx / (K * dy), 0.5 * dy / (K * dx)
    x = 1 / np.concatenate([half_x[:1], half_x[:-1] + half_x[1:], half_x[-1:]])
    y = 1 / (half_y + np.roll(half_y, -1, axis=1))
    centres_x, centres_y = (0.5 * (edges[:-1] + edges[1:]) for edges in (edges_x, edges_y))
    nodes_x = np.concatenate([edges_x[:1], centres_x, edges_x[-1:]])
    return Stencil(x, np.pad(y, ((1, 1), (0, 0))), periodic=True), nodes_x, centres_y


def solved_pressure(stencil: Stencil, carrying: np.ndarray) -> np.ndarray:
    """Pressure of a stencil, NaN at nodes that are not `carrying`."""
    return stencil.pressure(carrying, lambda matrix, b: by_multigrid(matrix)(b, TOLERANCE))
