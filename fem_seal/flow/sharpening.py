"""Sharper bounds for the price of arithmetic: the hats of the middles of all edges.

Halve every cell twice in thought. What the finer mesh adds is spanned by the hats of the middles of
the edges, and these hardly couple (the hierarchical basis of Yserentant, Numer. Math. 49, 379
(1986); Deuflhard, Leinen and Yserentant, Impact Comput. Sci. Eng. 1, 3 (1989), estimate errors with
it): a few steps of CG with the diagonal find nearly the best of them to add to a solution. The sum
is an admissible function on the finer mesh, hence a bound, and no larger system was solved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from scipy.sparse import csr_matrix

from fem_seal.fenicsx import MPI
from fem_seal.flow.cell_data import CellContact
from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap, VertexGap
from fem_seal.flow.numbering import numbered
from fem_seal.flow.quarters import QuarterData, Shape
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

_AT_ONCE = 1 << 13  # cells
_BLOCK = 1 << 17  # cells
_STEPS = 4  # the bracket is 0.48, 0.41, 0.39, 0.39 times as wide after one, two, ... of them


@dataclass(frozen=True, eq=False)
class Hats:
    """Hats on the middles of the edges of a mesh.

    edge : (C, 3) int32, number of the edge at each side of a cell
    free : (edges,) bool, edges that carry a hat: all their cells can use it
    """

    edge: np.ndarray
    free: np.ndarray


def pressure_hats(mesh: NestedMesh | TriangleMesh, data: CellContact, kept: np.ndarray) -> Hats:
    """Hats for p: given on inlet and outlet. A shut side parts its cells: an edge for each."""
    ends, of_cell = mesh.edges
    free = ~(_joins(mesh.inlet, ends) | _joins(mesh.outlet, ends))
    shut, edge = np.flatnonzero(data.shut), of_cell.copy()
    free = np.append(free, free[of_cell.ravel()[shut]])
    edge.ravel()[shut] = np.arange(len(ends), len(free))
    free[edge[~_usable(mesh, kept)]] = False
    return Hats(edge, free)


def stream_hats(mesh: NestedMesh | TriangleMesh, data: CellContact, kept: np.ndarray) -> Hats:
    """The same for ψ: given on side walls, constant in closed cells, no hat on power traces."""
    ends, edge = mesh.edges
    free = np.ones(len(ends), dtype=bool)
    free[edge[mesh.sides_on_wall()]] = False
    free[edge[~_usable(mesh, kept & ~data.closed & ~_any(data.contact))]] = False
    return Hats(edge, free)


def _usable(mesh: NestedMesh | TriangleMesh, cells: np.ndarray) -> np.ndarray:
    """Those of some cells (C,) bool whose sides have a middle in the coordinates of the mesh."""
    return cells & mesh.can_halve_twice()


def _joins(vertices: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Which edges (E, 2) have both ends among `vertices` (V,) bool, which are few."""
    joins = vertices[ends[:, 0]]
    some = np.flatnonzero(joins)
    joins[some] = vertices[ends[some, 1]]
    return joins


def _any(of_sides: np.ndarray) -> np.ndarray:
    """Which rows of (n, 3) bool have one that is true; NumPy reduces short rows slowly."""
    first, second, third = of_sides.T
    return first | second | third


@dataclass(frozen=True, eq=False)
class Sharpening:
    """One energy ∫ c |∇v|² that hats shall lower.

    hats : from `pressure_hats` or `stream_hats`
    corner_values : of v, (n, 3), on n cells with a hat
    coefficient : c of the quarters
    """

    hats: Hats
    corner_values: Callable[[np.ndarray], np.ndarray]
    coefficient: Callable[[QuarterData], np.ndarray]


def energy_drops(
    gap: LinearGap | ConstantGap | VertexGap,
    mesh: NestedMesh | TriangleMesh,
    values: np.ndarray,
    energies: Sequence[Sharpening],
    comm: MPI.Comm,
) -> list[float]:
    """How much hats lower each of some energies on one mesh.

    Parameters
    ----------
    gap, mesh, values : the gap, the mesh and the gap at its vertices
    energies : what is to be lowered; all share the averages on the quarters
    comm : the ranks that share the work, all with the same mesh
    """
    sides = _Sides.of([energy.hats for energy in energies])
    drops = np.zeros(len(energies))
    # The hats of all cells at once would be the most memory of all. Those on the rim of a block are
    # done without, which widens a bracket by 0.3 %: whatever is added of the others is admissible.
    for block in range(comm.rank, len(sides.blocks), comm.size):
        hat, free = sides.of_block(block)
        found = _hats_of(gap, mesh, values, energies, sides.blocks[block])
        drops += [hats.drop(hat, own) for hats, own in zip(found, free, strict=True)]
    return comm.allreduce(drops).tolist()


def _hats_of(
    gap: LinearGap | ConstantGap | VertexGap,
    mesh: NestedMesh | TriangleMesh,
    values: np.ndarray,
    energies: Sequence[Sharpening],
    block: np.ndarray,
) -> list["_CellEnergies"]:
    """What the hats of some cells (n,) do to each of the energies."""
    found = [_CellEnergies.empty(len(block)) for _ in energies]
    aspect_x, aspect_y = np.broadcast_to(gap.aspect, 2)
    for part in parts(0, len(block), _AT_ONCE):
        cells = block[part]
        vertices = mesh.cells.take(cells, axis=0).T.astype(np.intp, order="C")
        xy = mesh.xy.take(vertices, axis=0)
        data = gap.quarter_data(xy, values.take(vertices, axis=0))
        seen = xy - xy[0]
        shape = Shape.of(seen[..., 0] * aspect_x, seen[..., 1] * aspect_y)
        for energy, hats in zip(energies, found, strict=True):
            hats.fill(part, shape, energy.coefficient(data), energy.corner_values(cells))
    return found


@dataclass(frozen=True, eq=False)
class _Sides:
    """Edges with a hat, numbered as the cells come to meet them, and blocks of the cells.

    number : (C, 3) int32, of the edge at each side, -1 where no energy has a hat
    blocks : cells with a hat, (n,) indices each
    first : the number of the first edge that each block meets first, and how many there are
    free : of each energy (edges,) bool, edges with a hat that the cells of one block know alone
    """

    number: np.ndarray
    blocks: list[np.ndarray]
    first: list[int]
    free: list[np.ndarray]

    @classmethod
    def of(cls, hats: Sequence[Hats]) -> "_Sides":
        """Of the hats of some energies; where one of them parts an edge others must have none."""
        edge = reduce(np.maximum, [some.edge for some in hats])
        free = np.zeros((len(hats), edge.max(initial=-1) + 1), dtype=bool)
        for row, some in zip(free, hats, strict=True):
            row[: len(some.free)] = some.free
        number, count = numbered(edge, free.any(axis=0))
        wanted = np.flatnonzero(_any(number >= 0))
        blocks = [wanted[part] for part in parts(0, len(wanted), _BLOCK)]
        first, alone = [0], np.ones(count, dtype=bool)
        for cells in blocks:
            # Cells between those of a block have no hat: their numbers are -1.
            of_block = number[cells[0] : cells[-1] + 1]
            alone[of_block[(of_block >= 0) & (of_block < first[-1])]] = False
            first.append(max(first[-1], int(of_block.max()) + 1))
        edge_of = np.empty(count + 1, dtype=np.int32)
        # The edge of sides without a hat comes last.
        edge_of[number.ravel()] = edge.ravel()
        return cls(number, blocks, first, [row[edge_of[:-1]] & alone for row in free])

    def of_block(self, block: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Edges at the sides (3, n) of a block, numbered from 0, and of each energy the free ones.

        Sides without a hat, and those of edges met before, have the number behind the last.
        """
        begin, end = self.first[block : block + 2]
        number = self.number.take(self.blocks[block], axis=0).T.astype(np.intp, order="C") - begin
        number[number < 0] = end - begin
        return number, [free[begin:end] for free in self.free]


@dataclass(frozen=True, eq=False)
class _CellEnergies:
    """Energy of v + Σ s φ on each of n cells, a quadratic in the s of the hats φ of its sides.

    slope : (3, n), half the derivative by s at s = 0
    own : (3, n), stiffness of each hat
    with_first : (n, 2), of hats 1 and 2 with hat 0; the former two do not meet
    """

    slope: np.ndarray
    own: np.ndarray
    with_first: np.ndarray

    @classmethod
    def empty(cls, count: int) -> "_CellEnergies":
        """Room for so many cells."""
        return cls(np.empty((3, count)), np.empty((3, count)), np.empty((count, 2)))

    def fill(
        self, part: slice, shape: Shape, coefficient: np.ndarray, corner_values: np.ndarray
    ) -> None:
        """Enter some cells: the coefficient of their quarters (4 n,), the values of v (n, 3)."""
        c = coefficient.reshape(4, -1)
        rows = *self.slope, *self.own, *self.with_first.T
        found = *shape.slopes(corner_values, c), *shape.stiffness(c), *shape.couplings(c)
        for row, values in zip(rows, found, strict=True):
            row[part] = values

    def drop(self, hat: np.ndarray, free: np.ndarray) -> float:
        """How much the energy falls in a few steps of CG from s = 0.

        Parameters
        ----------
        hat : (3, n), number of the hat of each side, that behind the last for none
        free : (hats,) bool, hats that are to be moved
        """
        count = len(free)
        start = -_summed(hat, self.slope, count)
        diagonal = _summed(hat, self.own, count)
        moved = np.append(free, False) & (diagonal > 0)
        inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=moved)
        first, others = hat[0], self._others(hat[1:], count)
        residual, before = start.copy(), np.inf
        s, direction = np.zeros((2, count + 1))
        for _ in range(_STEPS):
            descent = inverse * residual
            slope = descent @ residual
            if not slope > 0:
                break
            direction *= slope / before
            direction += descent
            change = diagonal * direction
            change += others.T @ direction.take(first)
            change += _summed(first, others @ direction, count)
            step = slope / (direction @ change)
            s += step * direction
            residual -= step * change
            before = slope
        # The residual is start - A s, A the stiffness, and the energy falls by (2 start - A s) s.
        return float(s @ (start + residual))

    def _others(self, hat: np.ndarray, count: int) -> csr_matrix:
        """Row by row the stiffness of hats 1 and 2 of each cell with its hat 0, (n, count + 1)."""
        starts = np.arange(0, 2 * hat.shape[1] + 1, 2, dtype=np.int32)
        columns = hat.T.astype(np.int32).ravel()
        return csr_matrix((self.with_first.ravel(), columns, starts), (len(starts) - 1, count + 1))


def _summed(hat: np.ndarray, of_sides: np.ndarray, count: int) -> np.ndarray:
    """Sum values at sides into their hats; the last place is that of sides without one."""
    return np.bincount(hat.ravel(), of_sides.ravel(), count + 1)
