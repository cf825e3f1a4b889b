"""What the benchmarks share: elastic contacts of self-affine surfaces, and what a call costs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import TypeVar

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.grid import GridField
from fem_seal.memory import peak_memory
from fem_seal.surface import Spectrum, self_affine

FLUID = {"viscosity": 1e-3, "pressure_drop": 1e5}
Value = TypeVar("Value")


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

    def heights(self) -> GridField:
        """Rough surface in units of a pixel, with an rms slope of 0.1."""
        spectrum = Spectrum(self.hurst, self.n / 8, self.short)
        size = (self.n, self.n)
        return self_affine(spectrum, size, size, rms_slope=0.1, seed=self.seed)

    def gap(self) -> GridField:
        """Press the surface until the wanted part of the points touches; one pixel is 1 µm."""
        gap = press(self.heights(), ElasticSolid(1e7), Load("area_fraction", self.area)).gap
        return GridField(1e-6 * gap.values, (1e-6, 1e-6), periodic=True)


def cost_of(function: Callable[[], Value]) -> tuple[Value, float, int]:
    """Value of a function, its CPU seconds, and the peak memory of the process meanwhile [bytes].

    The memory includes the libraries, and what the process held before.
    """
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far (proc(5))
    start = process_time()
    value = function()
    return value, process_time() - start, peak_memory()


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
