"""Cells that join equipotential groups where the gap is too small for the flow.

All equipotential cells that touch have the same pressure. That is accurate if they share a vertex
of large gap. Groups that meet only at edges e and vertices v of small gap may differ in pressure.
They hardly do if either of these carries the leak rate Q, at a pressure drop of 1, with little of
that drop:

    Q / MAX_DROP <= Σ_e 1 / (R_e' + R_e")    or    Q / MAX_DROP <= Σ_v g_v³

R_e' and R_e" are the resistivities of the two cells at an edge, which the flow across it passes one
after the other, and a vertex of gap g conducts about g³. All other groups are wrongly joined, until
the cells at these vertices are refined so far that they are no longer equipotential.
"""

import numpy as np

from fem_seal.flow.level import LevelProblem
from fem_seal.graphs import components

MAX_DROP = 0.1  # largest pressure drop between groups that count as well joined


def wrongly_joined_cells(problem: LevelProblem, leak_rate: float) -> np.ndarray:
    """Cells (C,) bool of the film that carry flow and join such groups wrongly."""
    joined = np.zeros(problem.space.count, dtype=bool)
    equipotential = np.flatnonzero(problem.data.equipotential)
    if not len(equipotential) or not problem.values.shape[1]:
        return joined
    enough = leak_rate / MAX_DROP
    corners = problem.mesh.cells.compress(problem.kept, axis=0)[equipotential]
    high = problem.values[corners, 0] >= problem.gap.ceiling
    at_high = high.any(axis=1)
    equipotential, corners, high = equipotential[at_high], corners[at_high], high[at_high]
    vertex, cell = problem.mesh.twin[corners], np.nonzero(high)[0]
    count = len(problem.mesh.xy)
    pairs = np.stack([vertex[high], count + cell], axis=1)
    group = components(pairs, count + len(equipotential))[count:]
    group = _joined_by_edges(problem, equipotential, high, group, enough)[group]
    # Cells on both sides of a contact line have different unknowns and are not joined.
    pressure = problem.primal_numbering.of_corner - problem.primal_numbering.offset
    key = np.stack([vertex[~high], pressure[equipotential][~high]])
    point, place = np.unique(key, axis=1, return_inverse=True)
    place, low = place.ravel(), np.nonzero(~high)[0]
    least, most = np.full((2, point.shape[1]), len(group) + count) * [[1], [-1]]
    np.minimum.at(least, place, group[low])
    np.maximum.at(most, place, group[low])
    joint = np.flatnonzero(least < most)
    ends, pair = np.unique(np.stack([least, most])[:, joint], axis=1, return_inverse=True)
    cubes = problem.values[point[0, joint], 0] ** 3
    conductance = np.bincount(pair.ravel(), cubes, ends.shape[1])
    resists = np.zeros(len(least), dtype=bool)
    resists[joint] = (conductance < enough)[pair.ravel()]
    joined[equipotential[low[resists[place]]]] = True
    return joined


def _joined_by_edges(
    problem: LevelProblem, cells: np.ndarray, high: np.ndarray, group: np.ndarray, enough: float
) -> np.ndarray:
    """Number of each group (n,), equal for groups that edges of small gap join well enough.

    A blocked cell is partly in contact and lets no flow pass. `high` (n, 3) are the vertices of
    large gap.
    """
    count = int(group.max(initial=-1)) + 1
    at_edge = np.flatnonzero(high.sum(axis=1) == 1)
    side = problem.mesh.edges.of_cell.compress(problem.kept, axis=0)[cells[at_edge]][high[at_edge]]
    order = np.argsort(side, kind="stable")
    twice = np.flatnonzero(np.diff(side[order]) == 0)
    first, second = at_edge[order[twice]], at_edge[order[twice + 1]]
    blocked = problem.data.blocked[cells]
    resistivity = np.where(blocked, np.inf, problem.data.resistivity[cells, 0])
    conductance = 1 / (resistivity[first] + resistivity[second])
    ends = np.sort(np.stack([group[first], group[second]]), axis=0)
    ends, pair = np.unique(ends, axis=1, return_inverse=True)
    well = np.bincount(pair.ravel(), conductance, ends.shape[1]) >= enough
    return components(ends[:, well].T, count)
