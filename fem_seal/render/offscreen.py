"""Drawing on triangles without a screen, by PyVista.

A drawing is a stack of layers inside a window of the seal. Coordinates are converted from metres to
pixels for VTK: camera and clipping planes are then the same for a flange of a metre and a patch of
a micrometre.
"""

import ctypes.util
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
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


@contextmanager
def off_screen(width: int, height: int) -> Iterator[tuple[ModuleType, Any]]:
    """PyVista, and a plotter for so many pixels: white, in parallel projection, without light."""
    require_gl()
    # DOLFINx 0.5 to 0.7 leave RTLD_GLOBAL set; if VTK is loaded then, it crashes on symbols of
    # libstdc++.
    if "dolfinx" in sys.modules and sys.getdlopenflags() & os.RTLD_GLOBAL:
        raise MissingPackage(
            "dolfinx was imported before fem_seal could make it safe for VTK; put "
            "'import fem_seal.fenicsx' before the first 'import dolfinx'"
        )
    import pyvista

    size = [SUPERSAMPLING * width, SUPERSAMPLING * height]
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=size, lighting="none")
    try:
        plotter.set_background("white")
        plotter.enable_parallel_projection()
        yield pyvista, plotter
    finally:
        plotter.close()


def draw_layers(layers: Sequence[DrawnTriangles], window: Window) -> np.ndarray:
    """Draw layers, later ones over earlier ones, in parallel projection.

    The pixels are (height, width, 3) uint8, the first row at y = y1, the first column at x = x0.
    The window fills the picture, whose longer side has LONG_SIDE pixels, exactly.
    """
    width, height = (round(LONG_SIDE * part) for part in window.shape)
    with off_screen(width, height) as (vista, plotter):
        for depth, layer in enumerate(layers):
            pixels = (layer.points - (window.x0, window.y0)) / window.lengths * (width, height)
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
        middle = width / 2, height / 2
        plotter.camera_position = [(*middle, len(layers) + 10.0), (*middle, 0.0), (0.0, 1.0, 0.0)]
        plotter.camera.parallel_scale = height / 2
        plotter.reset_camera_clipping_range()
        return pixels_of(plotter)


def pixels_of(plotter: "pyvista.Plotter") -> np.ndarray:
    """Pixels (height, width, 3) uint8: means over a drawing SUPERSAMPLING times as large."""
    samples = np.asarray(plotter.screenshot(return_img=True))
    height, width = (n // SUPERSAMPLING for n in samples.shape[:2])
    samples = samples.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 3)
    return np.rint(samples.mean(axis=(1, 3))).astype(np.uint8)
