"""The critical constriction: position, gap, width, and its share of the pressure drop.

Next to closing this one place governs the leak rate (W. B. Dapp, M. H. Müser, Sci. Rep. 6, 19513
(2016)).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.film.lattice import Lattice
from fem_seal.leak_rate import FlowField

OPPOSITE = -0.5  # cosine: the other side of a channel lies within 60 degrees of straight across
BESIDE = 1e-9  # distance of a wall on which a position lies, in spacings or lengths of triangles


@dataclass(frozen=True)
class Constriction:
    """The tightest place on the widest path from inlet to outlet."""

    x: float  #: position [m]
    y: float
    #: gap at this position [m]. A uniform lowering of the counter-face by this much seals the film
    gap: float
    #: width of the channel at this position, from contact or wall to contact or wall [m]; None
    #: where neither lies on both sides
    width: float | None
    #: part of the dissipation inside the disc of radius `width` around the position. With a single
    #: channel this is the part of the pressure drop lost there. None without width or flow, and
    #: where the disc is no small part of the film: twice the width is above the film's length
    pressure_share: float | None


def constriction(
    film: GridFilm | MeshFilm, field: FlowField | None = None, potential: np.ndarray | None = None
) -> Constriction | None:
    """Find the critical constriction of a film and its share of the pressure drop; None if sealed.

    The share needs the flow, and the potential (N,) at its points in which the flux is linear: p of
    a liquid, p² of a gas.
    """
    tightest = film.constriction
    if tightest is None:
        return None
    period = np.inf
    if isinstance(film, GridFilm):
        width, length = channel_width(film.sites, tightest.position), film.size[0]
        if film.sides == "periodic":
            period = film.size[1]
    else:
        width, length = _width_on_mesh(film, tightest.position), min(film.size)
    share = None
    if width is not None and 2 * width < length and field is not None and potential is not None:
        share = share_within(field, potential, tightest.position, width, period)
    return Constriction(*tightest.position, tightest.gap, width, share)


def _width_on_mesh(film: MeshFilm, position: tuple[float, float]) -> float | None:
    """Width of the channel at the critical constriction; see `channel_width`."""
    mesh, solid = film.mesh, film.values == 0
    walls = dict(mesh.groups())["wall"]
    solid[walls] = True
    offsets = mesh.xy[solid] - position
    away = offsets[offsets.any(axis=1)]
    touching = (mesh.xy[walls] == position).all(axis=2).any(axis=1)
    if touching.any():
        # The constriction lies on a wall, with the film on the left of its edges: the other end of
        # the channel lies ahead of it, and at the inlet or the outlet not on the same wall.
        x, y = np.diff(mesh.xy[walls[touching]], axis=1).sum(axis=(0, 1))
        away = np.concatenate([away, BESIDE * np.array([[y, -x]])])
    ends = _both_sides(away)
    return None if ends is None else float(sum(ends))


def channel_width(sites: Lattice, position: tuple[float, float]) -> float | None:
    """Distance [m] between the solid on both sides of an open site; None without both.

    It is the distance from the nearest contact, or side wall, to the nearest one on the other side.
    If the gap between two contact spots is convex, only open sites lie between them.
    """
    ends = _both_sides(_solid_around(sites, position))
    return None if ends is None else sum(ends)


def _solid_around(sites: Lattice, position: tuple[float, float]) -> np.ndarray:
    """Offsets (n, 2) [m] of contact sites, with their images on both sides, and of side walls.

    Those of pixels in contact are of their nearest points.
    """
    ny, spacing = sites.gap.shape[1], np.array(sites.spacing)
    half = 0.5 if sites.connectivity == "4" else 0.0  # of a pixel, from its centre to its sides
    i, j = np.rint((np.array(position) - sites.origin) / spacing).astype(int)
    steps = np.argwhere(sites.gap == 0) - (i, j)
    if sites.periodic[1]:
        steps = np.concatenate([np.add(steps, (0, images * ny)) for images in (-1, 0, 1)])
    offsets = np.sign(steps) * np.maximum(np.abs(steps) - half, 0.0) * spacing
    if sites.periodic[1]:
        return offsets
    # A site on the wall itself has the wall just beside it.
    below, above = (max(n + half, BESIDE) * spacing[1] for n in (j, ny - 1 - j))
    return np.concatenate([offsets, [[0.0, -below], [0.0, above]]])


def _both_sides(offsets: np.ndarray) -> tuple[float, float] | None:
    """Distance to the nearest solid, and to the nearest solid on the other side of the channel."""
    if not len(offsets):
        return None
    distance = np.hypot(*offsets.T)
    nearest = distance.argmin()
    cosine = offsets @ offsets[nearest] / (distance * distance[nearest])
    other = distance[cosine <= OPPOSITE]
    return (float(distance[nearest]), float(other.min())) if other.size else None


def share_within(
    field: FlowField,
    potential: np.ndarray,
    centre: tuple[float, float],
    radius: float,
    period: float = np.inf,
) -> float:
    """Part of the dissipation in the triangles whose centres lie in a disc.

    Lengths in m; `potential` (N,) at the points of the field; `period` of the domain along y, inf
    between walls.
    """
    away = field.points[field.cells].mean(axis=1) - centre
    if np.isfinite(period):
        away[:, 1] -= period * np.rint(away[:, 1] / period)
    power = cell_dissipation(field, potential)
    return float(power[np.hypot(*away.T) <= radius].sum() / power.sum())


def cell_dissipation(field: FlowField, potential: np.ndarray) -> np.ndarray:
    """-j·∇φ integrated over each triangle, (C,); [W] if the potential φ is the pressure."""
    corners = field.points[field.cells]
    edges = corners[:, 1:] - corners[:, :1]
    phi = potential[field.cells]
    gradient = np.linalg.solve(edges, (phi[:, 1:] - phi[:, :1])[..., None])[..., 0]
    return -(field.flux * gradient).sum(axis=1) * 0.5 * np.abs(np.linalg.det(edges))
