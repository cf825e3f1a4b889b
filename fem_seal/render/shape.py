"""Pictures of a film of any shape on the triangles of its mesh: mesh, gap and flow."""

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.film.mesh_film import MeshFilm
from fem_seal.leak_rate import FlowField, LeakRate
from fem_seal.render.flow import (
    CONTACT,
    EDGES,
    NO_FLOW,
    flow_of,
    flow_scale,
    flow_triangles,
)
from fem_seal.render.gap import gap_scale
from fem_seal.render.offscreen import DrawnMesh, DrawnTriangles, Layer, draw_layers
from fem_seal.render.page import INLET, OUTLET, Panel, Swatch, write_page
from fem_seal.render.window import LONG_SIDE, Scale, Window

if TYPE_CHECKING:
    from fem_seal.mesh.triangles import TriangleMesh

MARGIN = 0.02  # white margin around the shape, over its longer side
WALL = Swatch("wall", (0, 0, 0))
BOUNDARY_WIDTH = 4.0  # width of the lines of inlet, outlet and walls [pixel]
BOUNDARIES = {"inlet": INLET, "outlet": OUTLET, "wall": WALL}


def _mesh_picture(film: MeshFilm, path: str | Path) -> Path:
    """Picture of a mesh with its inlet, outlet and walls.

    Parameters
    ----------
    film : film on the mesh
    path : the file, .png, .pdf or .svg

    Returns
    -------
    Path of the file.
    """
    mesh = film.mesh
    layers = (*_contact_of(film), DrawnMesh(mesh.xy, mesh.cells, EDGES, 0.5), *_boundaries(mesh))
    return write_page([[_panel(layers, mesh)]], path, key=_key(film))


def _gap_picture(film: MeshFilm, path: str | Path) -> Path:
    """Picture of the gap, linear on each triangle, with contact in grey; see `_mesh_picture`."""
    mesh = film.mesh
    layers: tuple[Layer, ...] = (*_contact_of(film), *_boundaries(mesh))
    scale: Scale | None = None
    if film.highest > 0:
        scale, factor = gap_scale(film.values)
        shown = np.maximum(film.values * factor, scale.low)
        layers = (DrawnTriangles(mesh.xy, mesh.cells, shown, scale), *layers)
    return write_page([[_panel(layers, mesh)]], path, scale=scale, key=_key(film))


def _flow_picture(leak: LeakRate, film: MeshFilm, path: str | Path) -> Path:
    """Picture of the flow density on a logarithmic scale; see `_mesh_picture`."""
    field: FlowField = flow_of(leak)
    scale = flow_scale(field)
    mesh = film.mesh
    open_cells = mesh.cells[(film.values[mesh.cells] > 0).any(axis=1)]
    layers: tuple[Layer, ...] = (
        DrawnMesh(mesh.xy, open_cells, NO_FLOW.colour, 0),
        flow_triangles(field, scale),
        *_contact_of(film),
        *_boundaries(mesh),
    )
    # There are pockets if the field of the flow covers less than the open area.
    pockets = _area(field.points, field.cells) < (1 - 1e-9) * _area(mesh.xy, open_cells)
    key = (*_key(film), NO_FLOW) if pockets else _key(film)
    return write_page([[_panel(layers, mesh)]], path, scale=scale, key=key)


def _area(points: np.ndarray, cells: np.ndarray) -> float:
    """Total area of triangles (C, 3) with corners at points (N, 2)."""
    first, second = (points[cells[:, k]] - points[cells[:, 0]] for k in (1, 2))
    return 0.5 * float(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum())


def draw_shape(film: MeshFilm, leak: LeakRate | None, folder: Path) -> tuple[str, ...]:
    """Draw mesh, gap and, if the leak rate has a field, flow; return the names of the files."""
    _mesh_picture(film, folder / "shape.png")
    _gap_picture(film, folder / "gap.png")
    if leak is None or leak.field is None:
        return "gap.png", "shape.png"
    _flow_picture(leak, film, folder / "flow.png")
    return "flow.png", "gap.png", "shape.png"


def _panel(layers: Sequence[Layer], mesh: "TriangleMesh") -> Panel:
    (x0, y0), (x1, y1) = mesh.xy.min(axis=0), mesh.xy.max(axis=0)
    margin = MARGIN * max(x1 - x0, y1 - y0)
    window = Window(*(float(v) for v in (x0 - margin, x1 + margin, y0 - margin, y1 + margin)))
    return Panel(draw_layers(layers, window, LONG_SIDE), window, along_x=False)


def _contact_of(film: MeshFilm) -> list[DrawnMesh]:
    """Layers of the contact; empty list if there is none.

    Triangles with all corners in contact are drawn. If the film has a formula, so is the part of
    other triangles where it gives 0.
    """
    mesh = film.mesh
    touching = (film.values[mesh.cells] == 0).sum(axis=1)
    layers = [DrawnMesh(mesh.xy, mesh.cells[touching == 3], CONTACT.colour, 0)]
    if film.formula is not None:
        at_rim = mesh.xy[mesh.cells[(touching > 0) & (touching < 3)]]
        xy = _cut(at_rim, float(np.ptp(mesh.xy, axis=0).max()) / LONG_SIDE)
        xy = xy[film.formula(xy.mean(axis=1)) == 0]
        layers.append(
            DrawnMesh(xy.reshape(-1, 2), np.arange(3 * len(xy)).reshape(-1, 3), CONTACT.colour, 0)
        )
    return [layer for layer in layers if len(layer.cells)]


def _cut(triangles: np.ndarray, longest: float) -> np.ndarray:
    """Cut each of the triangles (n, 3, 2) into equal ones (m, 3, 2) with sides up to `longest`."""
    if not len(triangles):
        return triangles
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    parts = ceil(sides.max() / longest)
    i, j = (k.ravel() for k in np.mgrid[:parts, :parts])
    upright = np.stack([[i, j], [i + 1, j], [i, j + 1]])[:, :, i + j < parts]
    turned = np.stack([[i + 1, j], [i + 1, j + 1], [i, j + 1]])[:, :, i + j < parts - 1]
    steps = np.concatenate([upright, turned], axis=2) / parts
    origin, along = triangles[:, None, None, 0], triangles[:, 1:] - triangles[:, :1]
    return (origin + np.einsum("cdk,ndx->nkcx", steps, along)).reshape(-1, 3, 2)


def _boundaries(mesh: "TriangleMesh") -> list[DrawnMesh]:
    """Inlet, outlet and walls as thick lines, drawn as degenerate triangles (a, b, b)."""
    return [
        DrawnMesh(mesh.xy, ends[:, [0, 1, 1]], BOUNDARIES[name].colour, BOUNDARY_WIDTH)
        for name, ends in mesh.groups()
        if len(ends)
    ]


def _key(film: MeshFilm) -> tuple[Swatch, ...]:
    """Entries of the key for the boundaries and the contact that the picture shows."""
    boundaries = [BOUNDARIES[name] for name, ends in film.mesh.groups() if len(ends)]
    return (*boundaries, CONTACT) if _contact_of(film) else tuple(boundaries)
