"""The law of the film: what the fluid makes of a gap.

The volume flux per width [m²/s] through a gap g under a pressure gradient is j = -K ∇p. A gas that
slips at the walls has, for each pressure, a K of the form α g³ + β g² (first order in the mean free
path), and its pressure is known only to lie between those of outlet and inlet. What the bounds of
the flow need is the largest and the smallest K over that interval (`FilmLaw`).
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from fem_seal.fluid import Slip

Gap = TypeVar("Gap", float, np.float64, np.ndarray)
Coefficients = tuple[Gap, Gap]


def film_conductivity(gap: Gap, viscosity: float) -> Gap:
    """Film conductivity K = g³/(12 η) of a Newtonian fluid between parallel walls (Reynolds 1886).

    Parameters
    ----------
    gap : float, array or UFL expression [m]
    viscosity : float
        η [Pa s].

    Returns
    -------
    as `gap` [m³/(Pa s)]
    """
    return gap**3 / (12 * viscosity)


@dataclass(frozen=True)
class Conductivity:
    """κ(g) = α g³ + β g², one pair (α, β) below a gap, the knee, and another one above it.

    The gap is in units of the largest one, κ in units of that of the film as a whole. κ is
    continuous at the knee. If α is larger above the knee, κ is the larger one of the two forms
    everywhere, else the smaller one.

    Parameters
    ----------
    narrow : (float, float)
        α, β below the knee.
    wide : (float, float), optional
        α, β above it; None: the same everywhere.
    knee : float
        Gap at which the two forms agree.
    """

    narrow: tuple[float, float] = (1.0, 0.0)
    wide: tuple[float, float] | None = None
    knee: float = np.inf

    @property
    def is_cube(self) -> bool:
        """Whether κ = g³."""
        return self.narrow == (1.0, 0.0) and self.wide is None

    def coefficients(self, low: Gap, high: Gap) -> Coefficients:
        """α and β of a bound of κ for gaps between `low` and `high`.

        Of the larger one of two forms it is a bound from above, of the smaller one a bound from
        below, and exact if the knee is not between the two gaps: in g² max(g - knee, 0) the convex
        factor gives way to its chord. On a part of the interval the bound is nowhere wider.
        """
        if self.wide is None:
            return self.narrow
        least, most = np.broadcast_arrays(low, high)
        above, below = least >= self.knee, most <= self.knee
        straddles = ~above & ~below
        slope = np.where(above, 1.0, 0.0)
        share = slope.copy()
        slope[straddles] = ((most - self.knee) / np.where(straddles, most - least, 1.0))[straddles]
        share[straddles] = slope[straddles] * least[straddles] / self.knee
        (cubic, square), (wide_cubic, wide_square) = self.narrow, self.wide
        return (
            (1 - slope) * cubic + slope * wide_cubic,
            (1 - share) * square + share * wide_square,
        )

    def of_gap(self, gap: Gap) -> Gap:
        """κ of a gap, exactly."""
        if self.is_cube:
            return gap**3
        cubic, square = self.coefficients(gap, gap)
        return cubic * gap**3 + square * gap**2


@dataclass(frozen=True)
class FilmLaw:
    """Conductivities that bound that of the film: one from above, and one from below.

    Parameters
    ----------
    above, below : Conductivity
        The same if the conductivity is known; else the larger one of two forms, and the smaller.
    """

    above: Conductivity
    below: Conductivity


CUBE = FilmLaw(Conductivity(), Conductivity())


def mean_pressure_law(slip: Slip, highest: float) -> FilmLaw:
    """The film at the mean pressure p: (p g³ + q g²)/(p + q), q = B over the largest gap.

    Parameters
    ----------
    slip : Slip
    highest : float
        Largest gap [m].
    """
    p, q = slip.mean_pressure, slip.pressure_at(highest)
    known = Conductivity((p / (p + q), q / (p + q)))
    return FilmLaw(known, known)


def bounding_law(slip: Slip, highest: float, above: float, below: float) -> FilmLaw:
    """Largest and smallest conductivity over all pressures, in the units of `mean_pressure_law`.

    With φ(p) = p²/2 + s p the mass flux is -(M/RT) κ ∇φ, κ = (p g³ + q g²)/(12 η (p + s)), which is
    monotone in p, and the same for all p at the gap g = q/s. The linear problem with the largest κ
    has at least the true mass rate and that with the smallest κ at most, for any s ≥ 0: p lies
    between the two pressures, and the flow grows with κ (Rayleigh).

    Parameters
    ----------
    slip : Slip
    highest : float
        Largest gap [m].
    above, below : float
        s [Pa] of either bound. 0 wants an outlet pressure above 0.
    """
    q, mean = slip.pressure_at(highest), slip.mean_pressure

    def forms(s: float) -> tuple[tuple[float, float], tuple[float, float], float]:
        # The difference of φ belongs to κ here: Δφ = (p_in - p_out) (mean + s).
        scales = [(mean + s) / (mean + q) / (p + s) for p in slip.pressures]
        outlet, inlet = (
            (scale * p, scale * q) for scale, p in zip(scales, slip.pressures, strict=True)
        )
        return outlet, inlet, q / s if s > 0 else np.inf

    outlet, inlet, knee = forms(above)
    largest = Conductivity(outlet, inlet, knee)
    outlet, inlet, knee = forms(below)
    return FilmLaw(largest, Conductivity(inlet, outlet, knee))
