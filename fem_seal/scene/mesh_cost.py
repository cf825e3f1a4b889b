"""Estimated number of triangles of a shape, checked before gmsh makes them."""

from math import sqrt

from fem_seal.scene.messages import ContradictionError

MOST_TRIANGLES = 1e8  # more take gmsh hours and tens of gigabytes


def refuse_too_many(
    area: float, rim: float, mesh_size: float, smallest_size: float | None = None
) -> None:
    """ContradictionError if a mesh would be too large to be made.

    Parameters
    ----------
    area, rim : area of the shape [m²] and length of its rim [m]
    mesh_size : longest edge [m]
    smallest_size : length of edges along a channel [m]; the channel is assumed to be half as long
        as the rim
    """
    # Equilateral triangles; a strip narrower than its edges has two along each of them. The size
    # grows as half the distance from a channel's bank, so it takes about two triangles for each
    # of the smallest edges.
    inside = area / (sqrt(3) / 4) / mesh_size / mesh_size
    narrow = 0.0 if smallest_size is None else rim / smallest_size
    count = inside + rim / mesh_size + narrow
    if count > MOST_TRIANGLES:
        name = "mesh_size" if narrow < count / 2 else "smallest_size"
        size = mesh_size if narrow < count / 2 else smallest_size
        raise ContradictionError(
            f"{name} = {size:g} m would take about {count:.0e} triangles, more than "
            f"{MOST_TRIANGLES:.0e}; choose larger edges"
        )
