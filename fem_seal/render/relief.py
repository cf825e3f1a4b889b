"""The gap as a landscape: contact is its plateau, the flow runs through its valleys."""

from math import ceil
from pathlib import Path

import numpy as np

from fem_seal.film.grid_film import GridFilm
from fem_seal.leak_rate import FlowField
from fem_seal.render.colours import CONTACT, INLET, NO_FLOW, OUTLET, Swatch
from fem_seal.render.flow import draw_flow, flow_scale
from fem_seal.render.offscreen import SUPERSAMPLING, off_screen, pixels_of
from fem_seal.render.page import SIDE, Window, add_bar, page, window_of
from fem_seal.render.plot import DPI
from fem_seal.render.scale import step_above

SAMPLES = 400  # samples of the landscape along its longer side, at most; means of blocks
DEPTH = 0.06  # least depth of the deepest valley, as part of the longer side
# Light on the landscape: direction towards the sun, at the left front, and part without direction.
SUN, AMBIENT = (-0.6, -0.5, 1.0), 0.35
WIDTH = 1600  # width of the drawing before its margins are cut off [pixel]
PIN = Swatch("pin: critical constriction", (0, 0, 0))


def relief_picture(field: FlowField, film: GridFilm, path: str | Path) -> None:
    """Picture of the gap as a landscape, its depth exaggerated, with the flow density on it.

    `path` ends in .png, .pdf or .svg.
    """
    scale, sites = flow_scale(field), film.sites
    gap = sites.on_samples(sites.gap)
    block = ceil(max(gap.shape) / SAMPLES)
    nx, ny = (n // block for n in gap.shape)
    gap = gap[: nx * block, : ny * block].reshape(nx, block, ny, block).mean(axis=(1, 3))
    factor = step_above(DEPTH * max(film.size) / float(gap.max()))
    # The picture covers the landscape from edge to edge.
    x, y = np.linspace(0.0, film.size[0], nx), np.linspace(0.0, film.size[1], ny)
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), -factor * gap], axis=2)
    critical = film.constriction
    pin = None if critical is None else (*critical.position, -factor * critical.gap)
    pixels = draw_relief(points, _flat(field, film), pin, WIDTH)
    height, width = pixels.shape[:2]
    key = (CONTACT, NO_FLOW, INLET, OUTLET, PIN)
    with page(Window(0, width, 0, height), path, side=1.3 * SIDE, key=key) as axes:
        axes[0, 0].imshow(pixels)
        axes[0, 0].set_axis_off()
        axes[0, 0].set_title(
            f"the gap as a landscape, its depth times {factor:g}; contact is the plateau"
        )
        add_bar(axes[0, 0], scale)


def draw_relief(
    points: np.ndarray,
    picture: np.ndarray,
    pin: tuple[float, float, float] | None,
    width: int,
) -> np.ndarray:
    """Draw a landscape, seen from above the edge of smallest y, as (height, width, 3) uint8.

    Its points (mx, my, 3) are in any unit, x and y from 0. The picture (height, width, 3) uint8
    covers it; its first row lies at the largest y. A black pin has its foot at (x, y, z). The
    drawing is so many pixels wide before its white margins are cut off.
    """
    from PIL import Image, ImageOps

    with off_screen(width, width) as (vista, plotter):
        unit = points[..., :2].max()
        surface = vista.StructuredGrid(*np.moveaxis(points / unit, 2, 0))
        _, along, _, across, *_ = surface.bounds
        plane = {"origin": (0, 0, 0), "point_u": (along, 0, 0), "point_v": (0, across, 0)}
        plotter.add_light(vista.Light(position=SUN, light_type="scene light"))
        # Level ground, such as contact, keeps the colours of the picture and of its key.
        diffuse = (1 - AMBIENT) / (SUN[2] / np.linalg.norm(SUN))
        plotter.add_mesh(
            surface.texture_map_to_plane(**plane),
            texture=vista.Texture(np.ascontiguousarray(picture)),
            ambient=AMBIENT,
            diffuse=diffuse,
            specular=0.0,
            smooth_shading=True,
        )
        plain = {"lighting": False, "line_width": SUPERSAMPLING * 4.0}
        for swatch, row in ((INLET, points[0]), (OUTLET, points[-1])):
            raised = vista.lines_from_points(np.add(row / unit, (0.0, 0.0, 0.004)))
            plotter.add_mesh(raised, color=swatch.colour, **plain)
        if pin is not None:
            foot = np.array(pin) / unit
            head = np.array([*foot[:2], 0.1])
            plotter.add_mesh(vista.Line(foot, head), color="black", **plain)
            ball = vista.Sphere(radius=0.012, center=head)
            plotter.add_mesh(ball, color="black", lighting=False)
        plotter.view_vector((-0.8, -1.5, 1.5), viewup=(0.0, 0.0, 1.0))
        plotter.camera.zoom(0.9)  # room for lines and pin
        drawn = Image.fromarray(pixels_of(plotter))
    return np.asarray(drawn.crop(ImageOps.invert(drawn).getbbox()))


def _flat(field: FlowField, film: GridFilm) -> np.ndarray:
    """The flow from above, (height, width, 3) uint8, without axes, to be laid on the landscape."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    wide, high = window_of(film).shape
    figure = Figure((SIDE * wide, SIDE * high), dpi=DPI)
    canvas, axes = FigureCanvasAgg(figure), figure.add_axes((0, 0, 1, 1))
    draw_flow(axes, field, film, flow_scale(field))
    for line in axes.lines:
        line.remove()
    axes.set_axis_off()
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]
