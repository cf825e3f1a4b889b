"""Components of graphs."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


def components(pairs: np.ndarray, count: int) -> np.ndarray:
    """Component number (count,) of each node of the graph with edges `pairs` (n, 2)."""
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), tuple(pairs.T)), shape=(count, count))
    # Flag the matrix as canonical: SciPy then skips a sort that connected_components does not need.
    graph.has_canonical_format = True
    return connected_components(graph, directed=False)[1]
