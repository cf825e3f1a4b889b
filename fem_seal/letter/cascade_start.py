"""Errors of two first guesses of the pressure: the letter's cascade and the mean field."""

from dataclasses import dataclass

from fem_seal.letter.flow_points import SIDES
from fem_seal.letter.surfaces import VISCOSITY, RoughCase, at_area

SEED = 1


@dataclass(frozen=True)
class CascadeStart:
    """Errors of both first guesses, against the converged pressure.

    area : A/A0
    mean_field_energy, cascade_energy : (E - Q)/Q, E being the energy of the guess
    mean_field_rms, cascade_rms : rms error of the pressure, in units of the pressure drop
    """

    case: RoughCase
    model: str
    area: float
    mean_field_energy: float
    cascade_energy: float
    mean_field_rms: float
    cascade_rms: float

    @property
    def energy_gain(self) -> float:
        """Mean field's energy error over the cascade's."""
        return self.mean_field_energy / self.cascade_energy

    @property
    def rms_gain(self) -> float:
        """Mean field's pressure error over the cascade's."""
        return self.mean_field_rms / self.cascade_rms


def cascade_start(case: RoughCase, model: str, area: float, threads: int = 1) -> CascadeStart:
    """Measure both first guesses in one contact of the first seed.

    Raises
    ------
    NotConverged
        If the contact or a relaxation fails.
    """
    from fem_seal.film import GridFilm
    from fem_seal.finite_difference.cascade import initial_error
    from fem_seal.finite_difference.stencil import flow_grid

    gap = at_area(case.surface(SEED), model, area, threads).gap
    error = initial_error(flow_grid(GridFilm(gap, SIDES), VISCOSITY, "linear-gap"))
    return CascadeStart(
        case=case,
        model=model,
        area=area,
        mean_field_energy=error.mean_field_energy,
        cascade_energy=error.cascade_energy,
        mean_field_rms=error.mean_field_rms,
        cascade_rms=error.cascade_rms,
    )
