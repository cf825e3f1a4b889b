"""K of waves along the flow under a load, from Westergaard's closed form of the gap."""

import numpy as np
from scipy.integrate import quad

from fem_seal.upscaling import ConductivityTable


def waves_along_the_flow(load, *, amplitude, wavelength, full, viscosity):
    """Film conductivity [m³/(Pa s)] of h = Δ cos(2πy/λ) pressed flat by p* = πE*Δ/λ.

    With v = sin ψ, ψ = πy/λ from the crest, and s² = load/p*, the contact ends at v = s, and the
    slope of the gap outside is dg/dψ = 4Δ cos ψ √(v² - s²), so that

        g = 2Δ (v √(v² - s²) - s² arcosh(v/s))

    H. M. Westergaard, J. Appl. Mech. 6, 49 (1939); K. L. Johnson, Contact Mechanics, sect. 13.2.
    The wavelength only scales y.
    """
    s2 = load / full
    if s2 >= 1:
        return 0.0

    def cubed(psi):
        v = np.sin(psi)
        root = np.sqrt(max(v * v - s2, 0.0))
        logarithm = s2 * np.log((v + root) / np.sqrt(s2)) if s2 > 0 else 0.0
        return (2 * amplitude * (v * root - logarithm)) ** 3

    total, _ = quad(cubed, np.arcsin(np.sqrt(s2)), np.pi / 2, epsrel=1e-10)
    return total / (np.pi / 2) / (12 * viscosity)


def exact_table(loads, conductivity):
    """Table of a conductivity that is known exactly at its loads."""
    return ConductivityTable(loads, conductivity, conductivity)
