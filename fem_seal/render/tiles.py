"""Grid samples as coloured tiles, painted into the pixels of a picture.

On large grids a tile is the mean of a block of samples. A pixel has the mean colour of the tiles in
it, weighted by their areas in the pixel.
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.film.lattice import Lattice
from fem_seal.render.colours import WHITE
from fem_seal.render.window import LONG_SIDE, Window


@dataclass(frozen=True, eq=False)
class Tiles:
    """Equal rectangles of one colour each that fill a window."""

    colours: np.ndarray  #: (nx, ny, 3) uint8, or (nx, ny, 4) with opacity
    extent: Window  #: the window [m]


def paint(
    tiles: Tiles, window: Window, long_side: int = LONG_SIDE, ground: np.ndarray | None = None
) -> np.ndarray:
    """Paint tiles into pixels.

    Parameters
    ----------
    window : the rectangle [m] that fills the picture exactly
    long_side : length of the longer side [pixel]
    ground : (height, width, 3) uint8, picture to paint on; white if left out

    Returns
    -------
    (height, width, 3) uint8, first row at y = y1, first column at x = x0.
    """
    width, height = window.pixels(long_side)
    nx, ny = tiles.colours.shape[:2]
    e = tiles.extent
    # Edges of the pixels, counted in tiles.
    x = (np.linspace(window.x0, window.x1, width + 1) - e.x0) / (e.x1 - e.x0) * nx
    y = (np.linspace(window.y0, window.y1, height + 1) - e.y0) / (e.y1 - e.y0) * ny
    opacity = np.ones((nx, ny)) if tiles.colours.shape[2] == 3 else tiles.colours[:, :, 3] / 255

    def covered(values: np.ndarray) -> np.ndarray:
        """For each pixel, sum over the tiles of value times the part of the pixel they cover."""
        return _means(_means(values, x, 0), y, 1).T[::-1]

    opaque = covered(opacity)
    if ground is None:
        ground = np.broadcast_to(np.array(WHITE, dtype=np.uint8), (height, width, 3))
    painted = np.empty((height, width, 3), dtype=np.uint8)
    for channel in range(3):
        colour = covered(opacity * tiles.colours[:, :, channel])
        painted[:, :, channel] = np.rint(colour + (1 - opaque) * ground[:, :, channel])
    return painted


def _means(values: np.ndarray, edges: np.ndarray, axis: int) -> np.ndarray:
    """Means between consecutive edges along an axis; values outside the array count as 0.

    The edges rise by equal steps, in units of the index: value k fills the interval from k to
    k + 1.
    """
    n = values.shape[axis]
    inside = np.clip(edges, 0, n)
    whole = np.minimum(inside.astype(np.int64), n - 1)
    sums = np.cumsum(values, axis=axis, dtype=float)
    zero = np.zeros_like(np.take(sums, [0], axis=axis))
    sums = np.concatenate([zero, sums], axis=axis)
    part = (inside - whole)[:, None] if axis == 0 else inside - whole
    at_edges = np.take(sums, whole, axis=axis) + part * np.take(values, whole, axis=axis)
    return np.diff(at_edges, axis=axis) * (len(edges) - 1) / (edges[-1] - edges[0])


@dataclass(frozen=True, eq=False)
class Mosaic:
    """The samples inside a window, and the block of samples of each tile."""

    sites: Lattice  #: sites of the gap
    samples: np.ndarray  #: (mx, my), gap at all samples [m]
    window: Window  #: part of the seal to show
    first: tuple[int, int]  #: first sample inside the window, along each axis
    last: tuple[int, int]  #: last sample inside + 1
    block: tuple[int, int]  #: samples per tile along each axis

    def crop(self, field: np.ndarray) -> np.ndarray:
        """Samples (kx, ky) of a field (mx, my) inside the window."""
        return field[self.first[0] : self.last[0], self.first[1] : self.last[1]]

    def mean(self, field: np.ndarray) -> np.ndarray:
        """Mean over the samples of each tile; the last tile of an axis may hold fewer.

        Parameters
        ----------
        field : (kx, ky), samples inside the window, from `crop`

        Returns
        -------
        (tiles along x, tiles along y) float
        """
        total, number = field, np.ones(1)
        for axis, block in enumerate(self.block):
            starts = np.arange(0, field.shape[axis], block)
            total = np.add.reduceat(total, starts, axis=axis, dtype=float)
            count = np.diff(np.append(starts, field.shape[axis]))
            number = number * (count[:, None] if axis == 0 else count)
        return total / number

    def tiles(self, colours: np.ndarray) -> Tiles:
        """Tiles of given colours, which are rounded.

        Parameters
        ----------
        colours : (tiles along x, tiles along y, 3 or 4), colours 0..255, the fourth number their
            opacity
        """
        (dx, dy), (ox, oy) = self.sites.spacing, self.sites.origin
        x0, y0 = ox + (self.first[0] - 0.5) * dx, oy + (self.first[1] - 0.5) * dy
        nx, ny = colours.shape[:2]
        extent = Window(x0, x0 + nx * self.block[0] * dx, y0, y0 + ny * self.block[1] * dy)
        return Tiles(np.rint(colours).astype(np.uint8), extent)

    def mean_colours(self, classes: np.ndarray, palette: np.ndarray) -> Tiles:
        """Tiles in the mean colour of their samples: this keeps the area fraction of each class.

        Parameters
        ----------
        classes : (mx, my) uint8, index of every sample in the palette
        palette : (k, 3) or (k, 4), colours 0..255, or colours with opacity
        """
        cropped = self.crop(classes)
        colours = sum(
            self.mean(cropped == k)[:, :, None] * np.asarray(colour, dtype=float)
            for k, colour in enumerate(palette)
        )
        return self.tiles(colours)


def mosaic(
    film: GridFilm,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
) -> Mosaic:
    """Choose the samples and the size of the blocks for a picture.

    Parameters
    ----------
    film : film on a grid
    window : part of the seal to show; all if left out
    long_side : length of the longer side of the picture in pixels
    """
    sites = film.sites
    samples = sites.on_samples(sites.gap)
    nx, ny = samples.shape
    whole = _rectangle(sites, (nx, ny))
    window = whole if window is None else window
    _check_inside(window, whole)
    first, last, block = [], [], []
    ends = ((window.x0, window.x1), (window.y0, window.y1))
    for axis, (low, high) in enumerate(ends):
        origin, d, n = sites.origin[axis], sites.spacing[axis], samples.shape[axis]
        # A sample covers half a spacing on both sides of it.
        i, j = np.floor((np.array([low, high]) - origin) / d + 0.5).astype(int)
        i, j = max(i, 0), min(j + 1, n)
        first.append(i)
        last.append(j)
        block.append(max(1, (j - i) // window.pixels(long_side)[axis]))
    return Mosaic(sites, samples, window, tuple(first), tuple(last), tuple(block))


def _rectangle(sites: Lattice, shape: tuple[int, int]) -> Window:
    """Rectangle of the seal; its samples are vertices (origin 0) or values of pixels."""
    pixels = sites.origin[0] > 0
    if not pixels and min(shape) < 2:
        raise InvalidInput(
            f"a gap of {shape[0]} x {shape[1]} vertices has no area to draw; with representation = "
            "'constant' each sample fills a pixel"
        )
    (dx, dy), (nx, ny) = sites.spacing, (n if pixels else n - 1 for n in shape)
    return Window(0.0, nx * dx, 0.0, ny * dy)


def _check_inside(window: Window, whole: Window) -> None:
    """Raise InvalidInput if a window extends beyond the whole rectangle by more than rounding."""
    rounding = 1e-9 * max(whole.x1, whole.y1)
    outside = max(
        whole.x0 - window.x0, window.x1 - whole.x1, whole.y0 - window.y0, window.y1 - whole.y1
    )
    if outside > rounding:
        raise InvalidInput(
            f"the window x {window.x0:g} to {window.x1:g}, y {window.y0:g} to {window.y1:g} m "
            f"leaves the seal, which is {whole.x1:g} by {whole.y1:g} m"
        )
