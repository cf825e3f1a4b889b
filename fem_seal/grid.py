"""GridField: heights, gaps and pressures sampled on a uniform grid."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem_seal.errors import InvalidInput

Sides = Literal["wall", "periodic"]
#: the gap is linear on triangles between its samples, or each sample fills one pixel
Representation = Literal["linear", "constant"]
# Largest ratio of a pixel's sides; a polar grid has metres over radians.
LONGEST_PIXEL = 1e12


@dataclass(frozen=True, eq=False)
class GridField:
    """Samples of a scalar on a uniform rectangular grid; sample [i, j] sits at (i dx, j dy).

    Raises
    ------
    InvalidInput
        If the array is not two-dimensional, is empty or not finite, a spacing is not positive, or
        pixels are beyond 1e12 times as long as wide.
    """

    #: (nx, ny), finite samples; the flow runs along the first axis. Stored as a read-only float64
    #: array
    values: np.ndarray
    #: distances dx, dy > 0 of neighbouring samples along each axis [m]
    spacing: tuple[float, float]
    #: false: the samples are the vertices of a rectangle of (nx - 1) dx by (ny - 1) dy. True: the
    #: field has the periods nx dx and ny dy, as in an FFT: sample 0 repeats at x = nx dx and y = ny
    #: dy
    periodic: bool = False

    def __post_init__(self) -> None:
        samples = np.ma.asarray(self.values)
        if samples.dtype.kind not in "biuf":
            raise InvalidInput(f"a grid needs an array of numbers, got {samples.dtype}")
        # What stands below a mask is no sample: it counts as NaN.
        unmasked = np.ma.filled(samples.astype(np.float64), np.nan)
        values = np.array(unmasked, order="C")
        if values.ndim != 2 or 0 in values.shape:
            raise InvalidInput(f"a grid needs a two-dimensional array, got shape {values.shape}")
        bad = np.count_nonzero(~np.isfinite(values))
        if bad:
            raise InvalidInput(
                f"{bad} of {values.size} grid values are not finite (NaN or infinite); "
                "fill or cut them out first"
            )
        lengths = np.ravel(self.spacing)
        numbers = lengths.size == 2 and lengths.dtype.kind in "iuf" and np.isfinite(lengths).all()
        if not (numbers and lengths.min() > 0):
            raise InvalidInput(f"spacing must be two positive lengths in metres, got {lengths}")
        if not isinstance(self.periodic, (bool, np.bool_)):
            raise InvalidInput(f"periodic must be True or False, got {self.periodic!r}")
        spacing = tuple(map(float, lengths))
        if max(spacing) > LONGEST_PIXEL * min(spacing):
            raise InvalidInput(
                f"pixels of {spacing[0]:g} m by {spacing[1]:g} m are more than "
                f"{LONGEST_PIXEL:.0e} times as long as wide; check the units"
            )
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "spacing", spacing)
        object.__setattr__(self, "periodic", bool(self.periodic))

    def __repr__(self) -> str:
        (nx, ny), (dx, dy) = self.shape, self.spacing
        values = f"{self.values.min():.4g} to {self.values.max():.4g}"
        return (
            f"GridField({nx} x {ny}, {values}, spacing=({dx:g}, {dy:g}), periodic={self.periodic})"
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of samples (nx, ny)."""
        nx, ny = self.values.shape
        return nx, ny

    @property
    def size(self) -> tuple[float, float]:
        """Lengths (Lx, Ly) of the rectangle [m]."""
        (nx, ny), (dx, dy) = self.shape, self.spacing
        return (nx * dx, ny * dy) if self.periodic else ((nx - 1) * dx, (ny - 1) * dy)

    @property
    def covered(self) -> tuple[float, float]:
        """Lengths [m] that the samples cover, each counted as one pixel."""
        (nx, ny), (dx, dy) = self.shape, self.spacing
        return nx * dx, ny * dy

    def vertices(self) -> np.ndarray:
        """Samples; those of a periodic field with the first row and column repeated at the end."""
        return np.pad(self.values, ((0, 1), (0, 1)), mode="wrap") if self.periodic else self.values

    def slope_between_samples(self) -> float:
        """Root mean square gradient by the differences of neighbouring samples."""
        v = self.vertices()
        steps = [(k, d) for k, d in enumerate(self.spacing) if v.shape[k] > 1]
        return float(sum(np.mean((np.diff(v, axis=k) / d) ** 2) for k, d in steps) ** 0.5)

    def refined(self) -> "GridField":
        """Samples of the same piecewise linear function on a grid of half the spacing.

        The function is linear on the pixel triangles. Each one of the finer grid is part of one of
        these: the function does not change.
        """
        v = self.vertices()
        fine = np.empty((2 * v.shape[0] - 1, 2 * v.shape[1] - 1))
        fine[::2, ::2] = v
        fine[1::2, ::2] = (v[:-1] + v[1:]) / 2
        fine[::2, 1::2] = (v[:, :-1] + v[:, 1:]) / 2
        rising, falling = v[:-1, :-1] + v[1:, 1:], v[1:, :-1] + v[:-1, 1:]
        rises = diagonal_rises(*np.indices(rising.shape, sparse=True))
        fine[1::2, 1::2] = np.where(rises, rising, falling) / 2
        if self.periodic:
            fine = fine[:-1, :-1]
        dx, dy = self.spacing
        return GridField(fine, (dx / 2, dy / 2), self.periodic)


def diagonal_rises(i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """Whether pixels (i, j) are cut from (i, j) to (i+1, j+1), and not from (i+1, j) to (i, j+1).

    So the diagonals alternate; each joins two vertices (i, j) with i + j even.
    """
    rises: np.ndarray = (i + j) % 2 == 0
    return rises


def require_grid_field(value: object, name: str) -> None:
    """Raise InvalidInput unless a value, called `name`, is a GridField."""
    if not isinstance(value, GridField):
        raise InvalidInput(
            f"the {name} is a {type(value).__name__}; make it a GridField(values, spacing, "
            "periodic)"
        )
