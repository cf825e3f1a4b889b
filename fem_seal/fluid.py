"""Liquids and gases as one linear problem.

A liquid obeys ∇·(K ∇p) = 0. For an isothermal ideal gas the mass flux is -ρ K ∇p, ρ = p M/(R T), so
that ∇·(K ∇p²) = 0: the same linear problem in p², whose bounds are those of the gas. The leak rate
of a liquid under the pressure drop T0/(2 T p0) (p_in² - p_out²) is the volume of gas per second at
the reference conditions T0, p0 (as for porous media: M. Muskat, The Flow of Homogeneous Fluids
through Porous Media, 1937, on gases).

Where the gap is not much larger than the mean free path, the gas slips at the walls (`Slip`), and
the mass flux is -(M/(R T)) (g³ p + B g²)/(12 η) ∇p. For a uniform gap that is linear in
φ = p²/2 + s p, s = B/g; other gaps have bounds (`film.law`).
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

    def pressure(self, solved: np.ndarray, slip_pressure: float = 0.0) -> np.ndarray:
        """Pressure [Pa] from the solution [Pa] of the linear problem, 0 at the outlet."""
        return self.outlet_pressure + solved

    def potential(self, pressure: np.ndarray, slip_pressure: float = 0.0) -> np.ndarray:
        """Quantity in whose gradient the flux is linear: the pressure itself [Pa]."""
        return pressure


@dataclass(frozen=True)
class Slip:
    """First-order slip of a gas at both walls of a gap.

    A channel of height g carries g³/(12 η) (p + B/g) per unit of pressure gradient, with
    B = 6 Λ (2 - σ)/σ (J. C. Maxwell 1879; E. B. Arkilic et al., J. Microelectromech. Syst. 6, 167
    (1997)), Λ mean free path times pressure.

    Parameters
    ----------
    inlet_pressure, outlet_pressure : float
        Absolute pressures p_in > p_out >= 0 [Pa].
    product : float
        B > 0 [Pa m], a constant of the gas, its temperature and the walls.
    """

    inlet_pressure: float
    outlet_pressure: float
    product: float

    @property
    def pressures(self) -> tuple[float, float]:
        """Pressures [Pa] of outlet and inlet."""
        return self.outlet_pressure, self.inlet_pressure

    @property
    def mean_pressure(self) -> float:
        """Mean of the two pressures [Pa]."""
        return 0.5 * (self.inlet_pressure + self.outlet_pressure)

    @property
    def length(self) -> float:
        """Gap [m] through which slip carries as much as viscous flow at the mean pressure."""
        return self.product / self.mean_pressure

    def pressure_at(self, gap: float) -> float:
        """Pressure B/g [Pa] at which slip carries as much through a gap [m] as viscous flow."""
        return self.product / gap


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

    def pressure(self, solved: np.ndarray, slip_pressure: float = 0.0) -> np.ndarray:
        """Pressure [Pa] from the solution of the linear problem, 0 at the outlet.

        Without slip it is √(p_out² + (p_in² - p_out²) u), u the solution over its drop; with slip
        √((p_out + s)² + 2 u Δφ) - s, where Δφ is that of p²/2 + s p.

        Parameters
        ----------
        solved : array
            Solution of the linear problem, `pressure_drop` at the inlet.
        slip_pressure : float
            s [Pa]; exact where slip carries as much as viscous flow at the pressure s.
        """
        p_out, s = self.outlet_pressure, slip_pressure
        rise = 2 * (self._mean_pressure + s) * self._difference * (solved / self.pressure_drop)
        # Rounding errors of the solver may make the sum negative next to a vacuum.
        inside = np.maximum((p_out + 2 * s) * p_out + rise, 0.0)
        return np.sqrt(inside) if s == 0 else inside / (np.sqrt(inside + s * s) + s)

    def potential(self, pressure: np.ndarray, slip_pressure: float = 0.0) -> np.ndarray:
        """Quantity in whose gradient the flux is linear: p² + 2 s p [Pa²], s as of `pressure`."""
        return pressure**2 + 2 * slip_pressure * pressure

    def slip(self, viscosity: float, accommodation: float) -> Slip:
        """First-order slip of the gas.

        Parameters
        ----------
        viscosity : float
            Dynamic viscosity η [Pa s].
        accommodation : float
            Part σ of the molecules that a wall reflects diffusely, 0 < σ <= 1.
        """
        path_times_pressure = self.mean_free_path(viscosity) * self._mean_pressure
        product = 6 * path_times_pressure * (2 - accommodation) / accommodation
        return Slip(self.inlet_pressure, self.outlet_pressure, product)

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
