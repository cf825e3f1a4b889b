"""The fluid's pressure on the samples of the contact's grid: read from the flow, then continued.

The flow knows the pressure only where it flows. Under contact and in pockets the pressure is
continued smoothly between its values around them: the contact pressure is the excess over it, so
that contact opens where the total pressure falls below that of the fluid beside it.
"""

import numpy as np

from fem_seal.film import GridFilm
from fem_seal.leak_rate import FlowField

INSIDE = -1e-9  # least barycentric coordinate of a sample that counts as inside a triangle


def pressure_on_samples(
    film: GridFilm, inlet: float, outlet: float, flowing: np.ndarray | None
) -> np.ndarray:
    """Fluid pressure on the samples of a film's grid.

    That of the flow in the channels that join inlet and outlet; that of the end in what is joined
    to one end alone; continued under contact and in pockets.

    Parameters
    ----------
    film : GridFilm
        The film.
    inlet, outlet : float
        Pressures of the two ends [Pa].
    flowing : (mx, my) float or None
        Pressure of the flow at the film's samples [Pa], NaN where it is not known; None if the
        film is sealed.

    Returns
    -------
    (nx, ny) float [Pa], between the pressures of the ends
    """
    pressure = np.full(film.samples.shape, np.nan)
    pressure[film.joined_to("inlet")] = inlet
    pressure[film.joined_to("outlet")] = outlet
    if flowing is not None:
        carrying = film.carrying
        pressure[carrying] = flowing[carrying]
    # The rows at the two ends are open to the fluid there, whatever touches beside them.
    pressure[0], pressure[-1] = inlet, outlet
    nx, ny = film.gap.shape
    low, high = min(inlet, outlet), max(inlet, outlet)
    return np.clip(continued(pressure), low, high)[:nx, :ny]


def on_sites(field: FlowField, film: GridFilm) -> np.ndarray:
    """Pressure at the vertices or pixel centres of a film, NaN outside the triangles.

    Every triangle gives its linear pressure to the sites inside it. The sites that a triangle may
    hold are those of its bounding box, together about twice as many as all sites; triangles with
    boxes of equal size are computed together.

    Returns
    -------
    (mx, my) float [Pa]
    """
    shape = film.samples.shape
    pressure = np.full(shape, np.nan)
    points = (field.points - film.sites.origin) / film.sites.spacing
    corners = points[field.cells]
    first = np.ceil(corners.min(axis=1) - 1e-9).astype(np.int64)
    last = np.floor(corners.max(axis=1) + 1e-9).astype(np.int64)
    first, last = np.maximum(first, 0), np.minimum(last, np.array(shape) - 1)
    sizes = np.maximum(last - first + 1, 0)
    flat = pressure.ravel()
    a, b, c = np.moveaxis(corners, 1, 0)
    whole = _cross(b - a, c - a)
    at = field.pressure[field.cells]
    for size in np.unique(sizes[sizes.all(axis=1)], axis=0):
        rows, columns = size
        some = np.flatnonzero((sizes == size).all(axis=1))
        # The weight of a corner is linear over the box: its value at the first site, and slopes.
        weights = []
        for one, other in ((b, c), (c, a)):
            at_first = _cross(one[some] - first[some], other[some] - first[some])
            side = other[some] - one[some]
            along = np.arange(rows) * side[:, 1, None] * -1.0
            across = np.arange(columns) * side[:, 0, None]
            total = at_first[:, None, None] + along[:, :, None] + across[:, None, :]
            weights.append(total / whole[some, None, None])
        weight_a, weight_b = weights
        inside = (weight_a >= INSIDE) & (weight_b >= INSIDE)
        inside &= weight_a + weight_b <= 1 - INSIDE
        p_a, p_b, p_c = at[some].T[:, :, None, None]
        values = p_c + weight_a * (p_a - p_c) + weight_b * (p_b - p_c)
        i = first[some, 0, None, None] + np.arange(rows)[:, None]
        site = i * shape[1] + first[some, 1, None, None] + np.arange(columns)
        flat[site[inside]] = values[inside]
    return pressure


def continued(values: np.ndarray) -> np.ndarray:
    """Fill the NaN of an array by means of the values around them, from near to far.

    Grids of half the samples take the mean of the known values of each square of four, down to a
    grid that knows all its values; the unknown ones are read back from coarse to fine.
    """
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    padding = [(0, n % 2) for n in values.shape]
    squares = np.pad(values, padding, constant_values=np.nan)
    squares = squares.reshape(squares.shape[0] // 2, 2, squares.shape[1] // 2, 2)
    count = np.isfinite(squares).sum(axis=(1, 3))
    total = np.nansum(squares, axis=(1, 3))
    coarse = np.full(count.shape, np.nan)
    np.divide(total, count, out=coarse, where=count > 0)
    coarse = continued(coarse)
    fine = coarse.repeat(2, axis=0).repeat(2, axis=1)[: values.shape[0], : values.shape[1]]
    return np.where(known, values, _smoothed(fine, known, values))


def _smoothed(
    fine: np.ndarray, known: np.ndarray, values: np.ndarray, sweeps: int = 4
) -> np.ndarray:
    """Replace unknown values by the mean of their neighbours, a few times."""
    result = np.where(known, values, fine)
    for _ in range(sweeps):
        around = np.pad(result, 1, mode="edge")
        mean = (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]) / 4
        result = np.where(known, values, mean)
    return result


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
