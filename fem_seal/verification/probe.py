"""The gap and the bracket that the extremes share."""

import numpy as np

from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate

MOST_UNKNOWNS = 6000
ROUNDING = 1e-9  # of bounds in other units: rounding of the input times the contrast CG sees


def flow(
    gap: GridField,
    *,
    representation: str = "linear",
    sides: str = "wall",
    rtol: float = 0.05,
    viscosity: float = 1 / 12,
    pressure_drop: float = 1.0,
    unknowns: int = MOST_UNKNOWNS,
) -> LeakRate:
    """Adaptive bracket; the fluid is such that the film conductivity is the cubed gap."""
    from fem_seal.flow import Limits, leak_rate

    return leak_rate(
        gap,
        viscosity=viscosity,
        pressure_drop=pressure_drop,
        representation=representation,
        sides=sides,
        rtol=rtol,
        limits=Limits(unknowns=unknowns),
    )


def rough(shape: tuple[int, int], contact: float, seed: int = 4) -> GridField:
    """Random samples averaged over their neighbours, cut off at a contact area; maximum 1."""
    noise = np.random.default_rng(seed).normal(size=shape)
    smooth = sum(np.roll(noise, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1))
    values = np.maximum(0.0, smooth - np.quantile(smooth, contact))
    return GridField(values / values.max(), (1.0, 1.0), periodic=True)


def encloses(leak: LeakRate, exact: float) -> bool:
    """Whether the bounds of every level hold the exact leak rate."""
    return all(level.lower <= exact <= level.upper for level in leak.levels)


def deviation_of(leaks: list[LeakRate], factors: list[float]) -> float:
    """Largest relative deviation of bounds from the first ones times known factors."""
    first = np.array([leaks[0].lower, leaks[0].upper]) / factors[0]
    others = zip(leaks, factors, strict=True)
    scaled = [np.array([leak.lower, leak.upper]) / factor for leak, factor in others]
    return float(np.abs(np.array(scaled) / first - 1).max())


def told(leak: LeakRate) -> str:
    """Say what came out."""
    return f"[{leak.lower:.6e}, {leak.upper:.6e}], converged {leak.converged}"
