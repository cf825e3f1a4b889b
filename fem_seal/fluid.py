"""Liquids and gases as one linear problem.

A liquid obeys ∇·(K ∇p) = 0. The mass flux of an isothermal ideal gas is -ρ K ∇p with
ρ = p M/(R T), so that ∇·(K ∇p²) = 0. That is the same linear problem in p², with the same bounds:
the volume of gas per second at the reference conditions T0, p0 is the leak rate of a liquid under
the pressure drop T0/(2 T p0) (p_in² - p_out²) (as for porous media: M. Muskat, The Flow of
Homogeneous Fluids through Porous Media, 1937, on gases).

Where the gap is not much larger than the mean free path, the gas slips at the walls (`Slip`), and
the mass flux is -(M/(R T)) B g² c(g p/B)/(12 η) ∇p (`rarefied`). In a uniform gap this flux is
linear in the gradient of ∫ c(g p/B) dp; for other gaps there are bounds (`film.slip_bounds`).
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from fem_seal.arguments import choose, require_not_negative, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.rarefied import FIRST_ORDER, LAWS, PoiseuilleCoefficient

GAS_CONSTANT = 8.31446261815324  # J/(mol K), exact in the SI since 2019


def volume_conditions(temperature: float, pressure: float) -> str:
    """Text of the temperature [K] and pressure [Pa] of a volume, "at 0 degC, 1.013 bar"."""
    return f"at {temperature - 273.15:.4g} degC, {1e-5 * pressure:.4g} bar"


@dataclass(frozen=True)
class LiquidDrive:
    """An incompressible liquid under a pressure drop."""

    pressure_drop: float  #: δp = p_in - p_out [Pa]
    outlet_pressure: float = 0.0  #: p_out [Pa]

    def __post_init__(self) -> None:
        require_positive(pressure_drop=self.pressure_drop)
        require_not_negative(outlet_pressure=self.outlet_pressure)

    @property
    def rates(self) -> dict[str, float]:
        """Leak rate in SI units, for each kind in `units.RATES`, per m³/s of the linear problem."""
        return {"volume": 1.0}

    def pressure(self, solved: np.ndarray) -> np.ndarray:
        """Pressure [Pa] from the solution [Pa] of the linear problem, 0 at the outlet."""
        return self.outlet_pressure + solved

    def potential(self, pressure: np.ndarray) -> np.ndarray:
        """Quantity that is linear in the solution: the pressure itself [Pa]."""
        return pressure


@dataclass(frozen=True)
class TwoPressures:
    """Absolute pressures of a gas at the two ends of a film."""

    inlet_pressure: float  #: p_in > p_out [Pa]
    outlet_pressure: float  #: p_out >= 0 [Pa]

    def __post_init__(self) -> None:
        require_positive(inlet_pressure=self.inlet_pressure)
        require_not_negative(outlet_pressure=self.outlet_pressure)
        if not self.inlet_pressure > self.outlet_pressure:
            raise InvalidInput(
                f"inlet_pressure = {self.inlet_pressure:g} Pa must be above outlet_pressure = "
                f"{self.outlet_pressure:g} Pa; swap the gap's ends if it leaks the other way"
            )

    @property
    def mean_pressure(self) -> float:
        """Mean of the two pressures [Pa]."""
        return 0.5 * (self.inlet_pressure + self.outlet_pressure)


@dataclass(frozen=True)
class Slip(TwoPressures):
    """Slip of a gas at both walls of a gap.

    A channel of height g carries B g² c(g p/B)/(12 η) per unit of pressure gradient, with
    B = 6 λ p (2 - σ)/σ, λ the mean free path at p. To first order that is
    g³/(12 η) (p + B/g) (J. C. Maxwell 1879; E. B. Arkilic et al., J. Microelectromech. Syst. 6, 167
    (1997)).
    """

    product: float  #: B > 0 [Pa m], a constant of the gas, its temperature and the walls
    coefficient: PoiseuilleCoefficient = FIRST_ORDER  #: the function c

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(product=self.product)

    def per_square_gap(self, gap: np.ndarray | float) -> np.ndarray:
        """12 η K/g² = c(g p/B) B/p [m] at the mean pressure p, of a gap g [m].

        To first order g + B/p; without slip it would be g.
        """
        per_metre = self.mean_pressure / self.product
        return self.coefficient(gap * per_metre) / per_metre

    def gain(self, gap: float) -> float:
        """Conductivity of a gap [m] at the mean pressure, over its conductivity without slip."""
        return float(self.per_square_gap(gap)) / gap

    def change(self, pressure: np.ndarray | float, gap: float) -> np.ndarray:
        """Conductivity of a gap [m] at pressures p > 0 [Pa] over that at the mean pressure."""
        t = gap * pressure / self.product
        return self.coefficient(t) / t / self.gain(gap)

    def added_pressure(self, gap: float) -> float:
        """Pressure b [Pa] with which the conductivity of a gap [m] goes as 1 + b/p.

        To first order b = B/g. For another law 1 + b/p has the ratio of the conductivities at the
        inlet's and the mean pressure. b is at most 1000 p_in, with which the conductivity goes as
        1/p up to a thousandth.
        """
        ratio = float(self.change(self.inlet_pressure, gap))
        slope = ratio / self.mean_pressure - 1 / self.inlet_pressure
        return (1 - ratio) / max(slope, 1e-3 / self.inlet_pressure)

    def mean_gain(self, gap: float) -> float:
        """Leak rate of a uniform gap [m] over its leak rate without slip; to first order `gain`."""
        # A difference of two potentials would lose the digits that both pressures share.
        pressures = self.kinks_and_ends(gap)
        c = self.coefficient(gap * pressures / self.product)
        mean = np.diff(pressures) @ (c[1:] + c[:-1]) / 2 / (pressures[-1] - pressures[0])
        return float(mean) / self.mean_pressure * (self.product / gap)

    def kinks_and_ends(self, gap: float) -> np.ndarray:
        """Outlet pressure, pressures at which c(g p/B) of a gap [m] has kinks, inlet pressure."""
        p_out, p_in = self.outlet_pressure, self.inlet_pressure
        kinks = self.coefficient.kinks * (self.product / gap)
        return np.concatenate([[p_out], kinks[(kinks > p_out) & (kinks < p_in)], [p_in]])

    def potential(self, pressure: np.ndarray | float, gap: float) -> np.ndarray:
        """Potential φ = ∫ c(g p/B) dp [Pa]: the flux through a uniform gap [m] is linear in ∇φ.

        To first order φ = p + p² g/(2 B).
        """
        return self.coefficient.integral(gap * pressure / self.product) * (self.product / gap)

    def pressure(self, potential: np.ndarray | float, gap: float) -> np.ndarray:
        """Pressure [Pa] with a given potential [Pa] in a uniform gap [m]."""
        per_pascal = gap / self.product
        return self.coefficient.inverse_integral(potential * per_pascal) / per_pascal


@dataclass(frozen=True)
class GasDrive(TwoPressures):
    """An isothermal ideal gas between two absolute pressures."""

    temperature: float  #: T of the gas and the walls [K]
    molar_mass: float  #: M [kg/mol]
    reference_temperature: float  #: T0 [K], at which volumes are stated
    reference_pressure: float  #: p0 [Pa], at which volumes are stated

    def __post_init__(self) -> None:
        super().__post_init__()
        require_positive(
            temperature=self.temperature,
            molar_mass=self.molar_mass,
            reference_temperature=self.reference_temperature,
            reference_pressure=self.reference_pressure,
        )

    @property
    def pressure_drop(self) -> float:
        """Δp [Pa] of the equivalent liquid, T0/(2 T p0) (p_in² - p_out²)."""
        temperatures = self.reference_temperature / self.temperature
        difference = self.inlet_pressure - self.outlet_pressure
        return self.mean_pressure / self.reference_pressure * temperatures * difference

    @property
    def conditions(self) -> str:
        """Text of the conditions at which volumes are stated."""
        return volume_conditions(self.reference_temperature, self.reference_pressure)

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
        """Pressure [Pa] without slip, √(p_out² + (p_in² - p_out²) u), u = solved/pressure_drop."""
        p_out, part = self.outlet_pressure, solved / self.pressure_drop
        # Rounding errors of the solver may make the sum negative next to a vacuum.
        square = p_out * p_out + 2 * self.mean_pressure * (self.inlet_pressure - p_out) * part
        return np.sqrt(np.maximum(square, 0.0))

    def potential(self, pressure: np.ndarray) -> np.ndarray:
        """Quantity that is linear in the solution without slip."""
        return pressure**2

    def slip(self, viscosity: float, accommodation: float, law: str = "first-order") -> Slip:
        """Slip of a gas of viscosity η [Pa s] at the walls, by a law of `rarefied.LAWS`.

        The walls reflect the part σ of the molecules diffusely, 0 < σ <= 1, the accommodation.
        """
        require_positive(viscosity=viscosity)
        if not 0 < accommodation <= 1:
            raise InvalidInput(f"accommodation = {accommodation!r} must be above 0, and at most 1")
        path_times_pressure = self.mean_free_path(viscosity) * self.mean_pressure
        product = 6 * path_times_pressure * (2 - accommodation) / accommodation
        coefficient = choose(LAWS, law, "slip")(accommodation)
        return Slip(self.inlet_pressure, self.outlet_pressure, product, coefficient)

    def mean_free_path(self, viscosity: float) -> float:
        """Mean free path η/p √(π R T/(2 M)) [m] at the mean of the two pressures; η in Pa s.

        This is the viscosity-based definition of kinetic theory.
        """
        speed = sqrt(pi * GAS_CONSTANT * self.temperature / (2 * self.molar_mass))
        return viscosity / self.mean_pressure * speed


Drive = LiquidDrive | GasDrive


def pressure_of(solved: np.ndarray, drive: Drive, slip: Slip | None, critical: float) -> np.ndarray:
    """Pressure [Pa] from the solution of the linear problem, `pressure_drop` at the inlet.

    With slip its potential in the gap of the critical constriction [m] is linear in the solution,
    which is exact in a gap of that height.
    """
    if slip is None:
        return drive.pressure(solved)
    at_outlet = slip.potential(slip.outlet_pressure, critical)
    drop = slip.potential(slip.inlet_pressure, critical) - at_outlet
    return slip.pressure(at_outlet + drop * (solved / drive.pressure_drop), critical)
