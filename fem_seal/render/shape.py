"""Pictures of a film of any shape on the triangles of its mesh: mesh, gap and flow."""

from collections.abc import Sequence
from math import ceil, log2
from pathlib import Path

import numpy as np

from fem_seal.film.mesh_film import MeshFilm
from fem_seal.leak_rate import FlowField
from fem_seal.render import offscreen
from fem_seal.render.colours import CONTACT, INLET, NO_FLOW, OUTLET, Swatch
from fem_seal.render.flow import flow_layer, flow_scale
from fem_seal.render.offscreen import DrawnTriangles, draw_layers
from fem_seal.render.page import Window, add_bar, frame, page
from fem_seal.render.samples import gap_scale
from fem_seal.render.scale import Scale

MARGIN = 0.02  # white margin around the shape, over its longer side
WALL = Swatch("wall", (0, 0, 0))
BOUNDARY_WIDTH = 2.0  # width of the lines of inlet, outlet and walls [point]
BOUNDARIES = {"inlet": INLET, "outlet": OUTLET, "wall": WALL}


def draw_shape(film: MeshFilm, field: FlowField | None, folder: Path) -> None:
    """Draw mesh, gap and, if there is a field, flow: shape.png, gap.png, flow.png."""
    from matplotlib.collections import LineCollection

    mesh, contact = film.mesh, _contact_of(film)
    lines = [(BOUNDARIES[name], mesh.xy[ends]) for name, ends in mesh.groups() if len(ends)]
    key = (*(swatch for swatch, _ in lines), *(CONTACT,) * bool(contact))
    (x0, y0), (x1, y1) = mesh.xy.min(axis=0).tolist(), mesh.xy.max(axis=0).tolist()
    margin = MARGIN * max(x1 - x0, y1 - y0)
    window = Window(x0 - margin, x1 + margin, y0 - margin, y1 + margin)

    def draw(
        name: str, layers: Sequence[DrawnTriangles], scale: Scale | None, *more: Swatch
    ) -> None:
        """Picture of layers with inlet, outlet and walls; `more` stands in its key as well."""
        with page(window, folder / name, key=(*key, *more)) as ((axes,),):
            frame(axes, window)
            axes.imshow(draw_layers(layers, window), extent=window, aspect="auto")
            for swatch, ends in lines:
                axes.add_collection(LineCollection(ends, colors=[swatch.rgb], lw=BOUNDARY_WIDTH))
            add_bar(axes, scale)
            if name == "shape.png":
                axes.triplot(*mesh.xy.T, mesh.cells, color="black", linewidth=0.3, rasterized=True)

    draw("shape.png", contact, None)
    if film.largest_gap > 0:
        scale = gap_scale(film.values)
        shown = np.maximum(film.values * scale.per_si, scale.low)
        layer = DrawnTriangles(mesh.xy, mesh.cells, values=shown, scale=scale)
        draw("gap.png", [layer, *contact], scale)
    else:
        draw("gap.png", contact, None)
    if field is None:
        return
    scale = flow_scale(field)
    open_cells = mesh.cells[(film.values[mesh.cells] > 0).any(axis=1)]
    ground = DrawnTriangles(mesh.xy, open_cells, NO_FLOW.colour)
    # There are pockets if the field of the flow covers less than the open area.
    pockets = _area(field.points, field.cells) < (1 - 1e-9) * _area(mesh.xy, open_cells)
    draw("flow.png", [ground, flow_layer(field, scale), *contact], scale, *(NO_FLOW,) * pockets)


def _area(points: np.ndarray, cells: np.ndarray) -> float:
    """Total area of triangles (C, 3) with corners at points (N, 2)."""
    first, second = (points[cells[:, k]] - points[cells[:, 0]] for k in (1, 2))
    return 0.5 * float(np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum())


def _contact_of(film: MeshFilm) -> list[DrawnTriangles]:
    """Layers of the contact; empty list if there is none.

    Triangles with all corners in contact are drawn. If the film has a formula, so is the part of
    other triangles where it gives 0.
    """
    mesh = film.mesh
    touching = (film.values[mesh.cells] == 0).sum(axis=1)
    layers = [DrawnTriangles(mesh.xy, mesh.cells[touching == 3], CONTACT.colour)]
    at_rim = mesh.cells[(touching > 0) & (touching < 3)]
    if film.formula is not None and len(at_rim):
        pixel = float(np.ptp(mesh.xy, axis=0).max()) / offscreen.LONG_SIDE
        points, cells = _cut(mesh.xy, at_rim, pixel)
        touches = film.formula(points[cells].mean(axis=1)) == 0
        layers.append(DrawnTriangles(points, cells[touches], CONTACT.colour))
    return [layer for layer in layers if len(layer.cells)]


def _cut(points: np.ndarray, cells: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Halve triangles until no side is longer: points (n, 2) and cells (m, 3)."""
    from matplotlib.tri import Triangulation, UniformTriRefiner

    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 3)
    sides = np.linalg.norm(points[cells] - points[np.roll(cells, 1, axis=1)], axis=2)
    halvings = max(0, ceil(log2(sides.max() / longest)))
    refiner = UniformTriRefiner(Triangulation(points[:, 0], points[:, 1], cells))
    fine = refiner.refine_triangulation(subdiv=halvings)
    return np.column_stack([fine.x, fine.y]), fine.triangles
