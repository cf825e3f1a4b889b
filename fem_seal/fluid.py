"""Liquids and gases as one linear problem.

A liquid obeys ∇·(K ∇p) = 0. For an isothermal ideal gas the mass flux is -ρ K ∇p, ρ = p M/(R T), so
that ∇·(K ∇p²) = 0: the same linear problem in p², whose bounds are those of the gas. The leak rate
of a liquid under the pressure drop T0/(2 T p0) (p_in² - p_out²) is the volume of gas per second at
the reference conditions T0, p0 (as for porous media: M. Muskat, The Flow of Homogeneous Fluids
through Porous Media, 1937, on gases). The gas does not slip at the walls.
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

GAS_CONSTANT = 8.31446261815324  # J/(mol K), exact in the SI since 2019


@dataclass(frozen=True)
class LiquidDrive:
    """An incompressible liquid under a pressure drop.

    Parameters
    ----------
    pressure_drop : float
        Δp = p_in - p_out [Pa].
    outlet_pressure : float
        p_out [Pa].
    """

    pressure_drop: float
    outlet_pressure: float = 0.0

    @property
    def rates(self) -> dict[str, float]:
        """Leak rate in SI units, for each kind in `units.RATES`, per m³/s of the linear problem."""
        return {"volume": 1.0}

    def pressure(self, solved: np.ndarray) -> np.ndarray:
        """Pressure [Pa] from the solution [Pa] of the linear problem, 0 at the outlet."""
        return self.outlet_pressure + solved

    def potential(self, pressure: np.ndarray) -> np.ndarray:
        """Quantity in whose gradient the flux is linear: the pressure itself [Pa]."""
        return pressure


@dataclass(frozen=True)
class GasDrive:
    """An isothermal ideal gas between two absolute pressures.

    Parameters
    ----------
    inlet_pressure, outlet_pressure : float
        Absolute pressures p_in > p_out >= 0 [Pa].
    temperature : float
        T of the gas and the walls [K].
    molar_mass : float
        M [kg/mol].
    reference_temperature, reference_pressure : float
        T0 [K] and p0 [Pa], the conditions at which volumes are stated.
    """

    inlet_pressure: float
    outlet_pressure: float
    temperature: float
    molar_mass: float
    reference_temperature: float
    reference_pressure: float

    @property
    def pressure_drop(self) -> float:
        """Δp [Pa] of the equivalent liquid, T0/(2 T p0) (p_in² - p_out²)."""
        temperatures = self.reference_temperature / self.temperature
        return self._mean_pressure / self.reference_pressure * temperatures * self._difference

    @property
    def rates(self) -> dict[str, float]:
        """Leak rate in SI units, for each kind in `units.RATES`, per m³/s at T0 and p0."""
        amount = self.reference_pressure / (GAS_CONSTANT * self.reference_temperature)
        return {
            "volume": 1.0,
            "throughput": amount * GAS_CONSTANT * self.temperature,
            "amount": amount,
            "mass": amount * self.molar_mass,
        }

    def pressure(self, solved: np.ndarray) -> np.ndarray:
        """Pressure √(p_out² + (p_in² - p_out²) s/Δp) [Pa], s the solution of the linear problem."""
        p_out = self.outlet_pressure
        rise = 2 * self._mean_pressure * self._difference * (solved / self.pressure_drop)
        # Rounding errors of the solver may make the sum negative next to a vacuum.
        return np.sqrt(np.maximum(p_out**2 + rise, 0.0))

    def potential(self, pressure: np.ndarray) -> np.ndarray:
        """Quantity in whose gradient the flux is linear: the square of the pressure [Pa²]."""
        return pressure**2

    def mean_free_path(self, viscosity: float) -> float:
        """Mean free path η/p √(π R T/(2 M)) at the mean of the two pressures.

        This is the viscosity-based definition of kinetic theory. Where the gap is not much larger,
        the gas slips at the walls, and more of it leaks than Reynolds' equation predicts.

        Parameters
        ----------
        viscosity : float
            Dynamic viscosity η [Pa s].

        Returns
        -------
        float [m]
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
