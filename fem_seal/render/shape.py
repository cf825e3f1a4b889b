"""Pictures of a film of any shape on the triangles of its mesh: mesh, gap and flow."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fem_seal.film.mesh_film import MeshFilm
from fem_seal.leak_rate import FlowField
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

    mesh = film.mesh
    touching = mesh.cells[(film.values[mesh.cells] == 0).all(axis=1)]
    contact = [DrawnTriangles(mesh.xy, touching, CONTACT.colour)] if len(touching) else []
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
