"""The fluid's pressure on the samples of the contact's grid: read from the flow, then continued.

The flow has a pressure only where fluid flows. Under contact and in pockets it is continued
smoothly from the values around them. The contact pressure is the excess of the total pressure over
the fluid's: contact opens where the total pressure falls below that of the fluid beside it.
"""

import numpy as np

from fem_seal.film import GridFilm
from fem_seal.leak_rate import FlowField

INSIDE = -1e-9  # least barycentric coordinate of a sample that counts as inside a triangle


def pressure_on_samples(
    film: GridFilm, inlet: float, outlet: float, flowing: np.ndarray | None
) -> np.ndarray:
    """Fluid pressure on the samples of a film's grid.

    In channels, which join inlet and outlet, it is the pressure of the flow; in open regions joined
    to one end alone, the pressure of that end. Under contact and in pockets it is continued.

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
    # The first and the last row, in contact or not, have the pressure of the fluid outside.
    pressure[0], pressure[-1] = inlet, outlet
    nx, ny = film.gap.shape
    low, high = min(inlet, outlet), max(inlet, outlet)
    return np.clip(continued(pressure), low, high)[:nx, :ny]


def on_sites(field: FlowField, film: GridFilm) -> np.ndarray:
    """Pressure at the vertices or pixel centres of a film, NaN outside the triangles.

    A site at a vertex of the mesh has the pressure of the vertex. Every other site has the linear
    pressure of the triangle that contains it: each triangle is tested against the sites in its
    bounding box. Triangles whose boxes have the same size are computed together.

    Returns
    -------
    (mx, my) float [Pa]
    """
    shape = film.samples.shape
    pressure = np.full(shape, np.nan)
    flat = pressure.ravel()
    points = (field.points - film.sites.origin) / film.sites.spacing
    nearest = np.clip(np.rint(points).astype(np.int64), 0, np.array(shape) - 1)
    is_site = (np.abs(points - nearest) < 1e-9).all(axis=1)
    flat[np.ravel_multi_index(nearest[is_site].T, shape)] = field.pressure[is_site]

    corners = [points[column] for column in field.cells.T]
    low = np.minimum(np.minimum(corners[0], corners[1]), corners[2])
    high = np.maximum(np.maximum(corners[0], corners[1]), corners[2])
    first = np.maximum(np.ceil(low - 1e-9).astype(np.int64), 0)
    last = np.minimum(np.floor(high + 1e-9).astype(np.int64), np.array(shape) - 1)
    rows, columns = np.maximum(last - first + 1, 0).T
    # If the corners are sites and the box has two by two, no other site lies inside the triangle.
    done = (rows <= 2) & (columns <= 2) & is_site[field.cells].all(axis=1)
    box = np.where(done | (rows == 0) | (columns == 0), 0, rows * (shape[1] + 1) + columns)
    for kind in np.unique(box[box > 0]):
        triangles = np.flatnonzero(box == kind)
        i, j = (np.arange(size) for size in divmod(int(kind), shape[1] + 1))
        a, b, c = (corner[triangles] for corner in corners)
        whole = _cross(b - a, c - a)
        # The weight of a corner is linear over the box: its value at the first site, and slopes.
        weights = []
        for one, other in ((b, c), (c, a)):
            at_first = _cross(one - first[triangles], other - first[triangles]) / whole
            side = (other - one) / whole[:, None]
            down = at_first[:, None] - i * side[:, 1, None]
            across = j * side[:, 0, None]
            weights.append(down[:, :, None] + across[:, None, :])
        weight_a, weight_b = weights
        inside = (weight_a >= INSIDE) & (weight_b >= INSIDE) & (weight_a + weight_b <= 1 - INSIDE)
        p_a, p_b, p_c = field.pressure[field.cells[triangles]].T[:, :, None, None]
        values = p_c + weight_a * (p_a - p_c) + weight_b * (p_b - p_c)
        row, column = first[triangles, 0, None] + i, first[triangles, 1, None] + j
        site = row[:, :, None] * shape[1] + column[:, None, :]
        flat[site[inside]] = values[inside]
    return pressure


def continued(values: np.ndarray) -> np.ndarray:
    """Replace the NaN of an array by averages of the values around them, the nearest first.

    Each coarser grid holds the mean of the known values of every square of four samples, until all
    values of a grid are known. From coarse to fine, unknown values are then copied from the coarser
    grid and smoothed.
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
