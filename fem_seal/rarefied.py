"""Flow of a rarefied gas between parallel walls, from viscous to free molecular.

A channel of height g carries the mass flux per width -(M/(R T)) B g² c(t)/(12 η) ∇p, t = g p/B,
with B = 6 λ p (2 - σ)/σ, λ the mean free path, σ the accommodation coefficient. The function c
is the Poiseuille coefficient here. Two laws:

    first order    c = 1 + t                            (Maxwell's slip)
    kinetic        c = 2 G(δ)/(√π f),  δ = 3 √π f t,    f = (2 - σ)/σ

with the reduced flow rate G of the linearised Boltzmann equation in the BGK model, for walls that
reflect the part σ of the molecules diffusely and the rest like mirrors. In units of the channel's
height, with molecular velocities c_x in units of √(2 R T/M) and δ = √π g/(2 λ),

    c_x ∂Z/∂x + δ Z = δ u + 1/2,    u(x) = ∫ Z exp(-c_x²) dc_x/√π,    G = 2 ∫ u dx

(C. Cercignani, A. Daneri, J. Appl. Phys. 34, 3509 (1963); accommodation: S. K. Loyalka,
N. Petrellis, T. S. Storvick, Phys. Fluids 18, 1094 (1975)). For δ → ∞ it is
δ/6 + 1.01619 with diffuse walls, for δ → 0 it grows as the logarithm of 1/δ, and in between it has
Knudsen's minimum.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import log, pi, sqrt

import numpy as np

from fem_seal.errors import Inconsistent, InvalidInput

# Rarefaction parameters δ between which the kinetic coefficient is tabulated. For smaller δ it
# rises on the tangent (by at most 0.7; it is 9 there). For larger δ it is a line, as in the slip
# regime.
LEAST_RAREFACTION, LARGEST_RAREFACTION = 1e-6, 1e3
LEAST_ACCOMMODATION = 0.1  # smallest σ for which the kinetic law is solved
_SOLVED, _KINKS = 48, 400  # values of δ for which the flow is solved, and kinks of the table
_CELLS = 60  # cells across the channel in the coarse one of two solutions; the fine one has 120
# Lowest and highest logarithm of the molecular velocity in the quadrature, and its step.
_LOWEST, _HIGHEST, _STEP = -32.0, 2.2, 0.25


@dataclass(frozen=True, eq=False)
class PoiseuilleCoefficient:
    """The function c(t), convex and piecewise linear; beyond the last kink it is one line."""

    t: np.ndarray  #: (n,): 0, the kinks, and one value beyond the last kink
    c: np.ndarray  #: (n,), values c(t) > 0

    def __post_init__(self) -> None:
        ascending = self.t[0] == 0 and (np.diff(self.t) > 0).all()
        if not (ascending and (self.c > 0).all() and (np.diff(self._slopes) >= 0).all()):
            raise Inconsistent("a Poiseuille coefficient is positive and convex, from t = 0 on")
        # The tables of `film.slip_bounds` are as fine as the first ratio.
        ratios = self.kinks[1:] / self.kinks[:-1]
        if len(self.kinks) == 1 or (ratios < (1 - 1e-9) * ratios[:1]).any():
            raise Inconsistent("no two kinks are as near to each other as the first two")

    @property
    def kinks(self) -> np.ndarray:
        """The t (n - 2,) at which the slope changes."""
        return self.t[1:-1]

    def __call__(self, t: np.ndarray | float) -> np.ndarray:
        """c(t)."""
        k = self._segment(t, self.t)
        return self.c[k] + self._slopes[k] * (t - self.t[k])

    def integral(self, t: np.ndarray | float) -> np.ndarray:
        """∫ c from 0 to t."""
        k = self._segment(t, self.t)
        x = t - self.t[k]
        return self._integrals[k] + x * (self.c[k] + self._slopes[k] / 2 * x)

    def inverse_integral(self, integral: np.ndarray | float) -> np.ndarray:
        """Value t >= 0 up to which the integral of c has a given value."""
        k = self._segment(integral, self._integrals)
        y = np.maximum(integral - self._integrals[k], 0.0)
        c, slope = self.c[k], self._slopes[k]
        return self.t[k] + 2 * y / (c + np.sqrt(c * c + 2 * slope * y))

    def _segment(self, x: np.ndarray | float, starts: np.ndarray) -> np.ndarray:
        return np.clip(np.searchsorted(starts, x, "right") - 1, 0, len(starts) - 2)

    @cached_property
    def _slopes(self) -> np.ndarray:
        return np.diff(self.c) / np.diff(self.t)

    @cached_property
    def _integrals(self) -> np.ndarray:
        return np.append(0.0, np.cumsum(np.diff(self.t) * (self.c[1:] + self.c[:-1]) / 2))


FIRST_ORDER = PoiseuilleCoefficient(np.array([0.0, 1.0]), np.array([1.0, 2.0]))


@lru_cache
def kinetic(accommodation: float) -> PoiseuilleCoefficient:
    """Poiseuille coefficient from continuum to free molecular flow (BGK model).

    The accommodation σ lies between `LEAST_ACCOMMODATION` and 1.

    Notes
    -----
    G is computed at 48 values of δ to about 1e-5 and interpolated by a spline in ln δ. The table of
    400 kinks lies up to 1e-4 above the spline, because the chords of a convex function lie above
    it.
    """
    from scipy.interpolate import CubicSpline

    if not LEAST_ACCOMMODATION <= accommodation <= 1:
        raise InvalidInput(
            f"accommodation = {accommodation!r} must lie between {LEAST_ACCOMMODATION:g} and 1 "
            "for the kinetic law"
        )
    slip = (2 - accommodation) / accommodation
    ends = log(LEAST_RAREFACTION), log(LARGEST_RAREFACTION)
    solved = np.linspace(*ends, _SOLVED)
    # Interpolate G less its viscous part: for large δ that part would hide the rest.
    beyond = [flow_rate(delta, accommodation) - delta / 6 for delta in np.exp(solved)]
    delta = np.exp(np.linspace(*ends, _KINKS))
    rate = delta / 6 + CubicSpline(solved, beyond)(np.log(delta))
    t, c = delta / (3 * sqrt(pi) * slip), 2 / (sqrt(pi) * slip) * rate
    # Outside the table: the first chord, and a constant more than the flow without slip.
    c[0] -= (c[1] - c[0]) / (t[1] - t[0]) * t[0]
    c[-1] = c[-2] + 2 * t[-1] - t[-2]
    t[0], t[-1] = 0.0, 2 * t[-1]
    return PoiseuilleCoefficient(t, c)


LAWS: dict[str, Callable[[float], PoiseuilleCoefficient]] = {
    "first-order": lambda accommodation: FIRST_ORDER,
    "kinetic": kinetic,
}


def flow_rate(delta: float, accommodation: float = 1.0) -> float:
    """Reduced flow rate G of plane Poiseuille flow in the BGK model.

    Its arguments are the rarefaction parameter δ = √π g/(2 λ) > 0, and the accommodation σ,
    0 < σ <= 1.

    Galerkin's method with u constant on each of n cells keeps the momentum balance. The error of G
    is of the order of the square of that of u: it falls as 1/n², so that two solutions can be
    extrapolated.
    """
    coarse, fine = (_flow_rate(delta, accommodation, n) for n in (_CELLS, 2 * _CELLS))
    return (4 * fine - coarse) / 3


def _flow_rate(delta: float, accommodation: float, cells: int) -> float:
    """Reduced flow rate on one mesh of cells that become narrower towards the walls.

    The solution of c_x ∂Z/∂x + δ Z = δ u on each cell is exact. Walls reflect the part r = 1 - σ:
    Z(0, c_x) = r Z(0, -c_x), and u is symmetric, so that Z(0, c_x) = r Z(1, c_x) for c_x > 0.
    """
    logarithm = np.arange(_LOWEST, _HIGHEST, _STEP)
    velocity = np.exp(logarithm)
    weight = _STEP * velocity * np.exp(-(velocity**2)) / sqrt(pi)
    edges = _graded(cells, log(30 * (1 + delta)))
    width, r = np.diff(edges), 1 - accommodation
    depth = delta * width[:, None] / velocity
    absorbed = -np.expm1(-depth)
    passed = absorbed / depth  # mean of Z over the cell, for a Z of 1 that enters it
    # Sweep along c_x > 0. Due to u = 1 in cell j only: Z that enters cell k > j, and its mean there
    # over all velocities.
    entering = np.empty((cells, len(velocity)))
    mean = np.diag((1 - passed) @ weight)
    for k in range(cells):
        mean[k, :k] += entering[:k] @ (weight * passed[k])
        entering[:k] *= 1 - absorbed[k]
        entering[k] = absorbed[k]
    of_wall = np.exp(-delta * edges[:-1, None] / velocity) * passed
    of_wall /= 1 - r * np.exp(-delta / velocity)
    mean += (r * weight * of_wall) @ entering.T
    mean = mean + mean[::-1, ::-1]
    if delta <= 1:
        known, source = 0.0, mean.sum(axis=1) / (2 * delta)
    else:
        # Subtract u = δ x (1 - x)/2 + C, a solution away from the walls. The rest of u is due to
        # the walls.
        constant = (2 - accommodation) / accommodation / 2
        known = delta / 6 + 2 * constant

        def at_wall(c_x: np.ndarray) -> np.ndarray:
            return constant + 1 / (2 * delta) - c_x / 2 - c_x**2 / delta

        source = of_wall @ (weight * (r * at_wall(-velocity) - at_wall(velocity)))
        source = source + source[::-1]
    u = np.linalg.solve(np.eye(cells) - mean, source)
    return float(known + 2 * width @ u)


def _graded(cells: int, growth: float) -> np.ndarray:
    """Edges (cells + 1,) of cells from 0 to 1 that grow by e^`growth` from the walls inwards."""
    half = np.expm1(growth * np.linspace(0, 1, cells // 2 + 1)) / np.expm1(growth) / 2
    return np.concatenate([half, 1 - half[-2::-1]])
