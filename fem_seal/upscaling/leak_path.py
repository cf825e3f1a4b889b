"""The leak path of a seal: its width along the flow, and the pressures at its ends."""

from dataclasses import dataclass, replace
from math import pi
from typing import TypeVar

import numpy as np

from fem_seal.arguments import require_not_negative, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.fluid import Drive, GasDrive, Slip

T = TypeVar("T", float, np.ndarray)


@dataclass(frozen=True)
class StraightPath:
    """A leak path of constant width."""

    length: float  #: L along the flow [m]
    circumference: float  #: W across it [m]

    def __post_init__(self) -> None:
        require_positive(length=self.length, circumference=self.circumference)

    def resistance(self, x: np.ndarray) -> np.ndarray:
        """∫ dx/W from the inlet to x [m], without unit."""
        return np.asarray(x) / self.circumference


@dataclass(frozen=True)
class RingPath:
    """A flat ring, through which the fluid leaks from one radius to the other."""

    inlet_radius: float  #: [m]; the inlet may be inside or outside
    outlet_radius: float  #: [m]

    def __post_init__(self) -> None:
        require_positive(inlet_radius=self.inlet_radius, outlet_radius=self.outlet_radius)
        if self.length == 0:
            raise InvalidInput("the radii of a ring must differ")

    @property
    def length(self) -> float:
        """``L = |r_outlet - r_inlet|`` [m]."""
        return abs(self.outlet_radius - self.inlet_radius)

    @property
    def circumference(self) -> float:
        """Mean circumference [m]."""
        return pi * (self.outlet_radius + self.inlet_radius)

    def resistance(self, x: np.ndarray) -> np.ndarray:
        """``|ln(r/r_inlet)|``/(2π) from the inlet to x [m], without unit."""
        outwards = 1 if self.outlet_radius > self.inlet_radius else -1
        return np.abs(np.log1p(outwards * np.asarray(x) / self.inlet_radius)) / (2 * pi)


LeakPath = StraightPath | RingPath


@dataclass(frozen=True)
class EndPressures:
    """Pressures above ambient at both ends, and the quantity Φ whose gradient drives the fluid."""

    inlet: float  #: p_in > p_out [Pa], above the pressure on the back of the solid
    outlet: float = 0.0  #: p_out [Pa]
    ambient: float = 0.0  #: absolute pressure on the back of the solid [Pa]; used for a gas only
    #: 0 for a liquid, Φ = p. For a gas T0/(2 T p0) [1/Pa], Φ = per_square × p_abs²: volumes count
    #: at T0 and p0
    per_square: float = 0.0
    #: b [Pa]: the conductivity of a gas that slips goes as 1 + b/p_abs
    slip: float = 0.0

    def __post_init__(self) -> None:
        if not self.inlet > self.outlet:
            raise InvalidInput(
                f"the inlet's pressure, {self.inlet:g} Pa, must be above the outlet's, "
                f"{self.outlet:g} Pa"
            )
        require_not_negative(ambient=self.ambient, per_square=self.per_square, slip=self.slip)

    @classmethod
    def of(cls, drive: Drive, gauge_pressures: tuple[float, float]) -> "EndPressures":
        """Pressures of a scene, those of inlet and outlet above ambient [Pa]."""
        inlet, outlet = gauge_pressures
        if not isinstance(drive, GasDrive):
            return cls(inlet, outlet)
        squares = drive.inlet_pressure**2 - drive.outlet_pressure**2
        ambient = drive.outlet_pressure - outlet
        return cls(inlet, outlet, ambient, drive.pressure_drop / squares)

    def slipping(self, slip: Slip, gap: float) -> "EndPressures":
        """The ends for a K at the mean pressure, which changes with p as that of a gap [m].

        K(p) dΦ = K(p_mean) dΦ' with Φ' = per_square (p_abs + b)²/(1 + b/p_mean), but for a
        constant.
        """
        added = slip.added_pressure(gap)
        per_square = self.per_square / (1 + added / slip.mean_pressure)
        return replace(self, per_square=per_square, slip=added)

    @property
    def offset(self) -> float:
        """What is added [Pa] to a pressure above ambient before it is squared in Φ."""
        return self.ambient + self.slip

    def potential(self, pressure: T) -> T:
        """Φ [Pa] of a pressure above ambient [Pa], or of many."""
        if self.per_square == 0:
            return pressure
        return self.per_square * (pressure + self.offset) ** 2

    @property
    def drop(self) -> float:
        """Φ(p_in) - Φ(p_out) [Pa]."""
        return self.potential(self.inlet) - self.potential(self.outlet)
