"""Newest-vertex bisection on arrays: refinement that never leaves the nested family.

A triangle is halved by a cut from its first corner a to the middle m of the opposite edge,

    (a, b, c)  ->  (m, a, b) and (m, c, a),    m = (b + c)/2,

in the nested family from the right angle to the middle of the hypotenuse (W. F. Mitchell, ACM
Trans. Math. Softw. 15, 326 (1989)). The mesh stays conforming because a triangle with any cut edge
is cut at its edge b-c as well. This closure ends, since it marks every edge at most once.

A level adds few cells to a large mesh: cells that are not cut are copied once and never searched.
In meshes of other triangles, too, the code calls the edge b-c the "hypotenuse".
"""

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from fem_seal.mesh.mesh import INSIDE, Edges, Halvings
from fem_seal.mesh.nested import (
    PIXEL,
    NestedMesh,
    covering,
    opposite,
    rectangle_sides,
    uniform_mesh,
)
from fem_seal.mesh.triangles import TriangleMesh

MOST_HALVINGS = 4  # of a triangle by `times_halved`
AnyMesh = NestedMesh | TriangleMesh  # the meshes that bisection refines
M = TypeVar("M", bound=AnyMesh)


@dataclass(frozen=True, eq=False)
class Refinement(Generic[M]):
    """A refined mesh and its relation to the coarser one."""

    mesh: M  #: the finer mesh, of V' vertices; the first V are those of the coarser one
    halvings: Halvings  #: the cells that were halved, and their halves
    #: (n, 2) int32, for each round of bisection and each vertex that it added, the two
    #: older vertices between which the new one lies half-way
    rounds: tuple[np.ndarray, ...]

    def prolong(self, corner_values: np.ndarray) -> np.ndarray:
        """Corner values (C', 3) of a function with corner values (C, 3), linear on coarse cells."""
        return self.halvings.carried(corner_values, _linear)

    def at_vertices(self, values: np.ndarray) -> np.ndarray:
        """Values (V', ...) at all vertices from those (V, ...) at coarse ones, linear on edges."""
        for ends in self.rounds:
            a, b = ends.T
            values = np.concatenate([values, (values[a] + values[b]) / 2])
        return values


def _linear(corner_values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corner values (n, 3) of the first and of the second halves of cells."""
    a, b, c = corner_values.T
    middle = (b + c) / 2
    return np.stack([middle, a, b], axis=1), np.stack([middle, c, a], axis=1)


def _halved_labels(sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Labels (n, 3) of the sides of the first and of the second halves of cells.

    Each half has one side of its parent, half of the side that was cut, and the new inner side.
    """
    cut, b, c = sides.T
    inside = np.full_like(cut, INSIDE)
    return np.stack([c, cut, inside], axis=1), np.stack([b, inside, cut], axis=1)


def bisect(mesh: M, marked: np.ndarray) -> Refinement[M]:
    """Halve the marked triangles (C,) bool once; see `refine`."""
    return refine(mesh, marked.astype(np.int8))


def refine(mesh: M, times: np.ndarray) -> Refinement[M]:
    """Halve triangles (C,) so many times, and as many others as keep the mesh conforming.

    TooFine if a triangle would become narrower than its coordinates can resolve.
    """
    bisection = _Bisection(mesh)
    while times.any():
        steps = bisection.bisect(np.flatnonzero(times))
        new = sum(len(second) for _, second in steps)
        times = np.concatenate([times, np.zeros(new, dtype=times.dtype)])
        for cut, second in steps:
            times[second] = times[cut]
        times = np.maximum(times - 1, 0)
    return bisection.refinement()


def doerfler(indicators: np.ndarray, theta: float) -> np.ndarray:
    """The fewest cells (C,) bool that hold a part `theta` of the sum of indicators (Dörfler 1996).

    At least one cell is marked if any indicator is positive. Rounding may have made some negative.
    """
    marked = np.zeros(len(indicators), dtype=bool)
    total = indicators.sum(where=indicators > 0)
    # Cells below 1 - θ of the mean hold less than 1 - θ of the sum, so only the others need
    # sorting.
    candidates = np.flatnonzero(indicators > (1 - theta) * total / max(len(indicators), 1))
    # A stable sort, so that all processes of a run mark the same cells.
    order = candidates[np.argsort(-indicators[candidates], kind="stable")]
    enough = np.searchsorted(np.cumsum(indicators[order]), theta * total)
    marked[order[: enough + 1]] = True
    return marked


def times_halved(indicators: np.ndarray, marked: np.ndarray) -> np.ndarray:
    """How often to halve each cell (C,) before the next solve; 0 if it is not marked.

    Where the solution is smooth, half a cell has a quarter of its indicator. A cell with 4^k times
    the smallest marked indicator would be marked k more times, and is halved k times at once. This
    gains most at singular corners, where the indicators fall more slowly.
    """
    times = marked.astype(int)
    if marked.any():
        ratio = np.log(indicators[marked] / indicators[marked].min()) / np.log(4)
        times[marked] = np.clip(np.floor(ratio), 1, MOST_HALVINGS)
    return times


def coarse_mesh(pixels: tuple[int, int], width: int, periodic_sides: bool) -> NestedMesh:
    """Mesh of squares `width` pixels wide, a power of two, on any rectangle of (mx, my) pixels.

    Where such squares do not fill it, those that cover it are bisected down to pixels along all
    its sides, so that none reaches beyond them and opposite sides are alike.
    """
    whole = covering(pixels, width)
    if whole == pixels:
        return uniform_mesh(pixels, width, periodic_sides)
    mesh, end = uniform_mesh(whole, width, periodic_sides=False), np.array(pixels) * PIXEL
    while True:
        corners = mesh.xy[mesh.cells]
        low, high = corners.min(axis=1), corners.max(axis=1)
        inside = (low < end).all(axis=1)
        at_side = ((low == 0) | (high >= end)).any(axis=1)
        wide = inside & at_side & ((high - low).max(axis=1) > PIXEL)
        if not wide.any():
            break
        mesh = bisect(mesh, wide).mesh
    used, cells = np.unique(mesh.cells[inside], return_inverse=True)
    cells = cells.reshape(-1, 3).astype(np.int32)
    xy, twin = mesh.xy[used], np.arange(len(used), dtype=np.int32)
    mesh = NestedMesh(xy, cells, rectangle_sides(xy, cells), twin, pixels)
    return replace(mesh, twin=opposite(mesh, axis=1)) if periodic_sides else mesh


@dataclass(frozen=True, eq=False)
class _Cut:
    """The n edges that are cut in one round.

    The half of an edge from its first end to the middle keeps the number of the edge.
    """

    #: (E,) int32, for each edge of the mesh its index among the cut edges, -1 if it is not cut
    index: np.ndarray
    ends: np.ndarray  #: (n, 2) int32, vertices at the ends of the cut edges
    middle: np.ndarray  #: (n,) int32, vertices in their middles
    second: np.ndarray  #: (n,) int32, numbers of the halves from the middle to the second end


class _Bisection(Generic[M]):
    """A mesh while it is bisected: a first half replaces its parent, a second half is appended."""

    def __init__(self, mesh: M):
        self._mesh, self._xy, self._twin = mesh, mesh.xy, mesh.twin
        self._cells, edges = mesh.cells.copy(), mesh.edges
        self._sides, self._ends = edges.sides.copy(), edges.ends.copy()
        # -1 for the outer side of a boundary edge.
        self._cell_of_side = edges.slots().ravel() // 3
        self._rounds: list[np.ndarray] = []
        self._steps: list[tuple[np.ndarray, np.ndarray]] = []

    def refinement(self) -> Refinement[M]:
        """The mesh in its present state, with the cells in the order of their parents."""
        halvings = Halvings.of(self._steps, len(self._mesh.cells))
        cells, sides = (rows.take(halvings.order, axis=0) for rows in (self._cells, self._sides))
        edges = Edges(self._ends, sides)
        fine = replace(
            self._mesh,
            xy=self._xy,
            cells=cells,
            sides=halvings.carried(self._mesh.sides, _halved_labels),
            twin=self._twin,
            carried_edges=edges,
        )
        return Refinement(fine, halvings, tuple(self._rounds))

    def bisect(self, marked: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Halve the marked cells (indices), and the others that keep the mesh conforming.

        Returns the steps of this round, as in `Halvings.steps`.
        """
        edges, before = self._closure(marked), len(self._steps)
        cut = self._split(edges)
        # Halve all cells whose hypotenuse is cut, and then those halves whose hypotenuse is cut
        # too.
        sides = np.concatenate([2 * edges, 2 * edges + 1])
        adjacent = self._cell_of_side[sides]
        halved = adjacent[(adjacent >= 0) & (self._sides[adjacent, 0] == sides)]
        second = self._halve(halved, cut)
        children = np.concatenate([halved, second])
        again = children[cut.index[self._sides[children, 0] >> 1] >= 0]
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
            adjacent = self._cell_of_side.reshape(-1, 2)[front].ravel()
            hypotenuses = self._sides[adjacent[adjacent >= 0], 0] >> 1
            front = hypotenuses[~cut[hypotenuses]]
        return np.flatnonzero(cut).astype(np.int32)

    def _split(self, edges: np.ndarray) -> _Cut:
        """Cut edges (n,) in their middles."""
        count, ends = len(self._ends), self._ends.take(edges, axis=0)
        index = np.full(count, -1, dtype=np.int32)
        index[edges] = np.arange(len(edges), dtype=np.int32)
        self._rounds.append(np.empty((0, 2), dtype=np.int32))
        middle = self._add_vertices(ends)
        self._ends[edges, 1] = middle
        self._ends = np.concatenate([self._ends, np.stack([ends[:, 1], middle], axis=1)])
        return _Cut(index, ends, middle, np.arange(count, len(self._ends), dtype=np.int32))

    def _add_vertices(self, ends: np.ndarray, twin: np.ndarray | None = None) -> np.ndarray:
        """Add the middles of edges between `ends` (n, 2), with their twins; return their numbers.

        Without `twin` (n,) each new vertex is its own twin.
        """
        count = len(self._xy)
        number = np.arange(count, count + len(ends), dtype=np.int32)
        self._rounds[-1] = np.concatenate([self._rounds[-1], ends])
        self._xy = np.concatenate([self._xy, self._mesh.midpoints(self._xy, ends)])
        self._twin = np.concatenate([self._twin, number if twin is None else twin])
        return number

    def _halve(self, halved: np.ndarray, cut: _Cut) -> np.ndarray:
        """Halve cells (n,) whose hypotenuse is cut; return the numbers of their second halves."""
        a, b, c = self._cells.take(halved, axis=0).T
        hypotenuse, side_b, side_c = self._sides.take(halved, axis=0).T
        k = cut.index[hypotenuse >> 1]
        middle, (start, end) = cut.middle[k], cut.ends.take(k, axis=0).T
        at_start = b == start
        if self._mesh.periodic:
            # On the far side of a seam a side has other vertices than its edge, but the same twins.
            far = ~at_start & (b != end)
            at_start |= far & (self._twin[b] == self._twin[start])
            middle[far] = self._add_vertices(np.stack([b, c], axis=1)[far], middle[far])
        # The half of the hypotenuse at its start keeps the number, the other one gets a new number.
        first, last = hypotenuse, 2 * cut.second[k] + (hypotenuse & 1)
        half_b = np.where(at_start, first, last)
        half_c = first + last - half_b
        inner = 2 * np.arange(len(self._ends), len(self._ends) + len(halved), dtype=np.int32)
        second = np.arange(len(self._cells), len(self._cells) + len(halved), dtype=np.int32)
        self._cells[halved] = np.stack([middle, a, b], axis=1)
        self._cells = np.concatenate([self._cells, np.stack([middle, c, a], axis=1)])
        self._sides[halved] = np.stack([side_c, half_b, inner], axis=1)
        new = np.stack([side_b, inner + 1, half_c], axis=1)
        self._sides = np.concatenate([self._sides, new])
        self._ends = np.concatenate([self._ends, np.stack([a, middle], axis=1)])
        self._steps.append((halved, second))
        return second
