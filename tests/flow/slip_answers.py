"""Closed forms for gases that slip."""

import numpy as np
from scipy.optimize import brentq

from fem_seal.fluid import Slip


def channel(slip: Slip, height: float, length: float, p_in: float, p_out: float) -> float:
    """Mass rate of a channel of width 1, B g² ∫ c(g p/B) dp/L."""
    drop = slip.potential(p_in, height) - slip.potential(p_out, height)
    return slip.product * height**2 * drop / length


def in_series(slip: Slip, heights: tuple[float, float], lengths: tuple[float, float]) -> float:
    """Two layers of width 1: the pressure between them such that both let the same through."""

    def surplus(p):
        first = channel(slip, heights[0], lengths[0], slip.inlet_pressure, p)
        return first - channel(slip, heights[1], lengths[1], p, slip.outlet_pressure)

    ends = slip.outlet_pressure, slip.inlet_pressure
    middle = brentq(surplus, *ends, xtol=1e-16, rtol=1e-15)
    return channel(slip, heights[0], lengths[0], slip.inlet_pressure, middle)


def wedge(slip: Slip, low: float) -> float:
    """A gap that falls linearly from 1 to `low` over a unit length, of width 1.

    With u = g p the conductivity is g² k(u), k = B c(u/B), and Q = -g² k dp/dx becomes
    g du/dg = u + Q'/k with Q' = Q/(1 - low): ∫ k/(u k + Q') du from low p_out to p_in is ln(1/low).
    Ten Gauss points between any two kinks of c and steps of a tenth of a decade.
    """
    ends = low * slip.outlet_pressure, slip.inlet_pressure
    steps = np.append(slip.product * slip.coefficient.kinks, np.geomspace(1e-9, 1, 91) * ends[1])
    steps = np.unique(np.clip(np.append(steps, ends), *ends))
    x, weight = np.polynomial.legendre.leggauss(10)
    half = np.diff(steps)[:, None] / 2
    u = steps[:-1, None] + half * (1 + x)
    k = slip.product * slip.coefficient(u / slip.product)

    def surplus(rate):
        return (half * weight * k / (u * k + rate)).sum() + np.log(low)

    # Between the largest k over the whole length and next to nothing.
    most = k.max() * ends[1] / -np.log(low)
    return (1 - low) * brentq(surplus, 1e-12 * most, most, rtol=1e-12)
