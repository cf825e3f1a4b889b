"""Errors of two first guesses of the pressure: the letter's cascade and the mean field."""

from dataclasses import dataclass

import numpy as np

from demos.letter.contacts import SIDES, VISCOSITY, RoughCase, at_area
from demos.letter.flows import SEED
from fem_seal.film import GridFilm
from fem_seal.finite_difference.cascade import first_guess, grid_energy, relax
from fem_seal.finite_difference.elimination import conductance
from fem_seal.finite_difference.stencil import FlowGrid, flow_grid

# Most samples along a side for which the converged pressure is computed as well: it takes thousands
# of steps near percolation.
PRESSURE_UP_TO = 1024
EXACT_TOL = 1e-12  # tolerance of the energy of that pressure


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
    grid = flow_grid(GridFilm(gap, SIDES), VISCOSITY, "linear-gap")
    errors = initial_errors(grid, pressure=case.n <= PRESSURE_UP_TO)
    return CascadeStart(case, model, area, *errors)


def initial_errors(grid: FlowGrid, pressure: bool) -> list[float | None]:
    """Energy excess of mean field and cascade, and the rms errors of both if asked for.

    The elimination gives Q, exact to rounding: the energies need no converged pressure.
    """
    guess = first_guess(grid)
    mean_field = np.broadcast_to(1 - grid.nodes_x[:, None] / grid.nodes_x[-1], guess.shape)
    exact = conductance(grid.network)
    starts = (mean_field, guess)
    excess = [grid_energy(grid.network, start, grid.carrying) / exact - 1 for start in starts]
    if not pressure:
        return [*excess, None, None]
    relaxed = relax(grid.network, grid.carrying, guess, tol=EXACT_TOL).pressure
    errors = [(start - relaxed)[grid.carrying] for start in starts]
    return [*excess, *(float(np.sqrt(np.mean(error**2))) for error in errors)]
