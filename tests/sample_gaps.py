"""Gaps that tests of several packages share, and the fluid in which film conductivity is gap³."""

import numpy as np

from fem_seal.grid import GridField

FLUID = {"viscosity": 1 / 12, "pressure_drop": 1.0}  # K = g³/(12 η) = g³, Δp = 1


def rough_gap(shape: tuple[int, int], contact: float, seed: int, smooth: int = 1) -> GridField:
    """Random samples averaged over (2 smooth + 1)² neighbours, cut off at a contact area."""
    noise = np.random.default_rng(seed).normal(size=shape)
    offsets = range(-smooth, smooth + 1)
    total = sum(np.roll(noise, (i, j), (0, 1)) for i in offsets for j in offsets)
    gap = np.maximum(0.0, total - np.quantile(total, contact))
    return GridField(gap / gap.max(), (1.0, 1.0), periodic=True)
