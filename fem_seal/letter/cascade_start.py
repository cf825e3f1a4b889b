"""Errors of two first guesses of the pressure: the letter's cascade and the mean field."""

from dataclasses import asdict, dataclass

from fem_seal.film import GridFilm
from fem_seal.finite_difference.cascade import InitialError, initial_error
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.letter.flow_points import SIDES
from fem_seal.letter.surfaces import VISCOSITY, RoughCase, at_area

SEED = 1
# Most samples along a side for which the converged pressure is computed as well.
PRESSURE_UP_TO = 1024


@dataclass(frozen=True)
class CascadeStart(InitialError):
    """Errors of both first guesses of the cascade, in one contact.

    Attributes
    ----------
    case : RoughCase
        Ensemble of surfaces.
    model : str
        Contact model.
    area : float
        Contact area A/A0.
    """

    case: RoughCase
    model: str
    area: float


def cascade_start(case: RoughCase, model: str, area: float, threads: int = 1) -> CascadeStart:
    """Measure both first guesses in one contact of the first seed.

    Raises
    ------
    NotConverged
        If the contact or a relaxation fails.
    """
    gap = at_area(case.surface(SEED), model, area, threads).gap
    grid = flow_grid(GridFilm(gap, SIDES), VISCOSITY, "linear-gap")
    error = initial_error(grid, pressure=case.n <= PRESSURE_UP_TO)
    return CascadeStart(**asdict(error), case=case, model=model, area=area)
