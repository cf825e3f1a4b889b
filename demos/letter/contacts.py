"""The letter's surfaces, its two models of contact, and the certified leak rate of a contact."""

from dataclasses import dataclass

import numpy as np

from fem_seal.contact import ElasticSolid, GapState, Load, bearing, press
from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.surface import Spectrum, self_affine

# All results are ratios, in which these values cancel.
PITCH = 1e-6  # distance of samples [m]
SLOPE = 0.1  # rms slope h'rms
CONTACT_MODULUS = 10e6  # E* [Pa]
VISCOSITY = 1e-3  # [Pa s]
PRESSURE_DROP = 1e5  # [Pa]

MODELS = ("bearing", "elastic")
SIDES = "periodic"  # of the flow, as of the contact


@dataclass(frozen=True)
class RoughCase:
    """An ensemble of self-affine surfaces on n x n samples; the letter has 4096, 0.8, 1 and 1/8."""

    n: int  #: samples along a side
    hurst: float = 0.8
    short: float = 1.0  #: short cut-off λ_s [samples]
    long: float = 0.125  #: long cut-off λ_l over the side

    def __post_init__(self) -> None:
        if not self.n >= 8:
            raise InvalidInput(f"the side must have at least 8 samples, got {self.n}")
        if not 1 <= self.short < self.long * self.n <= self.n:
            raise InvalidInput(
                "cut-offs must satisfy 1 sample <= short < long <= side, got "
                f"{self.short} and {self.long * self.n} of {self.n} samples"
            )

    def __str__(self) -> str:
        return f"n{self.n}-H{self.hurst:g}-short{self.short:g}-long{self.long * self.n:g}"

    def surface(self, seed: int) -> GridField:
        """Heights [m] of one member, with the rms slope SLOPE to rounding."""
        side = self.n * PITCH
        spectrum = Spectrum(self.hurst, self.long * side, self.short * PITCH)
        return self_affine(spectrum, (self.n,) * 2, (side, side), rms_slope=SLOPE, seed=seed)


def pressed(
    surface: GridField, model: str, load: float, start: np.ndarray | None = None
) -> GapState:
    """Contact under a load: A/A0 of the bearing model, p/(E* h'rms) of the elastic one.

    An elastic contact may start from the pressure [Pa] of another one.
    """
    if model == "bearing":
        return bearing(surface, area_fraction=load)
    pressure = Load("pressure", load * CONTACT_MODULUS * SLOPE)
    return press(surface, ElasticSolid(CONTACT_MODULUS), pressure, start=start)


def at_area(surface: GridField, model: str, area_fraction: float) -> GapState:
    """Contact of a given A/A0; 0 is first contact, and the same in both models."""
    if model == "bearing":
        return bearing(surface, area_fraction=area_fraction)
    return press(surface, ElasticSolid(CONTACT_MODULUS), Load("area_fraction", area_fraction))


def certified(gap: GridField, rtol: float, field: bool = False) -> LeakRate:
    """Leak rate with bounds."""
    from fem_seal.flow import FlowSettings, leak_rate

    return leak_rate(
        GridFilm(gap, sides=SIDES),
        FlowSettings(viscosity=VISCOSITY, pressure_drop=PRESSURE_DROP, rtol=rtol, field=field),
    )
