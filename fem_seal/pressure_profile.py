"""The pressure across a contact, P(x): uniform, Hertz's, or a table, as from finite elements.

P is the total normal stress, carried by the solid and the fluid together.
"""

from dataclasses import dataclass, replace
from math import pi, sqrt
from pathlib import Path

import numpy as np

from fem_seal.arguments import require_positive
from fem_seal.errors import InvalidInput
from fem_seal.field_file.column_titles import column_titles, names_units
from fem_seal.field_file.text_table import is_comment, read_table

_SI = "m", "Pa"  # units of x and pressure in a table that names none


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

    @property
    def mean(self) -> float:
        """Mean pressure over the width [Pa]."""
        return pi / 4 * self.maximum

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
        if not (rises := (np.diff(x) > 0) & np.isfinite(np.diff(x))).all():
            before, after = x[np.argmin(rises) :][:2]
            raise InvalidInput(
                "the places x of a pressure profile must be numbers that ascend, and "
                f"{before:g} m stands before {after:g} m"
            )
        if not np.isfinite(P).all() or P.min() < 0 or P.max() == 0:
            raise InvalidInput(
                f"the pressures of a profile, {P.min():g} to {P.max():g} Pa, must be finite, >= 0 "
                "and not all 0; compression is positive"
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

    @property
    def mean(self) -> float:
        """Mean pressure over the length [Pa]."""
        middles = 0.5 * (self.pressure[1:] + self.pressure[:-1])
        return float(np.diff(self.x) @ middles / self.length)

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


def read_profile(path: Path) -> TabulatedProfile:
    """Read a table of x and pressure, as finite-element codes write it.

    Two columns, whose titles may name their units: "x [mm], pressure [MPa]". Without any they are m
    and Pa, unless the header names another unit. InvalidInput if it is no such table, or the units
    are not clear.
    """
    table = read_table(path, columns=2)
    titles = column_titles(table)
    axes = [title.axis for title in titles]
    order = (1, 0) if "p" in axes[:1] or axes[1:] == ["x"] else (0, 1)
    sizes = [titles[k].size(si, path) if titles else None for k, si in zip(order, _SI, strict=True)]
    words = [line for line in table.header if line.strip(";, \t")]
    unclear = [line for line in words if not titles and not is_comment(line)]
    if None in sizes:
        unclear += [line for line in table.header if names_units(line) or sizes != [None, None]]
    if unclear:
        raise InvalidInput(
            f"{path}: the units of both columns must stand in one line such as 'x [mm], pressure "
            f"[MPa]', not as in {unclear[-1].strip()!r}; without any they are m and Pa"
        )
    x, pressure = (table.values[:, k] * (size or 1) for k, size in zip(order, sizes, strict=True))
    try:
        return TabulatedProfile(x, pressure)
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None
