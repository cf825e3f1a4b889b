"""Pictures of the flow on the triangles of the solver: flow density, pressure, mesh.

The flow density |j| = K |∇p| [m²/s] is the volume per time and width, constant on a triangle. Its
logarithmic colour scale follows Fig. 2 of the letter (PRL 108, 244301, 2012).
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.leak_rate import FlowField
from fem_seal.render.colours import CONTACT, INLET, NO_FLOW
from fem_seal.render.offscreen import DrawnTriangles, draw_layers
from fem_seal.render.page import (
    ISOLINES,
    Window,
    add_bar,
    draw_samples,
    frame_film,
    page,
    window_of,
)
from fem_seal.render.scale import Scale, logarithmic_scale, pressure_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FLOW_COLOURS = "flow"
DECADES = 4  # length of the colour bar
DETAIL = 1 / 8  # sides of the enlarged part of a mesh, over those of the seal


def flow_density(field: FlowField | None) -> np.ndarray:
    """Flow density |j| (C,) [m^2/s] on each triangle."""
    if field is None:
        raise InvalidInput(
            "there is no flow field to draw: a sealed gap has none, and a leaking one only with "
            "FlowSettings(field=True)"
        )
    return np.linalg.norm(field.flux, axis=1)


def flow_scale(*fields: FlowField | None, decades: int = DECADES) -> Scale:
    """One logarithmic scale for all fields; its end is 1, 2 or 5 × 10ⁿ, not below the peak.

    Flow that is weaker than `decades` below the end has the colour of the lower end. If no flow is
    that weak, the bar is shorter, but at least one decade long.
    """
    density = np.concatenate([flow_density(field) for field in fields])
    if not density.max(initial=0.0) > 0:
        raise InvalidInput("the flow density is zero everywhere: it has no logarithmic scale")
    return logarithmic_scale("flow density |j| [m²/s]", density, decades, FLOW_COLOURS)


def flow_layer(field: FlowField, scale: Scale) -> DrawnTriangles:
    """Triangles of a field in the colours of its flow density."""
    return DrawnTriangles(field.points, field.cells, values=flow_density(field), scale=scale)


def _draw_below_contact(
    axes: "Axes", film: GridFilm, layer: DrawnTriangles, window: Window
) -> None:
    """Draw triangles below contact and pockets, over which those wider than a sample extend."""
    axes.imshow(draw_layers([layer], window), extent=window, aspect="auto")
    _draw_contact(axes, film)


def _draw_contact(
    axes: "Axes", film: GridFilm, flowing: tuple[int, ...] = (*CONTACT.colour, 0)
) -> None:
    """Draw contact and pockets; where fluid flows, nothing or another colour with its opacity."""
    gap = film.sites.on_samples(film.sites.gap)
    colours = np.full((*gap.shape, 4), (*CONTACT.colour, 255), dtype=np.uint8)
    colours[gap > 0] = (*NO_FLOW.colour, 255)
    colours[film.carrying] = flowing
    draw_samples(axes, film, colours)


def draw_flow(
    axes: "Axes",
    field: FlowField | None,
    film: GridFilm,
    scale: Scale,
    *,
    window: Window | None = None,
    title: str = "",
) -> None:
    """Draw the flow density on a scale from `flow_scale`; without a field a sealed film."""
    view = frame_film(axes, film, window, title, marked=True)
    if field is None:
        _draw_contact(axes, film)
    else:
        _draw_below_contact(axes, film, flow_layer(field, scale), view)


def flow_picture(field: FlowField, film: GridFilm, path: str | Path) -> None:
    """Picture of the flow density on a logarithmic scale, with contact in grey.

    Pockets and dead ends are pale blue, and the critical constriction is marked. `path`
    ends in .png, .pdf or .svg.
    """
    scale = flow_scale(field)
    with page(window_of(film), path, key=(CONTACT, NO_FLOW)) as axes:
        draw_flow(axes[0, 0], field, film, scale)
        add_bar(axes[0, 0], scale)


def pressure_picture(field: FlowField, film: GridFilm, path: str | Path) -> None:
    """Picture of the pressure, linear on each triangle, with isobars; see `flow_picture`."""
    scale = pressure_scale("pressure", field.pressure)
    pressure = field.pressure * scale.per_si
    layer = DrawnTriangles(field.points, field.cells, values=pressure, scale=scale)
    with page(window_of(film), path, key=(CONTACT, NO_FLOW)) as ((axes,),):
        _draw_below_contact(axes, film, layer, frame_film(axes, film, marked=True))
        axes.tricontour(*field.points.T, field.cells, pressure, levels=scale.lines, **ISOLINES)
        add_bar(axes, scale)


def mesh_picture(field: FlowField, film: GridFilm, path: str | Path) -> None:
    """Picture of the edges of the mesh on which the flow was solved, with contact in grey.

    One panel shows the whole mesh, a second one the part around the strongest flow, where an
    adaptive mesh is finest; a rectangle marks it in the first. Arguments as in `flow_picture`.
    """
    from matplotlib.patches import Rectangle

    whole = window_of(film)
    part = peak_window(field, whole)
    panels = ((whole, "whole seal", 0.1), (part, "around the strongest flow", 0.3))
    with page(whole, path, shape=(1, 2), key=(CONTACT, NO_FLOW)) as axes:
        for place, (window, title, line) in zip(axes[0], panels, strict=True):
            frame_film(place, film, window, title)
            _draw_contact(place, film, (255, 255, 255, 255))
            x, y = field.points.T
            place.triplot(x, y, field.cells, color="black", linewidth=line, rasterized=True)
            place.set(xlim=window[:2], ylim=window[2:])
        mark = Rectangle((part.x0, part.y0), *part.lengths, fill=False, lw=1.5, ec=INLET.rgb)
        axes[0, 0].add_patch(mark)


def peak_window(field: FlowField, whole: Window) -> Window:
    """Window around the triangle of strongest flow, inside the whole one."""
    strongest = field.cells[np.argmax(flow_density(field))]
    half = 0.5 * DETAIL * np.array(whole.lengths)
    centre = np.clip(field.points[strongest].mean(axis=0), half, np.array(whole.lengths) - half)
    (x0, y0), (x1, y1) = centre - half, centre + half
    return Window(float(x0), float(x1), float(y0), float(y1))
