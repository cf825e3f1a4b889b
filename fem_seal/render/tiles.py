"""Grid samples as coloured tiles, thinned by block means so that no grid is too large to draw."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.render.offscreen import LONG_SIDE, Tiles, Window
from fem_seal.topology.lattice import Lattice, lattice


@dataclass(frozen=True, eq=False)
class Mosaic:
    """Which samples a window shows and how many of them make one tile.

    sites : the gap with its neighbourhood; samples : gap on all sites, (mx, my) [m]
    window : what is seen; first, last : half-open index ranges along each axis
    block : samples per tile along each axis
    """

    sites: Lattice
    samples: np.ndarray
    window: Window
    first: tuple[int, int]
    last: tuple[int, int]
    block: tuple[int, int]

    def crop(self, field: np.ndarray) -> np.ndarray:
        """Give the samples seen, (kx, ky)."""
        return field[self.first[0] : self.last[0], self.first[1] : self.last[1]]

    def mean(self, field: np.ndarray) -> np.ndarray:
        """Mean over the samples of each tile; the last tile of an axis may hold fewer.

        Parameters
        ----------
        field : (kx, ky) from `crop`

        Returns
        -------
        (tiles along x, tiles along y) float
        """
        total, number = field, 1.0
        for axis, block in enumerate(self.block):
            starts = np.arange(0, field.shape[axis], block)
            total = np.add.reduceat(total, starts, axis=axis, dtype=float)
            held = np.diff(np.append(starts, field.shape[axis]))
            number = number * (held[:, None] if axis == 0 else held)
        return total / number

    def tiles(self, colours: np.ndarray) -> Tiles:
        """Place tile colours (tiles along x, tiles along y, 3 or 4), 0..255, on the seal."""
        (dx, dy), (ox, oy) = self.sites.spacing, self.sites.origin
        x0, y0 = ox + (self.first[0] - 0.5) * dx, oy + (self.first[1] - 0.5) * dy
        nx, ny = colours.shape[:2]
        extent = Window(x0, x0 + nx * self.block[0] * dx, y0, y0 + ny * self.block[1] * dy)
        return Tiles(np.rint(colours).astype(np.uint8), extent)

    def shares(self, classes: np.ndarray, palette: np.ndarray) -> Tiles:
        """Colour each tile by the mean colour of its samples, so that areas keep their share.

        Parameters
        ----------
        classes : (mx, my) uint8, index into the palette
        palette : (k, 3) colours, or (k, 4) with opacity; 0..255
        """
        seen = self.crop(classes)
        colours = sum(
            self.mean(seen == k)[:, :, None] * np.asarray(colour, dtype=float)
            for k, colour in enumerate(palette)
        )
        return self.tiles(colours)


def mosaic(
    gap: GridField,
    sides: str,
    representation: str,
    window: Window | None = None,
    long_side: int = LONG_SIDE,
) -> Mosaic:
    """Choose the samples and the blocks that fill a picture.

    Parameters
    ----------
    gap : gap [m]
    sides, representation : as in `fem_seal.topology.lattice`
    window : part of the seal to show; None shows all
    long_side : pixels of the longer side

    Raises
    ------
    InvalidInput
        If the gap has no area as represented, or the window lies outside it.
    """
    sites = lattice(gap, sides, representation)
    samples = sites.on_samples(sites.gap)
    whole = _rectangle(sites, samples.shape)
    window = whole if window is None else window
    _check_inside(window, whole)
    first, last, block = [], [], []
    ends = ((window.x0, window.x1), (window.y0, window.y1))
    for axis, (low, high) in enumerate(ends):
        origin, d, n = sites.origin[axis], sites.spacing[axis], samples.shape[axis]
        # A tile reaches half a spacing to both sides of its sample.
        i, j = np.floor((np.array([low, high]) - origin) / d + 0.5).astype(int)
        i, j = max(i, 0), min(j + 1, n)
        first.append(i)
        last.append(j)
        block.append(max(1, (j - i) // window.pixels(long_side)[axis]))
    return Mosaic(sites, samples, window, tuple(first), tuple(last), tuple(block))


def _rectangle(sites: Lattice, shape: tuple[int, int]) -> Window:
    """Rectangle of the seal: samples are its vertices (origin 0) or fill pixels of it."""
    filled = sites.origin[0] > 0
    if not filled and min(shape) < 2:
        raise InvalidInput(
            f"a gap of {shape[0]} x {shape[1]} vertices has no area to draw; with representation = "
            "'constant' each sample fills a pixel"
        )
    (dx, dy), (nx, ny) = sites.spacing, (n if filled else n - 1 for n in shape)
    return Window(0.0, nx * dx, 0.0, ny * dy)


def _check_inside(window: Window, whole: Window) -> None:
    slack = 1e-9 * max(whole.x1, whole.y1)
    outside = max(
        whole.x0 - window.x0, window.x1 - whole.x1, whole.y0 - window.y0, window.y1 - whole.y1
    )
    if outside > slack:
        raise InvalidInput(
            f"the window x {window.x0:g} to {window.x1:g}, y {window.y0:g} to {window.y1:g} m "
            f"leaves the seal, which is {whole.x1:g} by {whole.y1:g} m"
        )
