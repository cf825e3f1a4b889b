"""Waves (Westergaard) and spheres (Hertz) pressed into a half-space; spectra of a given slope.

H. M. Westergaard, J. Appl. Mech. 6, 49 (1939); K. L. Johnson, Contact Mechanics (1985), sections
4.2 and 13.2. Tests of contact and lift hold them against the solver.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import erf

from fem_seal.surface import Spectrum
from fem_seal.theory.persson import AREA_LAWS


@dataclass(frozen=True)
class Wave:
    """Heights Δ cos(2πy/λ). With ψ = πy/λ and s² = load/p* contact ends at |sin ψ| = s."""

    height: float  #: Δ [m]
    length: float  #: λ [m]
    E_star: float  #: [Pa]

    @property
    def full(self) -> float:
        """Load that flattens the wave, p* = π E* Δ/λ [Pa]."""
        return np.pi * self.E_star * self.height / self.length

    def area(self, load: float) -> float:
        """Contact area fraction under a load [Pa]."""
        return 2 / np.pi * np.arcsin(np.sqrt(min(load / self.full, 1.0)))

    def pressure(self, load: float, y: np.ndarray) -> np.ndarray:
        """Contact pressure at places y [Pa]: 2 p* |cos ψ| √(s² - sin²ψ) where that is real."""
        ψ = np.pi * y / self.length
        inside = np.maximum(load / self.full - np.sin(ψ) ** 2, 0.0)
        return 2 * self.full * np.abs(np.cos(ψ)) * np.sqrt(inside)

    def gap(self, load: float, y: np.ndarray) -> np.ndarray:
        """Gap at places y [m]: 2Δ (v √(v² - s²) - s² arcosh(v/s)), v = |sin ψ|, outside contact."""
        s = np.sqrt(min(load / self.full, 1.0))
        v = np.maximum(np.abs(np.sin(np.pi * y / self.length)), s)
        closing = s**2 * np.arccosh(v / s) if s > 0 else 0.0
        return 2 * self.height * (v * np.sqrt(v**2 - s**2) - closing)

    def conductivity(self, load: float, viscosity: float) -> float:
        """Film conductivity along the crests, <g³>/(12 η) [m³/(Pa s)]."""
        # g³ begins as the power 4.5 of the distance from contact: Gauss points err by 1e-10.
        nodes, weights = np.polynomial.legendre.leggauss(60)
        open_part = 1 - self.area(load)
        y = self.length / 2 * (1 - open_part * (1 - nodes) / 2)
        return open_part / 2 * float(weights @ self.gap(load, y) ** 3) / (12 * viscosity)


def hertz_radius(load: float, radius: float, E_star: float) -> float:
    """Radius of the contact of a sphere under a force: a³ = 3 F R/(4 E*) [m]."""
    return (3 * load * radius / (4 * E_star)) ** (1 / 3)


def hertz_pressure(load: float, contact_radius: float, r: np.ndarray) -> np.ndarray:
    """3 F/(2π a²) √(1 - r²/a²) inside a contact of radius a [Pa]."""
    peak = 3 * load / (2 * np.pi * contact_radius**2)
    return peak * np.sqrt(np.maximum(1 - (r / contact_radius) ** 2, 0.0))


def of_slope(spectrum: Spectrum, slope: float) -> Spectrum:
    """The spectrum with another rms slope: C goes as its square."""
    return replace(spectrum, plateau=spectrum.plateau * (slope / spectrum.rms_slope) ** 2)


def area_by_law(strain: float, mean_square_slope: float, law: str = "persson") -> float:
    """A/A0 = erf(p0/(E* √V)); V of Persson is half the mean square slope. The strain is p0/E*."""
    (V,) = AREA_LAWS[law](np.array([mean_square_slope / 2]), strain)
    return float(erf(strain / np.sqrt(V)))
