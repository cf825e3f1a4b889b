"""How much better the letter's cascade starts the finest grid than the mean field does."""

from dataclasses import dataclass

from fem_seal.letter.flow_points import SIDES
from fem_seal.letter.surfaces import VISCOSITY, RoughCase, at_area

SEED = 1


@dataclass(frozen=True)
class CascadeStart:
    """Errors of two first guesses of the pressure, against the converged one.

    energy : (E - Q)/Q of the guess; rms : of its pressure, in units of the pressure drop
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
    """Measure both first guesses in one contact.

    Raises
    ------
    NotConverged
        If the contact or a relaxation fails.
    """
    from fem_seal.finite_difference.cascade import initial_error
    from fem_seal.finite_difference.stencil import flow_grid

    gap = at_area(case.surface(SEED), model, area, threads).gap
    error = initial_error(flow_grid(gap, VISCOSITY, SIDES, "linear", "linear-gap"))
    return CascadeStart(
        case=case,
        model=model,
        area=area,
        mean_field_energy=error.mean_field_energy,
        cascade_energy=error.cascade_energy,
        mean_field_rms=error.mean_field_rms,
        cascade_rms=error.cascade_rms,
    )
