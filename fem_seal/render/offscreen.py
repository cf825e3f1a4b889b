"""Drawing without a screen: the only module that draws with PyVista.

A drawing is a stack of layers inside a window of the seal. Coordinates are converted from metres to
pixels for VTK: camera and clipping planes are then the same for a flange of a metre and a patch of
a micrometre.
"""

import ctypes.util
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.render.colours import colour_map
from fem_seal.render.page import Window
from fem_seal.render.scale import Scale

if TYPE_CHECKING:
    import pyvista

LONG_SIDE = 1200  # longer side of a drawing [pixel]
SUPERSAMPLING = 2  # each pixel is the mean of SUPERSAMPLING² drawn ones: edges become smooth

# Light on a landscape: direction towards the sun, at the left front, and part without direction.
SUN, AMBIENT = (-0.6, -0.5, 1.0), 0.35

# VTK's render windows, and the OpenGL library that each loads at run time.
GL_LIBRARIES = {
    "vtkEGLRenderWindow": "EGL",
    "vtkOSOpenGLRenderWindow": "OSMesa",
    "vtkXOpenGLRenderWindow": "GL",
}


@dataclass(frozen=True, eq=False)
class DrawnTriangles:
    """Triangles in one colour, or in the colours of a scale."""

    points: np.ndarray  #: (N, 2), coordinates [m]
    cells: np.ndarray  #: (C, 3) int, corners of the triangles
    colour: tuple[int, int, int] = (0, 0, 0)  #: red, green, blue, 0..255, of a layer without scale
    #: (C,) or (N,), values that are constant on cells, or at points and linear on cells, in the
    #: unit of the scale
    values: np.ndarray | None = None
    scale: Scale | None = None


def require_gl() -> None:
    """Choose a render window that works without a screen.

    Without its OpenGL library VTK would end the process.
    """
    chosen = os.environ.get("VTK_DEFAULT_OPENGL_WINDOW")
    if chosen is not None and chosen not in GL_LIBRARIES:
        raise InvalidInput(
            f"VTK_DEFAULT_OPENGL_WINDOW = {chosen!r} is not known; unset it or choose from "
            f"{', '.join(GL_LIBRARIES)}"
        )
    offscreen = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
    if chosen is None and sys.platform == "darwin":
        return  # VTK draws with Cocoa there, which is part of macOS
    candidates = (chosen,) if chosen else offscreen
    for window in candidates:
        if ctypes.util.find_library(GL_LIBRARIES[window]):
            # Set it even if it is VTK's default: otherwise VTK prints a warning about X.
            os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = window
            return
    missing = " or ".join(f"lib{GL_LIBRARIES[window]}" for window in candidates)
    raise MissingPackage(
        f"pictures need the OpenGL library {missing}, which is not installed; on Debian: "
        "apt-get install libegl1"
    )


def _import_pyvista() -> ModuleType:
    require_gl()
    # DOLFINx 0.5 to 0.7 leave RTLD_GLOBAL set; if VTK is loaded then, it crashes on symbols of
    # libstdc++.
    if "dolfinx" in sys.modules and sys.getdlopenflags() & os.RTLD_GLOBAL:
        raise MissingPackage(
            "dolfinx was imported before fem_seal could make it safe for VTK; put "
            "'import fem_seal.fenicsx' before the first 'import dolfinx'"
        )
    import pyvista

    return pyvista


def draw_layers(
    layers: Sequence[DrawnTriangles], window: Window, long_side: int = LONG_SIDE
) -> np.ndarray:
    """Draw layers, later ones over earlier ones, in parallel projection.

    The pixels are (height, width, 3) uint8, the first row at y = y1, the first column at x = x0.
    The window fills the picture, whose longer side has `long_side` pixels, exactly.
    """
    vista = _import_pyvista()
    width, height = (round(long_side * part) for part in window.shape)
    plotter = vista.Plotter(
        off_screen=True,
        window_size=(SUPERSAMPLING * width, SUPERSAMPLING * height),
        lighting="none",
    )
    try:
        plotter.set_background("white")
        for depth, layer in enumerate(layers):
            pixels = (layer.points - (window.x0, window.y0)) / window.sides * (width, height)
            points = np.column_stack([pixels, np.full(len(pixels), float(depth))])
            surface = vista.PolyData.from_regular_faces(points, np.asarray(layer.cells))
            colours: dict[str, Any] = {"color": layer.colour}
            if layer.scale is not None:
                colours = {
                    "scalars": np.asarray(layer.values, dtype=float),
                    "clim": (layer.scale.low, layer.scale.high),
                    "cmap": colour_map(layer.scale.colours),
                    "log_scale": layer.scale.logarithmic,
                    "interpolate_before_map": True,
                    "show_scalar_bar": False,
                }
            plotter.add_mesh(surface, lighting=False, **colours)
        plotter.camera_position = [
            (width / 2, height / 2, len(layers) + 10.0),
            (width / 2, height / 2, 0.0),
            (0.0, 1.0, 0.0),
        ]
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = height / 2
        plotter.reset_camera_clipping_range()
        return _pixels_of(plotter, width, height)
    finally:
        plotter.close()


@dataclass(frozen=True, eq=False)
class Relief:
    """A landscape with a picture on it."""

    points: np.ndarray  #: (mx, my, 3), points of the landscape in any unit, x and y from 0
    #: (height, width, 3) uint8, picture that covers the landscape, first row at the largest y
    picture: np.ndarray
    #: colours of the edges at the smallest and at the largest x
    edges: tuple[tuple[int, int, int], tuple[int, int, int]]
    pin: tuple[float, float, float] | None  #: (x, y, z), foot of a black pin


def draw_relief(relief: Relief, long_side: int = LONG_SIDE) -> np.ndarray:
    """Draw a landscape, seen from above the edge of smallest y, as (height, width, 3) uint8.

    Its white margins are cut off; before that it is `long_side` pixels wide.
    """
    vista = _import_pyvista()
    points = relief.points / relief.points[..., :2].max()
    mx, my = points.shape[:2]
    corner = np.arange(mx * my).reshape(mx, my)
    corners = (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    quads = np.stack([corner.ravel() for corner in corners], axis=1)
    surface = vista.PolyData.from_regular_faces(points.reshape(-1, 3), quads)
    x, y, z = surface.points.T
    surface.active_texture_coordinates = np.column_stack([x / x.max(), y / y.max()])
    size = SUPERSAMPLING * long_side
    plotter = vista.Plotter(off_screen=True, window_size=(size, size), lighting="none")
    try:
        plotter.set_background("white")
        texture = vista.Texture(np.ascontiguousarray(relief.picture))
        plotter.add_light(vista.Light(position=SUN, light_type="scene light"))
        # Level ground, such as contact, keeps the colours of the picture and of its key.
        diffuse = (1 - AMBIENT) / (SUN[2] / np.linalg.norm(SUN))
        shading = {"ambient": AMBIENT, "diffuse": diffuse, "specular": 0.0, "smooth_shading": True}
        plotter.add_mesh(surface, texture=texture, **shading)
        plain = {"lighting": False, "line_width": SUPERSAMPLING * 4.0}
        for colour, row in zip(relief.edges, (points[0], points[-1]), strict=True):
            raised = vista.lines_from_points(np.add(row, (0.0, 0.0, 0.004)))
            plotter.add_mesh(raised, color=colour, **plain)
        if relief.pin is not None:
            foot = np.array(relief.pin) / relief.points[..., :2].max()
            head = np.array([*foot[:2], 0.1])
            plotter.add_mesh(vista.Line(foot, head), color="black", **plain)
            ball = vista.Sphere(radius=0.012, center=head)
            plotter.add_mesh(ball, color="black", lighting=False)
        centre = np.array([x.max() / 2, y.max() / 2, z.mean()])
        plotter.camera_position = [np.add(centre, (-0.8, -1.5, 1.5)), centre, (0.0, 0.0, 1.0)]
        plotter.enable_parallel_projection()
        plotter.reset_camera()
        plotter.camera.zoom(0.9)  # room for lines and pin
        return _without_margins(_pixels_of(plotter, long_side, long_side))
    finally:
        plotter.close()


def _pixels_of(plotter: "pyvista.Plotter", width: int, height: int) -> np.ndarray:
    """Pixels (height, width, 3) uint8: means over a drawing SUPERSAMPLING times as large."""
    samples = np.asarray(plotter.screenshot(return_img=True))
    samples = samples.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 3)
    return np.rint(samples.mean(axis=(1, 3))).astype(np.uint8)


def _without_margins(pixels: np.ndarray) -> np.ndarray:
    """Cut off all but a few of the white rows and columns around a drawing."""
    drawn, margin, cut = (pixels < 255).any(axis=2), 20, []
    for axis in (1, 0):
        inside = np.flatnonzero(drawn.any(axis=axis))
        first, last = (inside[0], inside[-1]) if inside.size else (0, drawn.shape[1 - axis] - 1)
        cut.append(slice(max(first - margin, 0), last + 1 + margin))
    return pixels[cut[0], cut[1]]
