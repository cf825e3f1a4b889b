"""Drawing without a screen: the only module that imports PyVista.

A drawing is a stack of layers inside a window of the seal. All coordinates are converted from
metres to pixels before VTK gets them, so that camera and clipping planes are the same for a flange
of a metre and a patch of a micrometre.
"""

import ctypes.util
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.render.colours import WHITE, colour_map

if TYPE_CHECKING:
    import pyvista

LONG_SIDE = 1200  # length of the longer side [pixel]
SHORT_SIDE = 240  # least length of the shorter side [pixel]; narrower strips are stretched to it
SUPERSAMPLING = 2  # each pixel is the mean of SUPERSAMPLING² drawn ones, which smooths edges

# VTK's render windows with the OpenGL library that each loads at run time.
GL_LIBRARIES = {
    "vtkEGLRenderWindow": "EGL",
    "vtkOSOpenGLRenderWindow": "OSMesa",
    "vtkXOpenGLRenderWindow": "GL",
}


@dataclass(frozen=True)
class Window:
    """The rectangle of the seal that a picture shows.

    Parameters
    ----------
    x0, x1 : float
        Its ends along the flow [m], x0 < x1.
    y0, y1 : float
        Its ends across the flow [m], y0 < y1.

    Raises
    ------
    InvalidInput
        If it is empty.
    """

    x0: float
    x1: float
    y0: float
    y1: float

    def __post_init__(self) -> None:
        if not (self.x0 < self.x1 and self.y0 < self.y1):
            raise InvalidInput(
                f"a picture needs a window with x0 < x1 and y0 < y1 [m], got x {self.x0:g} to "
                f"{self.x1:g} and y {self.y0:g} to {self.y1:g}"
            )

    def pixels(self, long_side: int = LONG_SIDE) -> tuple[int, int]:
        """Width and height of the picture, to scale unless one side is very short."""
        width, height = self.x1 - self.x0, self.y1 - self.y0
        scale = long_side / max(width, height)
        shortest = min(SHORT_SIDE, long_side)
        return max(shortest, round(width * scale)), max(shortest, round(height * scale))


@dataclass(frozen=True)
class Scale:
    """Colour scale of a quantity, for the field and for its colour bar.

    Parameters
    ----------
    label : str
        Quantity and unit, "gap [µm]".
    low, high : float
        Values at the ends of the bar. Larger values have the colour of its end, smaller ones are
        white.
    logarithmic : bool
        Whether equal ratios (True) or equal differences are equal steps of colour.
    colours : str
        Name of a map of `fem_seal.render.colours`.
    beyond : "neither", "min", "max" or "both"
        Ends of the bar beyond which there are values.
    """

    label: str
    low: float
    high: float
    logarithmic: bool = False
    colours: str = "viridis"
    beyond: str = "neither"

    def __post_init__(self) -> None:
        least = 0.0 if self.logarithmic else -np.inf
        if not (np.isfinite([self.low, self.high]).all() and least < self.low < self.high):
            kind = "0 < low < high" if self.logarithmic else "low < high"
            raise InvalidInput(
                f"the colour scale of {self.label!r} runs from {self.low:g} to {self.high:g}; "
                f"it needs finite limits with {kind}"
            )


@dataclass(frozen=True, eq=False)
class Tiles:
    """Equal rectangles of one colour each that fill a window.

    Parameters
    ----------
    colours : (nx, ny, 3) uint8, or (nx, ny, 4) with opacity
    extent : Window
        The window [m].
    """

    colours: np.ndarray
    extent: Window


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles coloured by values on cells or at points.

    Parameters
    ----------
    points : (N, 2) float
        Coordinates [m].
    cells : (C, 3) int
        Corners of the triangles.
    values : (C,) or (N,) float
        Values that are constant on cells, or at points and linear on cells.
    scale : Scale
        Colour scale of the values.
    """

    points: np.ndarray
    cells: np.ndarray
    values: np.ndarray
    scale: Scale


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in one colour, drawn as edges or filled.

    Parameters
    ----------
    points : (N, 2) float
        Coordinates [m].
    cells : (C, 3) int
        Corners of the triangles.
    colour : (int, int, int)
        Red, green, blue, 0..255.
    line : float
        Width of the edges [pixel]; 0 fills the triangles.
    """

    points: np.ndarray
    cells: np.ndarray
    colour: tuple[int, int, int]
    line: float


def require_gl() -> None:
    """Choose a render window that works without a screen.

    Without its OpenGL library VTK would end the process.

    Raises
    ------
    MissingPackage
        If the OpenGL library of the window is not installed.
    """
    chosen = os.environ.get("VTK_DEFAULT_OPENGL_WINDOW")
    if chosen is not None and chosen not in GL_LIBRARIES:
        raise InvalidInput(
            f"VTK_DEFAULT_OPENGL_WINDOW = {chosen!r} is not known; unset it or choose from "
            f"{', '.join(GL_LIBRARIES)}"
        )
    offscreen = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
    candidates = (chosen,) if chosen else offscreen
    for window in candidates:
        if ctypes.util.find_library(GL_LIBRARIES[window]):
            # Set it also if it is VTK's own choice: unset, VTK first prints a warning about X.
            os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = window
            return
    missing = " or ".join(f"lib{GL_LIBRARIES[window]}" for window in candidates)
    raise MissingPackage(
        f"pictures need the OpenGL library {missing}, which is not installed; on Debian: "
        "apt-get install libegl1"
    )


def _import_pyvista() -> ModuleType:
    require_gl()
    # DOLFINx 0.5 to 0.7 leave RTLD_GLOBAL set; VTK loaded after that crashes on libstdc++ symbols.
    if "dolfinx" in sys.modules and sys.getdlopenflags() & os.RTLD_GLOBAL:
        raise MissingPackage(
            "dolfinx was imported before fem_seal could make it safe for VTK; put "
            "'import fem_seal.fenicsx' before the first 'import dolfinx'"
        )
    import pyvista

    return pyvista


Layer = Tiles | Triangles | Mesh


def draw(layers: Sequence[Layer], window: Window, long_side: int = LONG_SIDE) -> np.ndarray:
    """Draw layers, later ones over earlier ones, in parallel projection.

    Parameters
    ----------
    layers : sequence of Tiles, Triangles and Mesh
    window : Window
        The rectangle [m] that fills the picture exactly.
    long_side : int
        Length of the longer side [pixel].

    Returns
    -------
    (height, width, 3) uint8, first row at y = y1, first column at x = x0.

    Raises
    ------
    MissingPackage
        If no OpenGL library is installed.
    """
    vista = _import_pyvista()
    width, height = window.pixels(long_side)
    plotter = vista.Plotter(
        off_screen=True,
        window_size=(SUPERSAMPLING * width, SUPERSAMPLING * height),
        lighting="none",
    )
    try:
        plotter.set_background("white")
        for depth, layer in enumerate(layers):
            to_pixels = _Map(window, width, height, depth)
            _draw(vista, plotter, layer, to_pixels)
        plotter.camera_position = [
            (width / 2, height / 2, len(layers) + 10.0),
            (width / 2, height / 2, 0.0),
            (0.0, 1.0, 0.0),
        ]
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = height / 2
        plotter.reset_camera_clipping_range()
        fine = plotter.screenshot(return_img=True)
    finally:
        plotter.close()
    samples = fine.reshape(height, SUPERSAMPLING, width, SUPERSAMPLING, 3)
    return np.rint(samples.mean(axis=(1, 3))).astype(np.uint8)


@dataclass(frozen=True)
class _Map:
    """Map from metres in the window to pixels; the depth puts later layers in front."""

    window: Window
    width: int
    height: int
    depth: int

    def __call__(self, points: np.ndarray) -> np.ndarray:
        w = self.window
        x = (points[:, 0] - w.x0) / (w.x1 - w.x0) * self.width
        y = (points[:, 1] - w.y0) / (w.y1 - w.y0) * self.height
        return np.column_stack([x, y, np.full(len(points), float(self.depth))])


def _draw_tiles(
    vista: ModuleType, plotter: "pyvista.Plotter", tiles: Tiles, to_pixels: _Map
) -> None:
    e = tiles.extent
    corners = np.array([[e.x0, e.y0], [e.x1, e.y0], [e.x1, e.y1], [e.x0, e.y1]])
    plane = vista.PolyData(to_pixels(corners), faces=[4, 0, 1, 2, 3])
    plane.active_texture_coordinates = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    # A texture needs two triangles, cells would need millions. Rows of an image run downwards.
    texture = vista.Texture(np.ascontiguousarray(tiles.colours.transpose(1, 0, 2)[::-1]))
    texture.interpolate = False
    texture.mipmap = False
    plotter.add_mesh(plane, texture=texture, lighting=False)


def _draw_triangles(
    vista: ModuleType, plotter: "pyvista.Plotter", triangles: Triangles, to_pixels: _Map
) -> None:
    surface = vista.PolyData.from_regular_faces(
        to_pixels(triangles.points), np.asarray(triangles.cells)
    )
    scale = triangles.scale
    plotter.add_mesh(
        surface,
        scalars=np.asarray(triangles.values, dtype=float),
        clim=(scale.low, scale.high),
        cmap=colour_map(scale.colours),
        below_color=WHITE,
        log_scale=scale.logarithmic,
        interpolate_before_map=True,
        lighting=False,
        show_scalar_bar=False,
    )


def _draw_mesh(vista: ModuleType, plotter: "pyvista.Plotter", mesh: Mesh, to_pixels: _Map) -> None:
    surface = vista.PolyData.from_regular_faces(to_pixels(mesh.points), np.asarray(mesh.cells))
    plotter.add_mesh(
        surface,
        style="wireframe" if mesh.line else "surface",
        color=mesh.colour,
        line_width=SUPERSAMPLING * mesh.line or None,
        lighting=False,
    )


def _draw(vista: ModuleType, plotter: "pyvista.Plotter", layer: Layer, to_pixels: _Map) -> None:
    match layer:
        case Tiles():
            _draw_tiles(vista, plotter, layer, to_pixels)
        case Triangles():
            _draw_triangles(vista, plotter, layer, to_pixels)
        case Mesh():
            _draw_mesh(vista, plotter, layer, to_pixels)
