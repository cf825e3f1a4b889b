"""Gaps for the benchmarks: elastic contacts of self-affine surfaces, one pixel = 1 µm."""

from dataclasses import dataclass

from fem_seal.contact import press
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine

PIXEL = 1e-6


@dataclass(frozen=True)
class Case:
    """An elastic contact on n × n points, long cut-off n/8, short cut-off in pixels."""

    n: int
    hurst: float
    short: float
    area: float
    seed: int

    def __str__(self) -> str:
        return f"n={self.n} H={self.hurst} λs={self.short:g}px A/A0={self.area:g} seed={self.seed}"

    def gap(self) -> GridField:
        """Press the surface until the wanted part of the points touches."""
        length = self.n * PIXEL
        spectrum = Spectrum(self.hurst, length / 8, self.short * PIXEL)
        height = self_affine(
            spectrum, (self.n, self.n), (length, length), rms_slope=0.1, seed=self.seed
        )
        return press(height, 1e7, area_fraction=self.area, tolerance=1e-6).gap


VARIETY = (
    Case(256, 0.8, 4, 0.05, 1),
    Case(256, 0.8, 4, 0.23, 2),
    Case(256, 0.8, 4, 0.40, 3),
    Case(256, 0.4, 4, 0.20, 4),
    Case(256, 0.4, 4, 0.38, 5),
    Case(256, 0.8, 1, 0.20, 6),
    Case(256, 0.8, 1, 0.40, 7),
    Case(256, 0.8, 16, 0.30, 8),
    Case(256, 0.8, 16, 0.35, 9),
    Case(512, 0.8, 4, 0.10, 10),
    Case(512, 0.8, 4, 0.40, 11),
    Case(512, 0.8, 8, 0.35, 12),
    Case(512, 0.4, 2, 0.38, 13),
)
