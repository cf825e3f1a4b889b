"""The pressure across a contact, P(x): uniform, Hertz's, or a table, as from finite elements.

P is the total normal stress, carried by the solid and the fluid together.
"""

from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.registry import require_positive


@dataclass(frozen=True)
class Hertz:
    """Pressure of a cylinder on a plane, P(x) = P_max √(1 - (x - a)²/a²)."""

    maximum: float  #: P_max [Pa], > 0; π/4 of it is the mean pressure
    length: float  #: width 2 a of the contact [m], > 0

    def __post_init__(self) -> None:
        require_positive(maximum=self.maximum, length=self.length)

    @classmethod
    def pressed(cls, line_load: float, radius: float, contact_modulus: float) -> "Hertz":
        """Contact of a cylinder: a = 2 √(w R/(π E*)), P_max = 2 w/(π a).

        w is the force per length [N/m]; of two cylinders 1/R = 1/R1 + 1/R2. K. L. Johnson, Contact
        Mechanics (Cambridge, 1985), eqs. 4.43 and 4.45.
        """
        require_positive(line_load=line_load, radius=radius, contact_modulus=contact_modulus)
        a = 2 * sqrt(line_load * radius / (pi * contact_modulus))
        return cls(2 * line_load / (pi * a), 2 * a)

    @property
    def nodes(self) -> np.ndarray:
        """Both ends and the middle [m]."""
        return np.array([0.0, 0.5 * self.length, self.length])

    @property
    def highest(self) -> float:
        """P_max [Pa]."""
        return self.maximum

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Pressure [Pa] at x [m]."""
        from_middle = 2 * np.asarray(x) / self.length - 1
        return self.maximum * np.sqrt(np.maximum(1 - from_middle**2, 0.0))

    def times(self, part: float) -> "Hertz":
        """A part of the pressure over the same width."""
        return replace(self, maximum=part * self.maximum)


@dataclass(frozen=True, eq=False)
class TabulatedProfile:
    """Pressure that is linear between the places of a table."""

    #: (n,), places [m] along the leak path, ascending from the inlet; the first one becomes 0. n >=
    #: 2
    x: np.ndarray
    pressure: np.ndarray  #: (n,), P [Pa], >= 0, not 0 everywhere

    def __post_init__(self) -> None:
        x, P = np.array(self.x, dtype=float), np.array(self.pressure, dtype=float)
        if x.ndim != 1 or x.shape != P.shape or x.size < 2:
            raise InvalidInput(
                "a pressure profile needs as many pressures as places, at least two; got "
                f"{x.size} places and {P.size} pressures"
            )
        if not (np.isfinite(x).all() and (np.diff(x) > 0).all()):
            raise InvalidInput("the places x of a pressure profile must be numbers that ascend")
        if not np.isfinite(P).all() or P.min() < 0 or P.max() == 0:
            raise InvalidInput(
                "the pressures of a profile must be numbers, not negative, and not all 0"
            )
        object.__setattr__(self, "x", x - x[0])
        object.__setattr__(self, "pressure", P)

    @property
    def length(self) -> float:
        """L [m]."""
        return float(self.x[-1])

    @property
    def nodes(self) -> np.ndarray:
        """Places of the table [m]."""
        return self.x

    @property
    def highest(self) -> float:
        """Largest pressure of the table [Pa]."""
        return float(self.pressure.max())

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Pressure [Pa] at x [m]."""
        return np.interp(x, self.x, self.pressure)

    def times(self, part: float) -> "TabulatedProfile":
        """A part of the pressure."""
        return replace(self, pressure=part * self.pressure)


# x = 0 at the inlet; between neighbouring `nodes` the pressure is monotone.
Profile = Hertz | TabulatedProfile


def uniform(pressure: float, length: float) -> TabulatedProfile:
    """The same pressure P [Pa] on a length [m]."""
    require_positive(pressure=pressure, length=length)
    return TabulatedProfile(np.array([0.0, length]), np.full(2, pressure))


def is_uniform(profile: Profile) -> bool:
    """Whether the pressure is the same everywhere."""
    return bool(np.ptp(profile(profile.nodes)) == 0)
