"""The normalised problem of a film: its gap in units of the largest gap, and a first mesh."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm, MeshFilm, require_film
from fem_seal.film.law import FilmLaw
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, GapOnMesh, VertexGap
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.nested import coarsest_width, uniform_mesh


def require_area(film: GridFilm | MeshFilm) -> None:
    """Raise InvalidInput unless the argument is a film with a positive area."""
    require_film(film, (GridFilm, MeshFilm))
    if isinstance(film, GridFilm) and min(film.samples.shape) < 1 + (
        film.representation == "linear"
    ):
        raise InvalidInput(
            f"a linear gap needs two samples along each axis, got shape {film.gap.shape}; "
            "use representation = 'constant' for a single row"
        )


def first_mesh(
    film: GridFilm | MeshFilm,
    cut: float,
    floor: float,
    ceiling: float,
    coarsest: int | None,
    law: FilmLaw,
) -> tuple[GapOnMesh, AnyMesh]:
    """Gap in units of its maximum, and the first mesh.

    `coarsest` squares lie along the shorter side of the first mesh on a grid; None: those of its
    pixels. A shape begins with the mesh that it has. The other arguments are those of `LinearGap`.
    """
    if isinstance(film, MeshFilm):
        # Pockets may stay: the gap is linear on each cell, so no cell joins a pocket to a channel.
        scaled = film.values / film.highest
        return VertexGap(scaled, length_unit(film), cut, floor, ceiling, law), film.mesh
    # Treat pockets as contact: nothing flows in them, but a coarse cell that covers parts of a
    # pocket and of a channel would seem to conduct.
    scaled = np.where(film.carrying, film.samples / film.highest, 0.0)
    # Linear gaps live on the pixels between samples, one fewer along each axis.
    linear = film.representation == "linear"
    squares = scaled.shape[0] - linear, scaled.shape[1] - linear
    width = 1 if coarsest is None else coarsest_width(squares, coarsest)
    gap_type = REPRESENTATIONS[film.representation]
    gap = gap_type(GridField(scaled, film.gap.spacing), cut, floor, width, ceiling, law)
    return gap, uniform_mesh(gap.squares, width, film.sides == "periodic")


def length_unit(film: GridFilm | MeshFilm) -> float:
    """Length [m] in which the normalised problem is written."""
    if isinstance(film, GridFilm):
        return max(film.gap.spacing)
    return float(np.ptp(film.mesh.xy, axis=0).max())


def points_of(film: GridFilm | MeshFilm, mesh: AnyMesh) -> np.ndarray:
    """Vertex coordinates (V, 2) [m] of a mesh that refines the first mesh of a film."""
    return mesh.points(np.array(film.gap.spacing)) if isinstance(film, GridFilm) else mesh.xy
