"""The hydraulic aperture: the height of the uniform film that leaks as much."""

from dataclasses import dataclass

import numpy as np

from fem_seal.film import GridFilm, film_conductivity
from fem_seal.leak_rate import LeakRate


@dataclass(frozen=True)
class HydraulicAperture:
    """Hydraulic aperture of a film.

    Attributes
    ----------
    value : float
        Height of the uniform film of the same leak rate [m].
    lower, upper : float or None
        Bounds of the height [m]; None where the leak rate has none.
    """

    value: float
    lower: float | None
    upper: float | None


def hydraulic_aperture(leak: LeakRate, uniform: LeakRate, height: float) -> HydraulicAperture:
    """Height h of the uniform film in the same place that leaks as much: Q = Q₁ (h/h₁)³.

    The cubic law, solved for h (P. A. Witherspoon et al., Water Resour. Res. 16, 1016 (1980)). h
    grows with Q and falls with Q₁, so the bounds of both give those of h.

    Parameters
    ----------
    leak : LeakRate
        Q, of the film.
    uniform : LeakRate
        Q₁ with its bounds, of the uniform film of height h₁ under the same pressures.
    height : float
        h₁ [m].
    """

    def aperture(rate: float | None, uniform_rate: float) -> float | None:
        return None if rate is None else height * float(np.cbrt(rate / uniform_rate))

    return HydraulicAperture(
        aperture(leak.value, uniform.value),
        aperture(leak.lower, uniform.upper),
        aperture(leak.upper, uniform.lower),
    )


def uniform_rectangle(
    film: GridFilm, height: float, viscosity: float, pressure_drop: float
) -> LeakRate:
    """Leak rate of a uniform film on the rectangle of another: Q₁ = Ly/Lx h₁³/(12 η) Δp, exact.

    Parameters
    ----------
    film : GridFilm
        Says how long and wide the rectangle is.
    height : float
        h₁ [m].
    viscosity, pressure_drop : float
        η [Pa s], Δp [Pa].
    """
    Lx, Ly = film.size
    rate = Ly / Lx * film_conductivity(height, viscosity) * pressure_drop
    return LeakRate("leaking", "closed form", rate, lower=rate, upper=rate)
