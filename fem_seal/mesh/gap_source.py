"""Gap of a shape as a function of position: a number, a formula, or samples on a grid.

Samples are interpolated linearly on the pixel triangles of `nested`, whose diagonals alternate. A
vertex of the mesh that lies on a sample gets exactly its value, so that contact stays exactly 0.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.expression import evaluate
from fem_seal.grid import GridField
from fem_seal.mesh.gmsh_process import Box, SizeField
from fem_seal.mesh.nested import triangle_at

OUTSIDE = 1e-6  # largest distance [pixel] by which rounding may put a vertex outside the grid
# Rounding error of coordinates [pixel]; gmsh writes them to 1e-9 at best.
COORDINATE_ROUNDING = 1e-6
CHANNEL_ABOVE = 0.1  # a channel ends where the gap falls below this part of its mean
EDGE_GROWTH = 0.5  # growth of the edge length with the distance to the nearest bank of a channel
FINEST_RASTER = 1500  # largest number of points along the longer side
UNIT_SUSPECTED = 200  # ratio of the extents of mesh and grid beyond which their units must differ


@dataclass(frozen=True)
class UniformGap:
    """A uniform gap."""

    gap: float  #: [m]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m]."""
        return np.full(len(points), self.gap)

    anywhere = __call__


@dataclass(frozen=True)
class Formula:
    """A gap [m] by a formula in x, y, r and theta."""

    text: str  #: the formula, see `expression.evaluate`
    middle: float = 0.0  #: theta lies within π of this angle [rad]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m]."""
        return evaluate(self.text, points, self.middle)

    anywhere = __call__


@dataclass(frozen=True, eq=False)
class _Grid(ABC):
    """Samples of a gap at the points of a grid."""

    samples: np.ndarray  #: (nx, ny), gap [m]
    #: coordinates of the first sample, and distances between samples along each axis
    origin: tuple[float, float]
    spacing: tuple[float, float]

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m]."""
        self._check_extent(points)
        return _linear(self.samples, _within(points, self._steps(points), self.samples.shape))

    def anywhere(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m], extended constantly beyond the grid."""
        return _linear(self.samples, _clipped(self._steps(points), self.samples.shape))

    @abstractmethod
    def _check_extent(self, points: np.ndarray) -> None:
        """Raise InvalidInput if points (n, 2) [m] and grid suggest different units."""

    @abstractmethod
    def _steps(self, points: np.ndarray) -> np.ndarray:
        """Positions (n, 2) of points in units of the spacing, from the first sample."""


class CartesianGrid(_Grid):
    """Samples of a gap at origin + (i dx, j dy) [m]; a periodic gap repeats its first ones."""

    @classmethod
    def of(cls, gap: GridField, origin: tuple[float, float] = (0.0, 0.0)) -> "CartesianGrid":
        """Grid of a gap with its first sample at `origin` [m]."""
        return cls(gap.vertices(), origin, gap.spacing)

    def _check_extent(self, points: np.ndarray) -> None:
        covered = max((n - 1) * d for n, d in zip(self.samples.shape, self.spacing, strict=True))
        _same_extent(np.ptp(points, axis=0).max(), covered)

    def _steps(self, points: np.ndarray) -> np.ndarray:
        return (points - self.origin) / self.spacing


class PolarGrid(_Grid):
    """Samples of a gap at radius r0 + i dr and angle theta0 + j dtheta around the point (0, 0).

    `origin` is (r0 [m], theta0 [rad]), `spacing` (dr [m], dtheta [rad]). A full turn repeats its
    first angle at the end.
    """

    @classmethod
    def of(cls, gap: GridField, origin: tuple[float, float]) -> "PolarGrid":
        """Grid of a gap whose first axis is the radius and second the angle, from r0 and theta0.

        It is a full turn, and closed, if ntheta · dtheta = 2π.
        """
        turns = gap.shape[1] * gap.spacing[1] / (2 * np.pi)
        whole = abs(turns - 1) < 1e-6
        if turns > 1 + 1 / gap.shape[1] + 1e-6:
            raise InvalidInput(
                f"the polar gap covers {turns:.4g} turns; its spacing must be (dr [m], dtheta "
                "[rad]) with ntheta · dtheta at most 2π"
            )
        dtheta = 2 * np.pi / gap.shape[1] if whole else gap.spacing[1]
        samples = np.pad(gap.values, ((0, 0), (0, 1)), mode="wrap") if whole else gap.values
        return cls(samples, origin, (gap.spacing[0], dtheta))

    def _check_extent(self, points: np.ndarray) -> None:
        # Compare radii, not extents: a narrow sector is small against its radius in any unit.
        outer = self.origin[0] + (self.samples.shape[0] - 1) * self.spacing[0]
        _same_extent(np.hypot(*points.T).max(), outer)

    def _steps(self, points: np.ndarray) -> np.ndarray:
        radius = np.hypot(*points.T)
        # An angle that rounding puts just before theta0 must not become almost a full turn.
        slack = OUTSIDE * self.spacing[1]
        angle = np.mod(np.arctan2(points[:, 1], points[:, 0]) - self.origin[1] + slack, 2 * np.pi)
        return np.stack([radius - self.origin[0], angle - slack], axis=1) / self.spacing


GapSource = UniformGap | Formula | CartesianGrid | PolarGrid


def channel_sizes(gap: GapSource, rectangle: Box, smallest: float, largest: float) -> SizeField:
    """Edge lengths min(largest, smallest + d/2), d the distance to the nearest bank of a channel.

    The banks are the lines where the gap is a tenth of its mean. Edges in a channel of width w are
    thus no longer than w/4 + `smallest`; contact spots get coarse triangles inside as well.
    """
    from scipy.ndimage import distance_transform_edt

    size = np.array([rectangle.x1 - rectangle.x0, rectangle.y1 - rectangle.y0])
    step = max(smallest, size.max() / FINEST_RASTER)
    counts = np.maximum(np.ceil(size / step).astype(int) + 1, 2)
    spacing = size / (counts - 1)
    i, j = np.indices(counts)
    points = np.stack([i.ravel(), j.ravel()], axis=1) * spacing + (rectangle.x0, rectangle.y0)
    heights = gap.anywhere(points).reshape(counts)
    heights = np.where(np.isfinite(heights), heights, 0.0)
    channel = heights > CHANNEL_ABOVE * heights.mean()
    distance = np.full(counts, np.inf)
    for region in (channel, ~channel):
        # A region that covers the whole rectangle has no bank: its distance stays infinite.
        if not region.all():
            to_bank = distance_transform_edt(region, sampling=spacing)
            distance = np.where(region, to_bank, distance)
    sizes = np.minimum(smallest + EDGE_GROWTH * distance, largest)
    return SizeField(sizes, (rectangle.x0, rectangle.y0), tuple(spacing))


def _same_extent(mesh: float, covered: float) -> None:
    """Raise InvalidInput if the extents [m] of mesh and grid suggest different units."""
    ratio = mesh / covered
    if not 1 / UNIT_SUSPECTED < ratio < UNIT_SUSPECTED:
        raise InvalidInput(
            f"the mesh is {mesh:.4g} m large and the grid of its gap {covered:.4g} m, a ratio of "
            f"{ratio:.3g}: one of them is in another unit; set shape.unit (millimetres: 'mm')"
        )


def _within(points: np.ndarray, steps: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Positions (n, 2) in the grid, clipped by rounding; InvalidInput if a point is outside."""
    last = np.array(shape) - 1
    out = ((steps < -OUTSIDE) | (steps > last + OUTSIDE)).any(axis=1)
    if out.any():
        x, y = points[np.argmax(out)]
        raise InvalidInput(
            f"{np.count_nonzero(out)} of {len(points)} vertices of the mesh lie beyond the grid "
            f"of the gap, the first at x = {x:.6g} m, y = {y:.6g} m; mesh and grid must share "
            "their origin and the grid must cover the mesh"
        )
    return _clipped(steps, shape)


def _clipped(steps: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return np.clip(steps, 0, np.array(shape) - 1)


def _linear(samples: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Linear interpolation on the pixel triangles, at steps (n, 2) in units of the spacing."""
    i, j = np.minimum(steps.astype(int), np.array(samples.shape) - 2).T
    corners, parts = triangle_at(i, j, steps[:, 0] - i, steps[:, 1] - j)
    weights = np.array(parts)
    # A point on a sample or on the side of a triangle must not get a rounding error of the next
    # sample: in contact that would open a channel as narrow as the rounding error.
    weights[weights < COORDINATE_ROUNDING] = 0
    values = np.array([samples[corner] for corner in corners])
    return (weights * values).sum(axis=0) / weights.sum(axis=0)
