"""Missing points of a measured map, filled from their neighbours."""

import numpy as np

from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import FieldMap


def fill(heights: FieldMap, max_missing: float) -> FieldMap:
    """Fill the missing points (NaN) of a map, of which at most a part may be missing.

    They get the heights of least gradient, like a soap film over each hole, with no slope across
    the border of the map.
    """
    missing = np.isnan(heights.values)
    fraction = missing.mean()
    if fraction == 1:
        raise InvalidInput(f"all {missing.size} points are missing")
    if not fraction <= max_missing:
        raise InvalidInput(
            f"{missing.sum()} of {missing.size} points are missing ({per_cent(fraction)}), more "
            f"than max_missing = {max_missing:g}; raise it, or crop to where there are points"
        )
    values = heights.values.copy()
    if fraction > 0:
        values[missing] = _harmonic(values, missing, heights.spacing)
    return FieldMap(values, heights.spacing, heights.periodic)


def _harmonic(values: np.ndarray, missing: np.ndarray, spacing: tuple[float, float]) -> np.ndarray:
    """Solve Σ (h_q - h_p) / d_pq² = 0 over the neighbours q of each missing point p.

    Second differences are exact for cubic polynomials, so that harmonic ones up to the third degree
    are filled exactly. A neighbour beyond the border of the map does not count.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    index, hole = np.arange(values.size).reshape(values.shape), missing.ravel()
    pairs, roots = [], []
    for axis, distance in enumerate(spacing):
        ends = (np.take(index, range(k, values.shape[axis] - 1 + k), axis) for k in (0, 1))
        both = np.stack([end.ravel() for end in ends], axis=1)
        pairs.append(both[hole[both].any(axis=1)])
        roots.append(np.full(len(pairs[-1]), min(spacing) / distance))
    columns, root = np.concatenate(pairs), np.concatenate(roots)
    rows = np.repeat(np.arange(len(root)), 2)
    # Differences of neighbours over their distance, whose sum of squares is least in the solution.
    D = coo_matrix(
        (np.stack([-root, root], axis=1).ravel(), (rows, columns.ravel())),
        (len(root), values.size),
    ).tocsc()
    A, right = D[:, hole], -D[:, ~hole] @ values[~missing]
    return spsolve((A.T @ A).tocsc(), A.T @ right, permc_spec="MMD_AT_PLUS_A")
