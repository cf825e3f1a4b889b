"""Pictures of the flow on the solver's own triangles: flow density, pressure, mesh.

Flow density is the volume per second and width, |j| = K |grad p| [m^2/s], constant on a triangle;
the logarithmic colours follow the letter's Fig. 2 (PRL 108, 244301, 2012).
"""

from pathlib import Path

import numpy as np

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField, LeakRate
from fem_seal.render.colours import CONTACT_COLOUR, WHITE
from fem_seal.render.offscreen import LONG_SIDE, Mesh, Scale, Triangles, Window, draw
from fem_seal.render.page import Panel, Swatch, write_page
from fem_seal.render.tiles import mosaic

FLOW_COLOURS = "flow"
PRESSURE_COLOURS = "pressure"
DECADES = 4
CONTACT = Swatch("contact", CONTACT_COLOUR)
NO_FLOW = Swatch("open, weaker flow or none", WHITE)
NOT_REACHED = Swatch("open, not reached", WHITE)
EDGES = (0, 0, 0)


def flow_of(leak: LeakRate) -> FlowField:
    """Give the flow field of a leak rate.

    Raises
    ------
    InvalidInput
        If the seal is sealed or the solver was not asked for its field.
    """
    if leak.state == "sealed":
        raise InvalidInput("the seal is sealed: there is no flow to draw; draw the contact instead")
    if leak.field is None:
        raise InvalidInput(
            f"the {leak.method} leak rate holds no flow field; ask its solver to keep the field"
        )
    return leak.field


def flow_density(field: FlowField) -> np.ndarray:
    """|j| on each triangle, (C,) [m^2/s]."""
    return np.linalg.norm(field.flux, axis=1)


def flow_scale(*fields: FlowField, decades: int = DECADES) -> Scale:
    """One logarithmic scale for all the fields, ending at the next 1, 2 or 5 above the peak.

    Parameters
    ----------
    fields : flow fields to be compared
    decades : length of the bar at most, weaker flow is white; where there is none the bar is
        shorter, but has one decade at least

    Raises
    ------
    InvalidInput
        If nothing flows.
    """
    density = np.concatenate([flow_density(field) for field in fields])
    peak = density.max(initial=0.0)
    if not peak > 0:
        raise InvalidInput("the flow density is zero everywhere: it has no logarithmic scale")
    high, least = _step_above(peak), density.min()
    low = high / 10.0**decades
    if least > low:
        low = min(1 / _step_above(1 / least), high / 10.0)
    beyond = "min" if least < low else "neither"
    return Scale("flow density |j| [m²/s]", low, high, True, FLOW_COLOURS, beyond)


def _step_above(number: float) -> float:
    """Next 1, 2 or 5 of a decade, from the number on."""
    decade = 10.0 ** np.floor(np.log10(number))
    return next(step * decade for step in (1, 2, 5, 10) if number <= step * decade * (1 + 1e-9))


def flow_triangles(field: FlowField, scale: Scale) -> Triangles:
    """Flow density on the triangles of a field."""
    # Zero flow has no logarithm: it is below the scale, as all weak flow is.
    values = np.maximum(flow_density(field), 0.1 * scale.low)
    return Triangles(field.points, field.cells, values, scale)


def pressure_scale(field: FlowField) -> tuple[Scale, float]:
    """Scale of the pressure in its readable unit, and the factor from pascal to it."""
    low, high = float(field.pressure.min()), float(field.pressure.max())
    factor, unit = readable(max(abs(low), abs(high)), "Pa")
    return Scale(f"pressure [{unit}]", low * factor, high * factor, False, PRESSURE_COLOURS), factor


def _panel(
    gap: GridField,
    flow: Triangles | Mesh,
    representation: str,
    window: Window | None,
    long_side: int,
    title: str,
) -> Panel:
    """Draw contact over the flow, but under the edges of a mesh."""
    view = mosaic(gap, "wall", representation, window, long_side)
    # Cells wider than a pixel of the gap reach over contact, which certainly carries no flow.
    palette = np.array([(*CONTACT.colour, 255), (*CONTACT.colour, 0)])
    contact = view.shares((view.samples > 0).astype(np.uint8), palette)
    layers = [contact, flow] if isinstance(flow, Mesh) else [flow, contact]
    return Panel(draw(layers, view.window, long_side), view.window, title)


def flow_panel(
    field: FlowField,
    gap: GridField,
    scale: Scale,
    *,
    representation: str = "linear",
    window: Window | None = None,
    long_side: int = LONG_SIDE,
    title: str = "",
) -> Panel:
    """Draw the flow density on a scale from `flow_scale`; see `flow_picture`."""
    triangles = flow_triangles(field, scale)
    return _panel(gap, triangles, representation, window, long_side, title)


def flow_picture(
    leak: LeakRate,
    gap: GridField,
    path: str | Path,
    *,
    representation: str = "linear",
    scale: Scale | None = None,
    window: Window | None = None,
) -> Path:
    """Picture of the flow density on a logarithmic scale, with the contact.

    Parameters
    ----------
    leak : leak rate with its flow field
    gap : gap [m] the flow runs through
    path : .png, .pdf or .svg
    representation : of the gap in the solver, "linear" or "constant"
    scale : from `flow_scale`, to compare pictures; None spans DECADES down from the peak
    window : part of the seal to show [m]; None shows all

    Returns
    -------
    path

    Raises
    ------
    InvalidInput
        If the seal is sealed, the field is missing, or the path cannot be written.
    MissingPackage
        If no OpenGL library is installed.
    """
    field = flow_of(leak)
    scale = flow_scale(field) if scale is None else scale
    panel = flow_panel(field, gap, scale, representation=representation, window=window)
    return write_page([[panel]], path, scale=scale, key=(CONTACT, NO_FLOW))


def pressure_picture(
    leak: LeakRate,
    gap: GridField,
    path: str | Path,
    *,
    representation: str = "linear",
    window: Window | None = None,
) -> Path:
    """Picture of the pressure, linear on each triangle; arguments as in `flow_picture`."""
    field = flow_of(leak)
    scale, factor = pressure_scale(field)
    triangles = Triangles(field.points, field.cells, field.pressure * factor, scale)
    panel = _panel(gap, triangles, representation, window, LONG_SIDE, "")
    return write_page([[panel]], path, scale=scale, key=(CONTACT, NOT_REACHED))


def mesh_picture(
    leak: LeakRate,
    gap: GridField,
    path: str | Path,
    *,
    representation: str = "linear",
    window: Window | None = None,
) -> Path:
    """Picture of the mesh that carried the flow, its edges over the contact.

    Beside the whole mesh stands the surroundings of its strongest flow, where adaptive meshes are
    finest; a `window` is drawn alone. Arguments as in `flow_picture`.
    """
    field = flow_of(leak)
    fine, bold = (Mesh(field.points, field.cells, EDGES, line) for line in (0.5, 0.8))
    if window is not None:
        panels = [_panel(gap, bold, representation, window, LONG_SIDE, "")]
    else:
        whole = _panel(gap, fine, representation, None, LONG_SIDE, "whole seal")
        peak = peak_window(field, whole.window)
        near = _panel(gap, bold, representation, peak, LONG_SIDE, "around the strongest flow")
        panels = [whole, near]
    return write_page([panels], path, key=(CONTACT,))


def peak_window(field: FlowField, whole: Window, share: float = 1 / 8) -> Window:
    """Window of a share of each side of the seal, around the triangle of strongest flow."""
    strongest = field.cells[np.argmax(flow_density(field))]
    centre = field.points[strongest].mean(axis=0)
    half = 0.5 * share * np.array([whole.x1, whole.y1])
    centre = np.clip(centre, half, np.array([whole.x1, whole.y1]) - half)
    (x0, y0), (x1, y1) = centre - half, centre + half
    return Window(x0, x1, y0, y1)
