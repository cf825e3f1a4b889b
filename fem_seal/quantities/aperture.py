"""The hydraulic aperture: the height of the uniform film that leaks as much."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

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


def hydraulic_aperture(
    leak: LeakRate, uniform: LeakRate, height: float, slip_length: float = 0.0
) -> HydraulicAperture:
    """Height h of the uniform film in the same place that leaks as much: Q = Q₁ (h/h₁)³.

    The cubic law, solved for h (P. A. Witherspoon et al., Water Resour. Res. 16, 1016 (1980)).
    With slip it is h³ + l h² in place of h³, exact for a uniform film. h grows with Q and falls
    with Q₁, so the bounds of both give those of h.

    Parameters
    ----------
    leak : LeakRate
        Q, of the film.
    uniform : LeakRate
        Q₁ with its bounds, of the uniform film of height h₁ under the same pressures.
    height : float
        h₁ [m].
    slip_length : float
        l [m], the gap in which slip carries as much as viscous flow at the mean pressure; 0 without
        slip.
    """

    def aperture(rate: float, uniform_rate: float) -> float:
        ratio = rate / uniform_rate
        cubic = height * float(np.cbrt(ratio * (1 + slip_length / height)))
        if slip_length == 0 or cubic == 0:
            return cubic
        return cubic * brentq(lambda t: t**3 + slip_length / cubic * t**2 - 1, 0.0, 1.0, rtol=1e-14)

    lower, upper = uniform.bounds
    return HydraulicAperture(
        aperture(leak.value, uniform.value),
        None if leak.lower is None else aperture(leak.lower, upper),
        None if leak.upper is None else aperture(leak.upper, lower),
    )


def uniform_rectangle(
    film: GridFilm,
    height: float,
    viscosity: float,
    pressure_drop: float,
    slip_length: float = 0.0,
) -> LeakRate:
    """Leak rate of a uniform film on the rectangle of another, exact.

    Q₁ = Ly/Lx h₁³/(12 η) Δp, times 1 + l/h₁ with slip.

    Parameters
    ----------
    film : GridFilm
        Says how long and wide the rectangle is.
    height : float
        h₁ [m].
    viscosity, pressure_drop : float
        η [Pa s], Δp [Pa].
    slip_length : float
        l [m], as of `hydraulic_aperture`.
    """
    Lx, Ly = film.size
    rate = Ly / Lx * film_conductivity(height, viscosity) * pressure_drop
    rate *= 1 + slip_length / height
    return LeakRate("leaking", "closed form", rate, lower=rate, upper=rate)
