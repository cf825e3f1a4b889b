"""Newest-vertex bisection on arrays: refinement that never leaves the nested family.

A triangle is only ever cut from its first corner to the middle of the side opposite, in the nested
family from the right angle to the hypotenuse (Mitchell, ACM Trans. Math. Softw. 15, 326 (1989)). A
cell with a cut side must be cut at its first side as well; no edge is marked twice, so this ends.

Meshes grow little from level to level: cells that are not cut are copied once and never searched.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.mesh.edges import Edges
from fem_seal.mesh.halvings import Halvings
from fem_seal.mesh.nested import NestedMesh, TooFine
from fem_seal.mesh.triangles import TriangleMesh

__all__ = ["Refinement", "TooFine", "bisect", "refine"]


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined mesh and where it came from.

    mesh : the finer mesh; its first vertices are those of the coarser one
    halvings : what became of the coarse cells
    rounds : of each (n, 2) int32, the older vertices each of its new ones lies midway between
    """

    mesh: NestedMesh | TriangleMesh
    halvings: Halvings
    rounds: tuple[np.ndarray, ...]

    @property
    def parent(self) -> np.ndarray:
        """(C',) int32, the coarse cell each fine cell lies in."""
        return self.halvings.parent

    @property
    def edge_ends(self) -> np.ndarray:
        """(V' - V, 2) int32, the vertices each new one lies midway between; coarse in one round."""
        return np.concatenate([np.empty((0, 2), dtype=np.int32), *self.rounds])

    def by_rounds(self) -> Iterator[tuple[NestedMesh | TriangleMesh, np.ndarray]]:
        """Round by round the mesh with the vertices so far, and what its last ones lie between."""
        count = len(self.mesh.xy) - sum(map(len, self.rounds))
        for ends in self.rounds:
            count += len(ends)
            yield replace(self.mesh, xy=self.mesh.xy[:count]), ends

    def prolong(self, corner_values: np.ndarray) -> np.ndarray:
        """Carry corner values (C, 3) of a function linear on each coarse cell to (C', 3)."""
        return self.halvings.carried(corner_values, _linear)

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        """Carry values (V, ...) at the coarse vertices to (V', ...): linear on each edge."""
        for ends in self.rounds:
            a, b = ends.T
            values = np.concatenate([values, (values[a] + values[b]) / 2])
        return values


def _linear(corner_values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = corner_values.T
    middle = (b + c) / 2
    return np.stack([middle, a, b], axis=1), np.stack([middle, c, a], axis=1)


def bisect(mesh: NestedMesh | TriangleMesh, marked: np.ndarray) -> Refinement:
    """Halve the marked triangles (C,) bool once; see `refine`."""
    return refine(mesh, marked.astype(np.int8))


def refine(mesh: NestedMesh | TriangleMesh, times: np.ndarray) -> Refinement:
    """Halve triangles, and those that must follow for the mesh to stay conforming.

    Parameters
    ----------
    mesh : of the nested family, or of any triangles
    times : (C,) int, how often to halve each triangle at least, and all parts of it

    Raises
    ------
    TooFine
        If a triangle would become narrower than the integer coordinates can hold.
    """
    growing = _Growing(mesh)
    while times.any():
        steps = growing.bisect(np.flatnonzero(times))
        new = sum(len(second) for _, second in steps)
        times = np.concatenate([times, np.zeros(new, dtype=times.dtype)])
        for cut, second in steps:
            times[second] = times[cut]
        times = np.maximum(times - 1, 0)
    return growing.refinement()


@dataclass(frozen=True, eq=False)
class _Cut:
    """Edges (n,) that are cut in one round.

    place : (E,) int32, of each edge among those that are cut, -1 of others
    ends : (n, 2), vertices they lay between
    middle : (n,), vertices in their middles
    second : (n,), edges from the middle to the second end; those to the first keep their numbers
    """

    place: np.ndarray
    ends: np.ndarray
    middle: np.ndarray
    second: np.ndarray


class _Growing:
    """A mesh while it is bisected: first halves take the place of their parents, others follow."""

    def __init__(self, mesh: NestedMesh | TriangleMesh):
        self._mesh, self._xy, self._twin = mesh, mesh.xy, mesh.twin
        self._cells, edges = mesh.cells.copy(), mesh.numbered_edges
        self._sides, self._ends = edges.sides.copy(), edges.ends.copy()
        self._cell_of_side = edges.cells()
        self._rounds: list[np.ndarray] = []
        self._steps: list[tuple[np.ndarray, np.ndarray]] = []

    def refinement(self) -> Refinement:
        """The mesh as it is now."""
        halvings = Halvings.of(self._steps, len(self._mesh.cells))
        cells, sides = (rows.take(halvings.order, axis=0) for rows in (self._cells, self._sides))
        edges = Edges(self._ends, sides)
        fine = self._mesh.halved(self._xy, cells, self._twin, edges, halvings)
        return Refinement(fine, halvings, tuple(self._rounds))

    def bisect(self, marked: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Halve some cells (indices) and those that must follow.

        Returns
        -------
        The steps it took, as of `Halvings`
        """
        edges, before = self._closure(marked), len(self._steps)
        cut = self._split(edges)
        # All cells at these edges are cut at their hypotenuses, and halves of some at theirs.
        both = np.concatenate([2 * edges, 2 * edges + 1])
        near = self._cell_of_side[both]
        halved = near[(near >= 0) & (self._sides[near, 0] == both)]
        second = self._halve(halved, cut)
        children = np.concatenate([halved, second])
        again = children[cut.place[self._sides[children, 0] >> 1] >= 0]
        changed = np.concatenate([children, self._halve(again, cut)])
        new = np.full(2 * len(self._ends) - len(self._cell_of_side), -1, dtype=np.int32)
        self._cell_of_side = np.concatenate([self._cell_of_side, new])
        self._cell_of_side[self._sides[changed]] = changed[:, None]
        return self._steps[before:]

    def _closure(self, marked: np.ndarray) -> np.ndarray:
        """Edges to cut so that no triangle is cut on a leg but not on its hypotenuse."""
        cut = np.zeros(len(self._ends), dtype=bool)
        front = self._sides[marked, 0] >> 1
        while len(front):
            cut[front] = True
            near = self._cell_of_side.reshape(-1, 2)[front].ravel()
            follow = self._sides[near[near >= 0], 0] >> 1
            front = follow[~cut[follow]]
        return np.flatnonzero(cut).astype(np.int32)

    def _split(self, edges: np.ndarray) -> _Cut:
        """Cut edges (n,) in their middles."""
        count, ends = len(self._ends), self._ends.take(edges, axis=0)
        place = np.full(count, -1, dtype=np.int32)
        place[edges] = np.arange(len(edges), dtype=np.int32)
        self._rounds.append(np.empty((0, 2), dtype=np.int32))
        middle = self._add_vertices(ends)
        self._ends[edges, 1] = middle
        self._ends = np.concatenate([self._ends, np.stack([ends[:, 1], middle], axis=1)])
        return _Cut(place, ends, middle, np.arange(count, len(self._ends), dtype=np.int32))

    def _add_vertices(self, ends: np.ndarray, twin: np.ndarray | None = None) -> np.ndarray:
        """Number the middles of edges between `ends` (n, 2); without `twin` each is its own."""
        count = len(self._xy)
        number = np.arange(count, count + len(ends), dtype=np.int32)
        self._rounds[-1] = np.concatenate([self._rounds[-1], ends])
        self._xy = np.concatenate([self._xy, self._mesh.midpoints(self._xy, ends)])
        self._twin = np.concatenate([self._twin, number if twin is None else twin])
        return number

    def _halve(self, which: np.ndarray, cut: _Cut) -> np.ndarray:
        """Halve cells (n,) with a middle on the hypotenuse; gives the numbers of second halves."""
        a, b, c = self._cells.take(which, axis=0).T
        hypotenuse, side_b, side_c = self._sides.take(which, axis=0).T
        k = cut.place[hypotenuse >> 1]
        middle, (start, end) = cut.middle[k], cut.ends.take(k, axis=0).T
        at_b = b
        if self._mesh.periodic:
            # Only a side at the top has other vertices than its edge: their twins.
            top = (b != start) & (b != end)
            at_b = np.where(top, self._twin[b], b)
            middle[top] = self._add_vertices(np.stack([b, c], axis=1)[top], middle[top])
        # Of both halves of the hypotenuse, the one that keeps the number is that at its start.
        keeps, takes = hypotenuse, 2 * cut.second[k] + (hypotenuse & 1)
        half_b = np.where(at_b == start, keeps, takes)
        half_c = keeps + takes - half_b
        inner = 2 * np.arange(len(self._ends), len(self._ends) + len(which), dtype=np.int32)
        second = np.arange(len(self._cells), len(self._cells) + len(which), dtype=np.int32)
        self._cells[which] = np.stack([middle, a, b], axis=1)
        self._cells = np.concatenate([self._cells, np.stack([middle, c, a], axis=1)])
        self._sides[which] = np.stack([side_c, half_b, inner], axis=1)
        new = np.stack([side_b, inner + 1, half_c], axis=1)
        self._sides = np.concatenate([self._sides, new])
        self._ends = np.concatenate([self._ends, np.stack([a, middle], axis=1)])
        self._steps.append((which, second))
        return second
