"""The hydraulic aperture: the height of the smooth channel that leaks as much."""

from dataclasses import dataclass

import numpy as np

from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate


@dataclass(frozen=True)
class HydraulicAperture:
    """Height [m] with bounds, where the leak rate has them."""

    value: float
    lower: float | None
    upper: float | None


def hydraulic_aperture(
    leak: LeakRate,
    gap: GridField,
    representation: str,
    viscosity: float,
    pressure_drop: float,
) -> HydraulicAperture:
    """Height h of the parallel channel of the same size and leak rate: Q = Ly h³ Δp/(12 η Lx).

    The cubic law, solved for h (P. A. Witherspoon et al., Water Resour. Res. 16, 1016 (1980)). h
    grows with Q, so the bounds of Q give those of h.

    Parameters
    ----------
    leak : its leak rate
    gap : gap [m], for the size of the rectangle
    representation : "linear" or "constant"
    viscosity, pressure_drop : of the leak rate [Pa s], [Pa]
    """
    Lx, Ly = extent(gap, representation)
    per_height = Ly * pressure_drop / (12 * viscosity * Lx)

    def height(rate: float | None) -> float | None:
        return None if rate is None else float(np.cbrt(rate / per_height))

    return HydraulicAperture(height(leak.value), height(leak.lower), height(leak.upper))


def extent(gap: GridField, representation: str) -> tuple[float, float]:
    """Lengths (Lx, Ly) [m] of what carries flow: pixels are as many as samples."""
    if representation == "linear":
        return gap.size
    return tuple(n * d for n, d in zip(gap.shape, gap.spacing, strict=True))
