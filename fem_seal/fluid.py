"""What a fluid makes of a conductance: the linear problem behind a liquid and behind a gas.

A liquid obeys ∇·(K ∇p) = 0. For an isothermal ideal gas the mass flux is -ρ K ∇p, ρ = p M/(R T),
so that ∇·(K ∇p²) = 0: the same linear problem in p², and its bounds are those of the gas. Solving
it as a liquid under the pressure drop T0/(2 T p0) (p_in² - p_out²) gives the volume per second at
the reference conditions T0, p0 at once (as for porous media: M. Muskat, The Flow of Homogeneous
Fluids through Porous Media, 1937, on gases). The gas does not slip at the walls.
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

GAS_CONSTANT = 8.31446261815324  # J/(mol K), exact in the SI since 2019


@dataclass(frozen=True)
class LiquidDrive:
    """An incompressible liquid pushed through by a pressure drop [Pa].

    outlet_pressure : what the pressures in results count from [Pa]
    """

    pressure_drop: float
    outlet_pressure: float = 0.0

    @property
    def rates(self) -> dict[str, float]:
        """What 1 m³/s of a solved leak rate is, by kind of rate, in SI units."""
        return {"volume": 1.0}

    def pressure(self, solved: np.ndarray) -> np.ndarray:
        """Pressure [Pa] where the linear problem has `solved`, `pressure_drop` at the inlet."""
        return self.outlet_pressure + solved

    def potential(self, pressure: np.ndarray) -> np.ndarray:
        """What the flux is linear in, of pressures [Pa]: themselves."""
        return pressure


@dataclass(frozen=True)
class GasDrive:
    """An isothermal ideal gas between two absolute pressures.

    inlet_pressure, outlet_pressure : absolute [Pa], inlet > outlet >= 0
    temperature : of the gas and the walls [K]
    molar_mass : [kg/mol]
    reference_temperature, reference_pressure : at which volumes are counted [K], [Pa]
    """

    inlet_pressure: float
    outlet_pressure: float
    temperature: float
    molar_mass: float
    reference_temperature: float
    reference_pressure: float

    @property
    def pressure_drop(self) -> float:
        """Of the liquid that leaks as much as this gas at reference conditions [Pa]."""
        warmer = self.reference_temperature / self.temperature
        return self._mean_pressure / self.reference_pressure * warmer * self._difference

    @property
    def rates(self) -> dict[str, float]:
        """What 1 m³/s at reference conditions is, by kind of rate, in SI units."""
        amount = self.reference_pressure / (GAS_CONSTANT * self.reference_temperature)
        return {
            "volume": 1.0,
            "throughput": amount * GAS_CONSTANT * self.temperature,
            "amount": amount,
            "mass": amount * self.molar_mass,
        }

    def pressure(self, solved: np.ndarray) -> np.ndarray:
        """Pressure [Pa] where the linear problem has `solved`, `pressure_drop` at the inlet."""
        p_out = self.outlet_pressure
        risen = 2 * self._mean_pressure * self._difference * (solved / self.pressure_drop)
        # Rounding of the solver may go below the outlet, which may be a vacuum.
        return np.sqrt(np.maximum(p_out**2 + risen, 0.0))

    def potential(self, pressure: np.ndarray) -> np.ndarray:
        """What the flux is linear in, of pressures [Pa]: their squares [Pa²]."""
        return pressure**2

    def mean_free_path(self, viscosity: float) -> float:
        """Mean free path [m] at the mean of the two pressures, η/p √(π R T/(2 M)).

        The definition by viscosity that kinetic theory uses. Where a gap is not much higher, the
        gas slips and more of it leaks than Reynolds' equation says.

        Parameters
        ----------
        viscosity : dynamic viscosity η [Pa s]
        """
        speed = sqrt(pi * GAS_CONSTANT * self.temperature / (2 * self.molar_mass))
        return viscosity / self._mean_pressure * speed

    @property
    def _mean_pressure(self) -> float:
        return 0.5 * (self.inlet_pressure + self.outlet_pressure)

    @property
    def _difference(self) -> float:
        return self.inlet_pressure - self.outlet_pressure


Drive = LiquidDrive | GasDrive
