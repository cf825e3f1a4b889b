"""Grid samples as coloured tiles; on large grids a tile is the mean of a block of samples."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film.grid_film import GridFilm
from fem_seal.film.lattice import Lattice
from fem_seal.render.offscreen import LONG_SIDE, Tiles, Window


@dataclass(frozen=True, eq=False)
class Mosaic:
    """The samples inside a window, and the blocks of samples that make one tile.

    Attributes
    ----------
    sites : Lattice
        Sites of the gap.
    samples : (mx, my) float
        Gap at all samples [m].
    window : Window
        Part of the seal to show.
    first, last : (int, int)
        First sample inside the window and last sample + 1, along each axis.
    block : (int, int)
        Samples per tile along each axis.
    """

    sites: Lattice
    samples: np.ndarray
    window: Window
    first: tuple[int, int]
    last: tuple[int, int]
    block: tuple[int, int]

    def crop(self, field: np.ndarray) -> np.ndarray:
        """Samples (kx, ky) inside the window of a field (mx, my)."""
        return field[self.first[0] : self.last[0], self.first[1] : self.last[1]]

    def mean(self, field: np.ndarray) -> np.ndarray:
        """Mean over the samples of each tile; the last tile of an axis may hold fewer.

        Parameters
        ----------
        field : (kx, ky) float
            From `crop`.

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
        """Tiles of colours (tiles along x, tiles along y, 3 or 4), 0..255, at their position."""
        (dx, dy), (ox, oy) = self.sites.spacing, self.sites.origin
        x0, y0 = ox + (self.first[0] - 0.5) * dx, oy + (self.first[1] - 0.5) * dy
        nx, ny = colours.shape[:2]
        extent = Window(x0, x0 + nx * self.block[0] * dx, y0, y0 + ny * self.block[1] * dy)
        return Tiles(np.rint(colours).astype(np.uint8), extent)

    def mean_colours(self, classes: np.ndarray, palette: np.ndarray) -> Tiles:
        """Tiles in the mean colour of their samples, which keeps the area fraction of each class.

        Parameters
        ----------
        classes : (mx, my) uint8
            Index of every sample in the palette.
        palette : (k, 3) or (k, 4)
            Colours 0..255, or colours with opacity.

        Returns
        -------
        Tiles
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
    """Choose the samples and the blocks that fill a picture.

    Parameters
    ----------
    film : GridFilm
        Film on a grid.
    window : Window, optional
        Part of the seal to show; all if left out.
    long_side : int
        Length of the longer side of the picture in pixels.

    Returns
    -------
    Mosaic

    Raises
    ------
    InvalidInput
        If a linear gap has a single row or column, or the window extends beyond the seal.
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
    """Rectangle of the seal, whose samples are vertices (origin 0) or fill pixels."""
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
