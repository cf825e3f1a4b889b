"""Missing points of a measured map, filled from their neighbours."""

from collections.abc import Callable

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import FieldMap
from fem_seal.registry import require_known


def fill(heights: FieldMap, method: str, max_missing: float) -> FieldMap:
    """Fill the missing points (NaN) of a map, of which at most a part may be missing.

    Parameters
    ----------
    method : "harmonic": the heights of least gradient, like a soap film over each hole, with no
        slope across the border of the map; "linear": on the Delaunay triangles of the points around
        the holes
    """
    require_known(METHODS, method, "fill")
    missing = np.isnan(heights.values)
    fraction = missing.mean()
    if fraction == 1:
        raise InvalidInput(f"all {missing.size} points are missing")
    if fraction > max_missing:
        raise InvalidInput(
            f"{missing.sum()} of {missing.size} points are missing ({100 * fraction:.2g} %), more "
            f"than max_missing = {max_missing:g}; raise it, or crop to where there are points"
        )
    values = heights.values.copy()
    if fraction > 0:
        values[missing] = METHODS[method](values, missing, heights.spacing)
    return FieldMap(values, heights.spacing, heights.periodic)


def _harmonic(values: np.ndarray, missing: np.ndarray, spacing: tuple[float, float]) -> np.ndarray:
    """Solve Σ (h_q - h_p) / d_pq² = 0 over the neighbours q of each missing point p.

    Second differences are exact for cubic polynomials, so that harmonic ones up to the third degree
    are filled exactly. A neighbour beyond the border of the map does not count.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    number = np.full(values.shape, -1)
    number[missing] = np.arange(missing.sum())
    rows, columns, weights = [], [], []
    diagonal, right = np.zeros(missing.sum()), np.zeros(missing.sum())
    for axis, distance in enumerate(spacing):
        first = np.take(number, range(values.shape[axis] - 1), axis).ravel()
        second = np.take(number, range(1, values.shape[axis]), axis).ravel()
        h_first = np.take(values, range(values.shape[axis] - 1), axis).ravel()
        h_second = np.take(values, range(1, values.shape[axis]), axis).ravel()
        weight = (min(spacing) / distance) ** 2
        for here, there, h_there in ((first, second, h_second), (second, first, h_first)):
            inside = here >= 0
            np.add.at(diagonal, here[inside], weight)
            known = inside & (there < 0)
            np.add.at(right, here[known], weight * h_there[known])
            both = inside & (there >= 0)
            rows.append(here[both])
            columns.append(there[both])
            weights.append(np.full(both.sum(), -weight))
    unknowns = np.arange(len(diagonal))
    matrix = coo_matrix(
        (
            np.concatenate([*weights, diagonal]),
            (np.concatenate([*rows, unknowns]), np.concatenate([*columns, unknowns])),
        )
    )
    return spsolve(matrix.tocsc(), right, permc_spec="MMD_AT_PLUS_A")


def _linear(values: np.ndarray, missing: np.ndarray, spacing: tuple[float, float]) -> np.ndarray:
    from scipy.interpolate import LinearNDInterpolator
    from scipy.ndimage import binary_dilation
    from scipy.spatial import QhullError

    around = binary_dilation(missing, np.ones((3, 3))) & ~missing
    try:
        interpolant = LinearNDInterpolator(np.argwhere(around), values[around])
    except QhullError:
        raise InvalidInput(
            "the points around the holes span no triangle; use fill = 'harmonic'"
        ) from None
    filled = interpolant(np.argwhere(missing))
    outside = np.count_nonzero(np.isnan(filled))
    if outside:
        raise InvalidInput(
            f"{outside} missing points lie at the border, beyond all triangles; crop the map, or "
            "use fill = 'harmonic'"
        )
    return filled


Filler = Callable[[np.ndarray, np.ndarray, tuple[float, float]], np.ndarray]
METHODS: dict[str, Filler] = {"harmonic": _harmonic, "linear": _linear}
