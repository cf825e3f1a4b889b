"""Lattice of a gap: its sites, and which sites are neighbours, for each representation.

In two dimensions a phase spans from inlet to outlet exactly when its complement does not span
across, provided the two phases use a dual pair of connectivities. The pairs are 4 with 8, and
the pixel triangulation with itself: "matching" and "self-matching" lattices in M. F. Sykes and
J. W. Essam, J. Math. Phys. 5, 1117 (1964).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.arguments import choose
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField, Representation, Sides, diagonal_rises

# For each connectivity of a phase that of its complement, so that exactly one of the two spans.
DUAL_CONNECTIVITY = {"4": "8", "8": "4", "triangulation": "triangulation"}

# Connectivity of the open points; contact has the dual one.
OPEN_CONNECTIVITY = {"linear": "triangulation", "constant": "4"}

# For each choice of sides, whether y = 0 and y = Ly are the same line.
SIDES = {"wall": False, "periodic": True}


@dataclass(frozen=True, eq=False)
class Lattice:
    """The sites of a gap and their neighbourhood; every physical point is one site."""

    gap: np.ndarray  #: (mx, my), gap at the sites [m]; row 0 is the inlet, row mx - 1 the outlet
    #: "triangulation" or "4": connectivity of the open sites; contact has the dual one
    connectivity: str
    periodic: tuple[bool, bool]  #: along each axis, whether the last site neighbours the first
    origin: tuple[float, float]  #: site [i, j] sits at origin + (i dx, j dy) [m]
    spacing: tuple[float, float]  #: (dx, dy) [m]
    seam: bool  #: whether the gap's samples repeat column 0 after the last column of sites

    def __post_init__(self) -> None:
        lowest = self.gap.min()
        if lowest < 0:
            raise InvalidInput(
                f"the gap is negative at {np.count_nonzero(self.gap < 0)} of {self.gap.size} "
                f"samples, down to {lowest:.3e} m; contact is a gap of exactly 0: set it there, or "
                "give gap.contact_below in a scene"
            )

    @property
    def open(self) -> np.ndarray:
        """(mx, my) bool: the sites that are not in contact."""
        return self.gap > 0

    def areas(self) -> np.ndarray:
        """∫ φ_i dA (mx, my) of every site in pixel areas: 1, or a third of its triangles' area."""
        mx, my = self.gap.shape
        if self.connectivity != "triangulation":
            return np.ones((mx, my))
        pixels = (mx - 1, my if self.seam else my - 1)
        rises = diagonal_rises(*np.indices(pixels, sparse=True))
        # A corner on the pixel's diagonal belongs to both of its triangles, each half a pixel.
        rising = np.where(rises, 1 / 3, 1 / 6)
        falling = np.where(rises, 1 / 6, 1 / 3)
        area = np.zeros((mx, pixels[1] + 1))
        area[:-1, :-1] += rising
        area[1:, 1:] += rising
        area[1:, :-1] += falling
        area[:-1, 1:] += falling
        if self.seam:
            area[:, 0] += area[:, -1]
            area = area[:, :-1]
        return area

    def on_samples(self, field: np.ndarray) -> np.ndarray:
        """Field of the sites on the samples of the gap: column 0 repeated at a seam."""
        return np.concatenate([field, field[:, :1]], axis=1) if self.seam else field


def lattice(gap: GridField, sides: Sides, representation: Representation) -> Lattice:
    """Sites of a gap: the vertices of its triangulation ("linear") or its pixels ("constant").

    Those of a linear gap are gap.vertices(), without the last column if the sides are periodic,
    since it repeats the first.
    """
    periodic_sides = choose(SIDES, sides, "sides")
    connectivity = choose(OPEN_CONNECTIVITY, representation, "representation")
    if representation == "constant":
        half = (0.5 * gap.spacing[0], 0.5 * gap.spacing[1])
        return Lattice(
            gap.values, connectivity, (False, periodic_sides), half, gap.spacing, seam=False
        )
    vertices = gap.vertices()
    if min(vertices.shape) < 2:
        raise InvalidInput(
            f"a linear gap needs two samples along each axis, got shape {gap.shape}; "
            "use representation = 'constant' for a single row"
        )
    if periodic_sides:
        if not np.array_equal(vertices[:, 0], vertices[:, -1]):
            raise InvalidInput(
                "sides = 'periodic' needs a periodic gap or equal first and last columns; "
                "set periodic on the gap or use sides = 'wall'"
            )
        vertices = vertices[:, :-1]
    return Lattice(
        vertices, connectivity, (False, periodic_sides), (0.0, 0.0), gap.spacing, periodic_sides
    )
