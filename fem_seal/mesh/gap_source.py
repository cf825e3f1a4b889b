"""Where the gap of a shape comes from: a number, a formula, or samples on a grid.

Samples are interpolated linearly on the pixel triangles of `nested`, whose diagonals alternate,
so that a gap of exactly 0 stays exactly 0, and at a mesh vertex on a sample the sample is found.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.expression import evaluate
from fem_seal.grid import GridField

OUTSIDE = 1e-6  # of a sample: rounding by which a vertex may miss the grid
ROUNDING = 1e-6  # of a pixel: meshes of gmsh are no more exact than 1e-9
UNIT_SUSPECTED = 200  # mesh and grid whose extents differ by more are not of one unit


@dataclass(frozen=True)
class Uniform:
    """The same gap [m] everywhere."""

    gap: float

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m]."""
        return np.full(len(points), self.gap)

    anywhere = __call__


@dataclass(frozen=True)
class Formula:
    """A formula in x, y, r and theta; see `expression.evaluate`."""

    text: str

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m]."""
        return evaluate(self.text, points)

    anywhere = __call__


@dataclass(frozen=True, eq=False)
class CartesianGrid:
    """Samples at origin + (i dx, j dy).

    samples : (nx, ny) [m], with the repeated rows of a periodic gap
    origin, spacing : [m]
    """

    samples: np.ndarray
    origin: tuple[float, float]
    spacing: tuple[float, float]

    @classmethod
    def of(cls, gap: GridField, origin: tuple[float, float] = (0.0, 0.0)) -> "CartesianGrid":
        """Grid of a gap."""
        return cls(gap.vertices(), origin, gap.spacing)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m].

        Raises
        ------
        InvalidInput
            If a point lies beyond the samples.
        """
        covered = max((n - 1) * d for n, d in zip(self.samples.shape, self.spacing, strict=True))
        _same_extent(np.ptp(points, axis=0).max(), covered)
        return _linear(self.samples, _within(points, self._steps(points), self.samples.shape))

    def anywhere(self, points: np.ndarray) -> np.ndarray:
        """The same, with the value of the rim beyond it."""
        return _linear(self.samples, _clipped(self._steps(points), self.samples.shape))

    def _steps(self, points: np.ndarray) -> np.ndarray:
        return (points - self.origin) / self.spacing


@dataclass(frozen=True, eq=False)
class PolarGrid:
    """Samples at radius r0 + i dr and angle theta0 + j dtheta around the origin.

    samples : (nr, ntheta) [m]; a full turn repeats its first angle
    origin : (r0 [m], theta0 [rad]); spacing : (dr [m], dtheta [rad])
    """

    samples: np.ndarray
    origin: tuple[float, float]
    spacing: tuple[float, float]

    @classmethod
    def of(cls, gap: GridField, origin: tuple[float, float]) -> "PolarGrid":
        """Grid of a gap; ntheta · dtheta = 2π is a full turn.

        Raises
        ------
        InvalidInput
            If the angles exceed a full turn.
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

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Gap (n,) [m] at points (n, 2) [m]; InvalidInput if one lies beyond the samples."""
        # A sector may be small against its radius, but not beside it.
        outer = self.origin[0] + (self.samples.shape[0] - 1) * self.spacing[0]
        _same_extent(np.hypot(*points.T).max(), outer)
        return _linear(self.samples, _within(points, self._steps(points), self.samples.shape))

    def anywhere(self, points: np.ndarray) -> np.ndarray:
        """The same, with the value of the rim beyond it."""
        return _linear(self.samples, _clipped(self._steps(points), self.samples.shape))

    def _steps(self, points: np.ndarray) -> np.ndarray:
        radius = np.hypot(*points.T)
        # An angle a rounding error before the first sample is not a turn away from it.
        slack = OUTSIDE * self.spacing[1]
        angle = np.mod(np.arctan2(points[:, 1], points[:, 0]) - self.origin[1] + slack, 2 * np.pi)
        return np.stack([radius - self.origin[0], angle - slack], axis=1) / self.spacing


GapSource = Uniform | Formula | CartesianGrid | PolarGrid


def _same_extent(mesh: float, covered: float) -> None:
    """Refuse a mesh in other units than the grid."""
    ratio = mesh / covered
    if not 1 / UNIT_SUSPECTED < ratio < UNIT_SUSPECTED:
        raise InvalidInput(
            f"the mesh is {mesh:.4g} m large and the grid of its gap {covered:.4g} m, a ratio of "
            f"{ratio:.3g}: one of them is in another unit; set shape.unit (millimetres: 'mm')"
        )


def _within(points: np.ndarray, steps: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Steps (n, 2) of points in the grid, rounding taken away; points beyond it are refused."""
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


def _clipped(steps: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    return np.clip(steps, 0, np.array(shape) - 1)


def _linear(samples: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Linear interpolation on the pixel triangles whose diagonals alternate."""
    i, j = np.minimum(steps.astype(int), np.array(samples.shape) - 2).T
    s, t = steps[:, 0] - i, steps[:, 1] - j
    even = (i + j) % 2 == 0
    # From sw to ne where i + j is even: the weights of sw, se, nw and ne around the point.
    rising = [1 - np.maximum(s, t), np.maximum(s - t, 0), np.maximum(t - s, 0), np.minimum(s, t)]
    far = np.maximum(s + t - 1, 0)
    falling = [np.maximum(1 - s - t, 0), s - far, t - far, far]
    weights = np.where(even, rising, falling)
    # A vertex that lies on a sample or a side but for rounding must not see past it: a gap of
    # 0 there would open a path as narrow as the rounding.
    weights[weights < ROUNDING] = 0
    corners = [samples[i, j], samples[i + 1, j], samples[i, j + 1], samples[i + 1, j + 1]]
    return (weights * corners).sum(axis=0) / weights.sum(axis=0)
