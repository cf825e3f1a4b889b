"""References for gases that slip: closed forms, and Newton's method on finite volumes."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from fem_seal.fluid import Slip


def mass_rate_of(
    mobility: Callable[[np.ndarray, np.ndarray], np.ndarray],
    gap: np.ndarray,
    p_in: float,
    p_out: float,
    parts: int = 1,
) -> float:
    """∫ 𝒦(g, p) |∂p/∂x| dy of square pixels, each cut into parts × parts volumes, for any 𝒦 > 0.

    The flow runs along the first axis between pressures given half a volume outside the centres;
    the other sides are walls. The flux between two volumes is the harmonic mean of their 𝒦 at their
    own pressures, times the difference of the pressures. Damped Newton's method, with the
    derivative of 𝒦 by differences.
    """
    g = np.kron(gap, np.ones((parts, parts)))
    nx, ny = g.shape
    number = np.arange(nx * ny).reshape(nx, ny)
    pairs = [(number[:-1], number[1:]), (number[:, :-1], number[:, 1:])]
    left, right = (np.concatenate([pair[k].ravel() for pair in pairs]) for k in range(2))
    inlet, outlet, g = number[0], number[-1], g.ravel()
    rows = np.concatenate([left, left, right, right])
    columns = np.concatenate([left, right, left, right])

    def balance(p, K):
        mean = 2 * K[left] * K[right] / (K[left] + K[right])
        flux = mean * (p[left] - p[right])
        ends = 2 * K[inlet] * (p_in - p[inlet]), 2 * K[outlet] * (p[outlet] - p_out)
        total = np.bincount(left, flux, nx * ny) - np.bincount(right, flux, nx * ny)
        total[inlet] -= ends[0]
        total[outlet] += ends[1]
        return total, mean, ends

    p = np.repeat(np.linspace(p_in, p_out, nx + 2)[1:-1], ny)
    for _ in range(200):
        K, step = mobility(g, p), 1e-6 * p
        slope = (mobility(g, p + step) - K) / step
        left_over, mean, ends = balance(p, K)
        if np.abs(left_over).max() < 1e-11 * ends[0].sum():
            assert abs(ends[0].sum() - ends[1].sum()) < 1e-7 * ends[0].sum()
            return (ends[0].sum() + ends[1].sum()) / 2
        difference = p[left] - p[right]
        by_left = mean + mean**2 / K[left] ** 2 / 2 * slope[left] * difference
        by_right = -mean + mean**2 / K[right] ** 2 / 2 * slope[right] * difference
        entries = np.concatenate([by_left, by_right, -by_left, -by_right])
        diagonal = np.zeros(nx * ny)
        diagonal[inlet] += 2 * K[inlet] - 2 * slope[inlet] * (p_in - p[inlet])
        diagonal[outlet] += 2 * K[outlet] + 2 * slope[outlet] * (p[outlet] - p_out)
        everywhere = np.arange(nx * ny)
        matrix = coo_matrix(
            (
                np.concatenate([entries, diagonal]),
                (np.append(rows, everywhere), np.append(columns, everywhere)),
            )
        ).tocsc()
        change = spsolve(matrix, left_over)
        # At most half of the way to a pressure of 0.
        p = p - change * min(1.0, 0.5 / max(np.max(change / p), 0.5))
    raise AssertionError("Newton's method did not converge")


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
