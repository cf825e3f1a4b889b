"""Gaps that depend on y alone or on x alone, whose leak rate is a closed form.

Drawn at random: heights over up to a hundred decades, stripes of contact along the flow, pixels of
all aspects, walls and periodic sides, both representations, meshes of shapes.
"""

from dataclasses import dataclass
from math import fsum

import numpy as np
from gaps import assert_enclosed, bracketed
from triangulations import film_on_triangles

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.theory.closed_forms import piecewise_linear_channel

# The closed form is a sum of positive terms of up to 20 roundings each, and the spacings of a grid
# and the ratio of them one each.
ROUNDING = 32 * np.finfo(float).eps
# Decades of the gap. Layers in series below 1e-60 of the largest gap are refused.
SERIES_DECADES = (0.3, 2.0, 6.0, 12.0, 15.0, 18.0, 40.0)
STRIPES_DECADES = (*SERIES_DECADES, 100.0)
ASPECT_DECADES = 6.0  # of dx/dy, to both sides


def along(heights: np.ndarray, step: float, linear: bool) -> float:
    """Σ K dy of stripes along the flow: (a³ + a²b + ab² + b³)/4 is the mean of g³ from a to b."""
    if not linear:
        return step * fsum(heights**3)
    a, b = heights[:-1], heights[1:]
    return step * fsum((a + b) * (a * a + b * b) / 4)


def across(heights: np.ndarray, step: float, linear: bool) -> float:
    """Σ dx/K of layers in series."""
    if not linear:
        return step * fsum(1 / heights**3)
    return step * (len(heights) - 1) / piecewise_linear_channel(heights)


@dataclass(frozen=True)
class Case:
    """One gap: `heights` along one axis, repeated so many `times` along the other.

    kind : "along" (stripes along the flow, heights over y) or "across" (layers, heights over x)
    on : "linear", "constant" (on a grid) or "mesh" (linear on the triangles of a shape)
    """

    kind: str
    heights: np.ndarray
    times: int
    spacing: tuple[float, float]
    sides: str
    on: str
    method: str

    @classmethod
    def random(cls, rng: np.random.Generator) -> "Case":
        """Any of them."""
        kind, on = rng.choice(["along", "across"]), rng.choice(["linear", "constant", "mesh"])
        decades = rng.choice(STRIPES_DECADES if kind == "along" else SERIES_DECADES)
        heights = 10 ** (-decades * rng.random(int(rng.integers(3, 25))))
        if kind == "along" and rng.random() < 0.6:
            heights[rng.random(len(heights)) < rng.uniform(0.1, 0.8)] = 0
            # Linear between samples, a stripe is open where one of them is.
            heights[rng.integers(len(heights))] = 1
        # Between 1e-9 and 1 m: smaller cubes are no leak rate that a number could hold.
        heights *= 10 ** -rng.uniform(0, 9) / heights.max()
        spacing = 1e-6 * 10 ** (
            rng.uniform(-ASPECT_DECADES, ASPECT_DECADES) * np.array([0.5, -0.5])
        )
        return cls(
            str(kind),
            heights,
            int(rng.integers(2, 8)),
            (float(spacing[0]), float(spacing[1])),
            "wall" if on == "mesh" else str(rng.choice(["wall", "periodic"])),
            str(on),
            str(rng.choice(["adaptive", "uniform"])),
        )

    @property
    def values(self) -> np.ndarray:
        """Samples (nx, ny)."""
        heights = self.heights
        if self.kind == "across":
            return np.repeat(heights[:, None], self.times, axis=1)
        return np.repeat(heights[None, :], self.times, axis=0)

    @property
    def gap(self) -> GridField | MeshFilm:
        """The gap; periodic sides are those of a grid that repeats in both directions."""
        if self.on == "mesh":
            return film_on_triangles(self.values, self.spacing)
        return GridField(self.values, self.spacing, periodic=self.sides == "periodic")

    @property
    def exact(self) -> float:
        """Leak rate where the film conductivity is gap³, at a unit pressure drop."""
        linear, heights, (dx, dy) = self.on != "constant", self.heights, self.spacing
        repeats = self.sides == "periodic"
        if linear and repeats:
            heights = np.append(heights, heights[0])
        # A linear gap has an interval less than samples, unless it repeats.
        steps = self.times - (linear and not repeats)
        if self.kind == "along":
            return along(heights, dy, linear) / (steps * dx)
        return steps * dy / across(heights, dx, linear)

    def solve(self, unknowns: int, rtol: float = 0.05) -> LeakRate:
        """The leak rate, whose bounds on every level hold the closed form."""
        gap, exact = self.gap, self.exact
        film = gap if isinstance(gap, MeshFilm) else GridFilm(gap, self.sides, self.on)
        flow = bracketed(film, rtol, unknowns, method=self.method)
        assert_enclosed(flow, exact * (1 - ROUNDING), exact * (1 + ROUNDING), self)
        return flow
