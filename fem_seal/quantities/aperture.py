"""The hydraulic aperture: the gap of the uniform film that leaks as much."""

import numpy as np
from scipy.optimize import brentq

from fem_seal.film import GridFilm, film_conductivity
from fem_seal.fluid import Slip
from fem_seal.leak_rate import Estimate, LeakRate


def hydraulic_aperture(
    leak: LeakRate, uniform: LeakRate, gap: float, slip: Slip | None = None
) -> Estimate:
    """Gap h [m] of the uniform film in the same place that leaks as much: Q = Q₁ (h/h₁)³.

    `leak` is Q, and `uniform` Q₁, that of a uniform gap h₁ [m] under the same pressures.

    The cubic law, solved for h (P. A. Witherspoon et al., Water Resour. Res. 16, 1016 (1980)).
    With slip, h³ is multiplied by the gain of a gap h. It grows with Q and falls with Q₁, so that
    their bounds give bounds of h.
    """
    lower, upper = uniform.bounds
    return Estimate(
        _gap_of(leak.value / uniform.value, gap, slip),
        None if leak.lower is None else _gap_of(leak.lower / upper, gap, slip),
        None if leak.upper is None else _gap_of(leak.upper / lower, gap, slip),
    )


def _gap_of(ratio: float, gap: float, slip: Slip | None) -> float:
    """Gap [m] of the film that leaks `ratio` times as much as a film of another gap [m]."""
    if slip is None or ratio == 0:
        return gap * float(np.cbrt(ratio))
    # Slip only raises the leak rate: h is at most the gap without slip.
    most = gap * float(np.cbrt(ratio * slip.mean_gain(gap)))
    least = 1e-50  # over that

    # Halving takes 167 iterations; Brent's method takes at most the square of that.
    def excess(part: float) -> float:
        return part**3 * slip.mean_gain(part * most) - 1

    return most * brentq(excess, least, 1.0, xtol=least, rtol=1e-14, maxiter=28_000)


def uniform_rectangle(
    film: GridFilm,
    gap: float,
    viscosity: float,
    pressure_drop: float,
    slip: Slip | None = None,
) -> LeakRate:
    """Leak rate of a uniform film on the rectangle of another, exact.

    Q₁ = Ly/Lx h₁³/(12 η) Δp, with slip times its gain; h₁ [m], η [Pa s], Δp [Pa].
    """
    Lx, Ly = film.size
    rate = Ly / Lx * film_conductivity(gap, viscosity) * pressure_drop
    if slip is not None:
        rate *= slip.mean_gain(gap)
    return LeakRate(rate, rate, rate, state="leaking", method="closed form")
