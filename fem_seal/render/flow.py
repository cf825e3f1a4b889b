"""Pictures of the flow on the triangles of the solver: flow density, pressure, mesh.

The flow density |j| = K |∇p| [m²/s] is the volume per time and width, constant on a triangle. Its
logarithmic colour scale follows Fig. 2 of the letter (PRL 108, 244301, 2012).
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.leak_rate import FlowField, LeakRate
from fem_seal.render.colours import CONTACT_COLOUR, OPEN_COLOUR, WHITE
from fem_seal.render.offscreen import DrawnMesh, DrawnTriangles, draw_layers
from fem_seal.render.page import ISOLINES, Panel, Swatch, panel_of, write_page
from fem_seal.render.tiles import mosaic, paint
from fem_seal.render.window import LONG_SIDE, Scale, Window, isoline_levels, logarithmic_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FLOW_COLOURS = "flow"
PRESSURE_COLOURS = "pressure"
DECADES = 4  # length of the colour bar
CONTACT = Swatch("contact", CONTACT_COLOUR)
NO_FLOW = Swatch("open, but no flow", OPEN_COLOUR)
EDGES = (0, 0, 0)


def flow_of(leak: LeakRate) -> FlowField:
    """Flow field of a leak rate."""
    if leak.state == "sealed":
        raise InvalidInput("the seal is sealed: there is no flow to draw; draw the contact instead")
    if leak.field is None:
        raise InvalidInput(
            f"the {leak.method} leak rate holds no flow field; ask its solver to keep the field"
        )
    return leak.field


def flow_density(field: FlowField) -> np.ndarray:
    """Flow density |j| (C,) [m^2/s] on each triangle."""
    return np.linalg.norm(field.flux, axis=1)


def flow_scale(*fields: FlowField, decades: int = DECADES) -> Scale:
    """One logarithmic scale for all fields; its end is 1, 2 or 5 × 10ⁿ, not below the peak.

    Parameters
    ----------
    *fields : the fields to compare
    decades : largest length of the bar; weaker flow has the colour of its lower end. If no flow is
        that weak, the bar is shorter, but at least one decade long
    """
    density = np.concatenate([flow_density(field) for field in fields])
    peak = density.max(initial=0.0)
    if not peak > 0:
        raise InvalidInput("the flow density is zero everywhere: it has no logarithmic scale")
    least = float(density.min())
    return logarithmic_scale("flow density |j| [m²/s]", least, peak, decades, FLOW_COLOURS)


def flow_triangles(field: FlowField, scale: Scale) -> DrawnTriangles:
    """Triangles of a field in the colours of its flow density."""
    # Zero has no logarithm: draw it like all flow that is below the scale.
    values = np.maximum(flow_density(field), scale.low)
    return DrawnTriangles(field.points, field.cells, values, scale)


def pressure_scale(field: FlowField) -> tuple[Scale, float]:
    """Scale of the pressure in a readable unit, and the factor from pascal to this unit."""
    low, high = float(field.pressure.min()), float(field.pressure.max())
    factor, unit = readable(max(abs(low), abs(high)), "Pa")
    low, high = low * factor, high * factor
    levels = isoline_levels(low, high)
    return Scale(f"pressure [{unit}]", low, high, colours=PRESSURE_COLOURS, lines=levels), factor


def _panel(
    film: GridFilm,
    flow: Sequence[DrawnTriangles | DrawnMesh],
    window: Window | None,
    long_side: int,
    title: str,
) -> Panel:
    """Draw the flow below contact and pockets, but a mesh above the contact."""
    view = mosaic(film, window, long_side)
    drawn = draw_layers(flow, view.window, long_side)
    # Triangles wider than a pixel extend over contact and pockets, which carry no flow.
    colours = np.array([(*CONTACT.colour, 255), (*NO_FLOW.colour, 255), (*NO_FLOW.colour, 0)])
    classes = np.where(film.carrying, np.uint8(2), np.where(view.samples > 0, np.uint8(1), 0))
    with_mesh = any(isinstance(layer, DrawnMesh) for layer in flow)
    if with_mesh:
        contact = view.mean_colours(np.minimum(classes, 1), np.array([CONTACT.colour, WHITE]))
        ground = paint(contact, view.window, long_side)
        # The lines are black on white: multiplication draws them on the ground.
        drawn = np.rint(drawn / 255 * ground).astype(np.uint8)
    else:
        drawn = paint(view.mean_colours(classes, colours), view.window, long_side, drawn)
    return panel_of(film, drawn, view.window, title, marked=not with_mesh)


def flow_panel(
    field: FlowField | None,
    film: GridFilm,
    scale: Scale,
    *,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the flow density on a scale from `flow_scale`; see `flow_picture`.

    Without a field, as for a sealed film, no flow is drawn.
    """
    layers = [] if field is None else [flow_triangles(field, scale)]
    return _panel(film, layers, window, long_side, title)


def flow_picture(
    leak: LeakRate,
    film: GridFilm,
    path: str | Path,
    *,
    scale: Scale | None = None,
    window: Window | None = None,
) -> Path:
    """Picture of the flow density on a logarithmic scale, with contact in grey.

    Pockets and dead ends are pale blue, and the critical constriction is marked.

    Parameters
    ----------
    leak : leak rate with its flow field
    film : film on a grid through which the fluid flows
    path : the file, .png, .pdf or .svg
    scale : scale from `flow_scale`, to compare pictures; if left out that of this flow
    window : part of the seal to show [m]; all if left out

    Returns
    -------
    Path of the file.
    """
    field = flow_of(leak)
    scale = flow_scale(field) if scale is None else scale
    panel = flow_panel(field, film, scale, window=window)
    return write_page([[panel]], path, scale=scale, key=(CONTACT, NO_FLOW))


def pressure_picture(
    leak: LeakRate,
    film: GridFilm,
    path: str | Path,
    *,
    window: Window | None = None,
) -> Path:
    """Picture of the pressure, linear on each triangle, with isobars; see `flow_picture`."""
    field = flow_of(leak)
    scale, factor = pressure_scale(field)
    pressure = field.pressure * factor
    layer = DrawnTriangles(field.points, field.cells, pressure, scale)

    def isobars(axes: "Axes", unit: float) -> None:
        from matplotlib.tri import Triangulation

        x, y = unit * field.points.T
        mesh = Triangulation(x, y, field.cells)
        axes.tricontour(mesh, pressure, levels=scale.lines, **ISOLINES)

    panel = _panel(film, [layer], window, LONG_SIDE, "")
    lined = replace(panel, isolines=isobars if scale.lines else None)
    return write_page([[lined]], path, scale=scale, key=(CONTACT, NO_FLOW))


def mesh_picture(
    leak: LeakRate,
    film: GridFilm,
    path: str | Path,
    *,
    window: Window | None = None,
) -> Path:
    """Picture of the edges of the mesh on which the flow was solved, with contact in grey.

    One panel shows the whole mesh, a second one the part around the strongest flow, where an
    adaptive mesh is finest; a rectangle marks it in the first. With a `window` there is one panel.
    Arguments as in `flow_picture`.
    """
    field = flow_of(leak)
    fine, bold = (DrawnMesh(field.points, field.cells, EDGES, line) for line in (0.5, 0.8))
    if window is not None:
        panels = [_panel(film, [bold], window, LONG_SIDE, "")]
    else:
        whole = _panel(film, [fine], None, LONG_SIDE, "whole seal")
        peak = peak_window(field, whole.window)
        detail = _panel(film, [bold], peak, LONG_SIDE, "around the strongest flow")
        panels = [replace(whole, enlarged=peak), detail]
    return write_page([panels], path, key=(CONTACT,))


def peak_window(field: FlowField, whole: Window, part: float = 1 / 8) -> Window:
    """Window around the triangle of strongest flow, its sides a `part` of those of the seal."""
    strongest = field.cells[np.argmax(flow_density(field))]
    centre = field.points[strongest].mean(axis=0)
    half = 0.5 * part * np.array([whole.x1, whole.y1])
    centre = np.clip(centre, half, np.array([whole.x1, whole.y1]) - half)
    (x0, y0), (x1, y1) = centre - half, centre + half
    return Window(x0, x1, y0, y1)
