"""A layer's compliance against plane-strain elasticity; contacts on it: `contact_campaign`."""

import numpy as np
import pytest

from fem_seal.contact import ElasticSolid, Layer, Load, press
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def airy_compliance(q, thickness, nu, base):
    """-u_z / p on top of a layer with E = 1 from Airy's function [(A + Bz)e^qz + (C + Dz)e^-qz].

    σ_zz = -q² f, σ_xz = -iq f', u_x ∝ (1-ν) f'' + ν q² f, 2μ q² u_z = (1-ν) f''' - (2-ν) q² f'.
    """

    roots, powers = np.array([q, q, -q, -q]), np.array([0, 1, 0, 1])

    def derivatives(z):
        # Of z^m exp(s z), m = 0 or 1: (s^k z^m + m k s^(k-1)) exp(s z).
        k = np.arange(4.0)[:, None]
        return (roots**k * z**powers + powers * k * roots ** (k - 1)) * np.exp(roots * z)

    def vertical(f):
        return ((1 - nu) * f[3] - (2 - nu) * q**2 * f[1]) * (1 + nu) / q**2

    top, bottom = derivatives(thickness), derivatives(0.0)
    held = {"fixed": (1 - nu) * bottom[2] + nu * q**2 * bottom[0], "sliding": bottom[1]}[base]
    conditions = np.array([q**2 * top[0], top[1], vertical(bottom), held])
    coefficients = np.linalg.solve(conditions, [1.0, 0, 0, 0])
    return -float(vertical(top) @ coefficients)


@pytest.mark.parametrize("base", ["fixed", "sliding"])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45, 0.5])
@pytest.mark.parametrize("depth", [0.05, 0.3, 1.0, 2.7])
def test_compliance_against_elasticity(base, nu, depth):
    q = 3.0
    exact = airy_compliance(q, depth / q, nu, base)
    factor = Layer(depth / q, base, nu).compliance_factor(q)
    # The 4 x 4 system loses up to 1/ξ^4 = 1e5 of its 16 digits in thin layers.
    assert 2 * (1 - nu**2) / q * factor == pytest.approx(exact, rel=1e-8)


@pytest.mark.parametrize("thickness", [1e-8, 1e-15, 1e-60, 1e-300])
def test_a_layer_that_yields_to_no_wave(thickness):
    """Thinner than 1e-6 of the longest wave its compliance is rounding, and its pressures overflow.

    Incompressible and bonded it yields (2/3) ξ³ times as much as a half-space, ξ << 1.
    """
    x = np.arange(8) / 8
    wave = GridField(np.cos(2 * np.pi * x)[:, None] + np.zeros(8), (1 / 8, 1 / 8), periodic=True)
    for load in (Load("area_fraction", 0.3), Load("pressure", 1.0), Load("mean_gap", 0.3)):
        with pytest.raises(InvalidInput, match="units of layer_thickness"):
            press(wave, ElasticSolid(1.0, Layer(thickness)), load)
