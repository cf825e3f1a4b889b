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
    wrong = np.zeros(problem.space.count, dtype=bool)
    cells = np.flatnonzero(problem.data.equipotential)
    if not len(cells) or not problem.values.shape[1]:
        return wrong
    enough = leak_rate / MAX_DROP
    corners = problem.mesh.cells.compress(problem.kept, axis=0)[cells]
    high = problem.values[corners, 0] >= problem.gap.ceiling
    at_high = high.any(axis=1)
    cells, corners, high = cells[at_high], corners[at_high], high[at_high]
    vertex = problem.mesh.twin[corners]
    group = _joined_by_vertices(vertex, high, len(problem.mesh.xy))
    group = _joined_by_edges(problem, cells, high, group, enough)[group]
    # Groups meet at their vertices of small gap: cells on both sides of a contact line do not, as
    # their pressures there are different unknowns.
    low, _ = np.nonzero(~high)
    pressure = problem.primal_numbering.of_corner - problem.primal_numbering.offset
    key = np.stack([vertex[~high], pressure[cells][~high]])
    point, place = np.unique(key, axis=1, return_inverse=True)
    place, conductance = place.ravel(), problem.values[point[0], 0] ** 3
    apart = _held_apart(group[low], place, conductance, enough)
    wrong[cells[low[apart[place]]]] = True
    return wrong


def _joined_by_vertices(vertex: np.ndarray, high: np.ndarray, count: int) -> np.ndarray:
    """Number of the group of each cell (n,): cells that share a vertex of large gap are in one.

    `vertex` (n, 3) are the corners, of `count` vertices, and `high` (n, 3) those of large gap.
    """
    cell, _ = np.nonzero(high)
    pairs = np.stack([vertex[high], count + cell], axis=1)
    return components(pairs, count + len(vertex))[count:]


def _held_apart(
    group: np.ndarray, place: np.ndarray, conductance: np.ndarray, enough: float
) -> np.ndarray:
    """Points (m,) bool where two groups meet that conduct too little at all such points.

    `group` (n,) and `place` (n,) say which groups are at which point, `conductance` (m,) what a
    point conducts. Of three or more groups at a point the first and the last count.
    """
    least, most = np.full((2, len(conductance)), [[group.max(initial=-1) + 1], [-1]])
    np.minimum.at(least, place, group)
    np.maximum.at(most, place, group)
    joint = np.flatnonzero(least < most)
    between = _summed_by_pair(np.stack([least, most])[:, joint], conductance[joint])
    apart = np.zeros(len(conductance), dtype=bool)
    apart[joint] = between < enough
    return apart


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
    well = _summed_by_pair(ends, conductance) >= enough
    return components(ends[:, well].T, count)


def _summed_by_pair(groups: np.ndarray, conductance: np.ndarray) -> np.ndarray:
    """For each of n joints between two groups (2, n), what all joints of the same two conduct."""
    _, pair = np.unique(groups, axis=1, return_inverse=True)
    return np.bincount(pair.ravel(), conductance)[pair.ravel()]
