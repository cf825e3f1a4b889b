"""Adaptive leak rates of extreme gaps, and the conditions that their bounds must fulfil."""

from project import leak_rate

from fem_seal.film import GridFilm
from fem_seal.flow import Limits
from fem_seal.leak_rate import LeakRate

MOST_UNKNOWNS = 6000
# Relative, of bounds in other units or by another order of the same sums: rounding of the input,
# times the contrast that CG sees.
ROUNDING = 1e-9


def adaptive(
    film: GridFilm,
    *,
    rtol: float = 0.05,
    viscosity: float = 1 / 12,
    pressure_drop: float = 1.0,
    unknowns: int = MOST_UNKNOWNS,
) -> LeakRate:
    """Adaptive bracket at K = g³; one that stays wider than `rtol` must say why."""
    leak = leak_rate(
        film,
        viscosity=viscosity,
        pressure_drop=pressure_drop,
        rtol=rtol,
        limits=Limits(unknowns=unknowns),
    )
    assert leak.converged or leak.reason
    assert not leak.converged or leak.state == "sealed" or leak.lower > 0
    return leak
