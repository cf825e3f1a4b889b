"""Hierarchical correction: better bounds by one bubble function for each edge midpoint.

Halving every cell twice cuts it into four quarters. The hierarchical basis of the finer mesh adds
one hat function φ_e per edge midpoint to the solution v, here called the bubble function of the
edge. For an energy E with coefficient c on the quarters,

    E(v + Σ s_e φ_e) = ∫ c |∇v|² + 2 s·r + s·A·s,   r_e = ∫ c ∇v·∇φ_e,  A_ef = ∫ c ∇φ_e·∇φ_f,

is a bound for every s, since v + Σ s_e φ_e is admissible on the finer mesh. The bubble functions
hardly couple (H. Yserentant, Numer. Math. 49, 379 (1986); P. Deuflhard, P. Leinen, H. Yserentant,
Impact Comput. Sci. Eng. 1, 3 (1989), estimate errors with them): a few steps of CG with diagonal
preconditioner from s = 0 lower E almost to its minimum. No larger system is assembled or solved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from scipy.sparse import csr_matrix

from fem_seal.fenicsx import MPI
from fem_seal.flow.cell_data import CellContact
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.numbering import numbered
from fem_seal.flow.quarters import QuarterData, QuarterShape
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.grouping import parts

# Steps of CG. The bracket is 0.48, 0.41, 0.39, 0.39 times as wide after 1, 2, 3, 4 of them.
STEPS = 4
# Cells of a block, whose bubble functions are computed together. Bubble functions on the rim of a
# block are left out, which widens the bracket by 0.3 %.
BLOCK = 1 << 17
QUARTERED_AT_ONCE = 1 << 13  # cells whose quarters are integrated at once


@dataclass(frozen=True, eq=False)
class Bubbles:
    """Bubble functions of the edges of a mesh."""

    edge: np.ndarray  #: (C, 3) int32, edge at each side of a cell
    free: np.ndarray  #: edges with a bubble function; all cells at the edge must admit it


def pressure_bubbles(mesh: AnyMesh, data: CellContact, kept: np.ndarray) -> Bubbles:
    """Bubble functions for p: none on inlet and outlet; two on a zero-gap edge, one per cell."""
    ends, of_cell = mesh.edges.ends, mesh.edges.of_cell
    free = ~(_joins(mesh.inlet, ends) | _joins(mesh.outlet, ends))
    zero_gap, edge = np.flatnonzero(data.zero_gap), of_cell.copy()
    free = np.append(free, free[of_cell.ravel()[zero_gap]])
    edge.ravel()[zero_gap] = np.arange(len(ends), len(free))
    free[edge[~_usable(mesh, kept)]] = False
    return Bubbles(edge, free)


def stream_bubbles(mesh: AnyMesh, data: CellContact, kept: np.ndarray) -> Bubbles:
    """Bubble functions for ψ: none on side walls, in blocked cells and on power traces."""
    ends, edge = mesh.edges.ends, mesh.edges.of_cell
    free = np.ones(len(ends), dtype=bool)
    free[edge[mesh.sides_on_wall()]] = False
    free[edge[~_usable(mesh, kept & ~data.blocked & ~_any(data.contact_vertex))]] = False
    return Bubbles(edge, free)


def _usable(mesh: AnyMesh, cells: np.ndarray) -> np.ndarray:
    """Restrict a set of cells (C,) bool to those whose edge midpoints have integer coordinates."""
    return cells & mesh.can_halve_twice()


def _joins(vertices: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Edges (E,) bool with both ends (E, 2) in `vertices` (V,) bool; fast if these are few."""
    joins = vertices[ends[:, 0]]
    candidates = np.flatnonzero(joins)
    joins[candidates] = vertices[ends[candidates, 1]]
    return joins


def _any(of_sides: np.ndarray) -> np.ndarray:
    """Logical or over the rows of (n, 3) bool; NumPy's own reduction of short rows is slow."""
    first, second, third = of_sides.T
    return first | second | third


@dataclass(frozen=True, eq=False)
class Correction:
    """An energy ∫ c |∇v|² to be lowered by bubble functions, for k functions v."""

    count: int  #: number k of functions
    bubbles: Callable[[], Bubbles]  #: `pressure_bubbles` or `stream_bubbles` of its mesh
    #: corner values (n, 3) of each function on n cells
    corner_values: Callable[[np.ndarray], Sequence[np.ndarray]]
    coefficient: Callable[[QuarterData], np.ndarray]  #: coefficient c on the quarters


@dataclass(frozen=True, eq=False)
class Drops:
    """Amounts by which bubble functions lower the energies of k functions v."""

    energies: np.ndarray  #: (k, k), decrease of ∫ c ∇v_a·∇v_b, each with its own bubble functions
    terms: np.ndarray  #: (k, 2), terms of the bubble functions, as of `Energy.error_of_drop`

    @classmethod
    def sum(cls, parts: Sequence["Drops"], count: int, comm: MPI.Comm) -> "Drops":
        """Sum of the drops of `count` functions on all blocks of cells of all processes."""
        energies, terms = np.zeros((count, count)), np.zeros((count, 2))
        for part in parts:
            energies += part.energies
            terms += part.terms
        return cls(comm.allreduce(energies), comm.allreduce(terms))


@dataclass(frozen=True, eq=False)
class AppliedBubbles:
    """Coefficients of the bubble functions that lowered some energies."""

    sides: "_Sides"
    #: for each energy, each block of cells of this process and each function (edges + 1,)
    coefficients: tuple[list[list[np.ndarray]], ...]

    def of(self, energy: int) -> "AppliedBubbles":
        """Coefficients for one of the energies."""
        return AppliedBubbles(self.sides, (self.coefficients[energy],))


def energy_drops(
    gap: GapOnMesh,
    mesh: AnyMesh,
    values: np.ndarray,
    energies: Sequence[Correction],
    comm: MPI.Comm,
    applied: AppliedBubbles | None = None,
) -> tuple[list[Drops], AppliedBubbles]:
    """Drops of energies on one mesh, with the gap at its vertices, and the bubbles applied.

    All use the same averages on the quarters. The coefficients are chosen for the largest drops, or
    those already `applied` to the same functions in another gap: a drop is then negative where the
    energy rises.
    """
    sides = applied.sides if applied else _Sides.of([energy.bubbles() for energy in energies])
    drops: list[list[Drops]] = [[] for _ in energies]
    coefficients: tuple[list[list[np.ndarray]], ...] = tuple([] for _ in energies)
    # Process the cells in blocks: the data of all bubble functions at once would take more memory
    # than anything else. Leaving out the bubble functions on the rim of a block is admissible.
    for number, block in enumerate(range(comm.rank, len(sides.blocks), comm.size)):
        bubble, free = sides.of_block(block)
        cells = _energies_with_bubbles(gap, mesh, values, energies, sides.blocks[block])
        for k, energy in enumerate(cells):
            form = _BubbleForm(energy, bubble, len(free[k]))
            s = applied.coefficients[k][number] if applied else form.lowered(free[k])
            drops[k].append(form.drops(s))
            coefficients[k].append(s)
    totals = [
        Drops.sum(of_blocks, energy.count, comm)
        for of_blocks, energy in zip(drops, energies, strict=True)
    ]
    return totals, AppliedBubbles(sides, coefficients)


def _energies_with_bubbles(
    gap: GapOnMesh,
    mesh: AnyMesh,
    values: np.ndarray,
    energies: Sequence[Correction],
    block: np.ndarray,
) -> list["_CellEnergies"]:
    """Each energy on a block of cells (n,) as a quadratic form in the bubble coefficients."""
    forms = [_CellEnergies.empty(energy.count, len(block)) for energy in energies]
    aspect_x, aspect_y = np.broadcast_to(gap.aspect, 2)
    blur = mesh.blur * float(np.max(gap.aspect))
    for part in parts(0, len(block), QUARTERED_AT_ONCE):
        cells = block[part]
        vertices = mesh.cells.take(cells, axis=0).T.astype(np.intp, order="C")
        xy = mesh.xy.take(vertices, axis=0)
        data = gap.quarter_data(xy, values.take(vertices, axis=0))
        relative = xy - xy[0]
        shape = QuarterShape.of(relative[..., 0] * aspect_x, relative[..., 1] * aspect_y, blur)
        for energy, form in zip(energies, forms, strict=True):
            form.fill(part, shape, energy.coefficient(data), energy.corner_values(cells))
    return forms


@dataclass(frozen=True, eq=False)
class _Sides:
    """Edges with a bubble function, numbered in the order of the cells, and blocks of the cells."""

    #: (C, 3) int32, number of the edge at each side, -1 where no energy has a bubble function
    number: np.ndarray
    blocks: list[np.ndarray]  #: cells with a bubble function, (n,) indices for each block
    #: first edge number that is new in each block; at the end the number of all edges
    first: list[int]
    #: for each energy (edges,) bool: edges with a bubble function all of whose cells lie in one
    #: block
    free: list[np.ndarray]

    @classmethod
    def of(cls, bubbles: Sequence[Bubbles]) -> "_Sides":
        """Number the edges and cut the cells into blocks.

        An edge that is split for one energy must carry no bubble for another.
        """
        edge = reduce(np.maximum, [of_energy.edge for of_energy in bubbles])
        free = np.zeros((len(bubbles), edge.max(initial=-1) + 1), dtype=bool)
        for row, of_energy in zip(free, bubbles, strict=True):
            row[: len(of_energy.free)] = of_energy.free
        number, count = numbered(edge, free.any(axis=0))
        with_bubble = np.flatnonzero(_any(number >= 0))
        blocks = [with_bubble[part] for part in parts(0, len(with_bubble), BLOCK)]
        first, alone = [0], np.ones(count, dtype=bool)
        for cells in blocks:
            # Cells between those of the block have no bubble function: their numbers are -1.
            of_block = number[cells[0] : cells[-1] + 1]
            alone[of_block[(of_block >= 0) & (of_block < first[-1])]] = False
            first.append(max(first[-1], int(of_block.max()) + 1))
        edge_of = np.empty(count + 1, dtype=np.int32)
        # Sides without a bubble function have number -1, the last entry.
        edge_of[number.ravel()] = edge.ravel()
        return cls(number, blocks, first, [row[edge_of[:-1]] & alone for row in free])

    def of_block(self, block: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Edge number of the sides (3, n) of a block, from 0, and the free edges of each energy.

        Sides without a bubble function, and sides whose edge belongs to an earlier block, get the
        number after the last.
        """
        begin, end = self.first[block : block + 2]
        number = self.number.take(self.blocks[block], axis=0).T.astype(np.intp, order="C") - begin
        number[number < 0] = end - begin
        return number, [free[begin:end] for free in self.free]


@dataclass(frozen=True, eq=False)
class _CellEnergies:
    """Energy of v + Σ s φ on each of n cells, quadratic in the coefficients s of its bubbles φ."""

    slope: np.ndarray  #: (k, 3, n), half the derivative by s at s = 0, for each function v
    own: np.ndarray  #: (3, n), stiffness of each bubble function
    #: (n, 2), stiffness of bubbles 1 and 2 with bubble 0; the former two do not overlap
    with_first: np.ndarray
    #: (2, n), bounds of the terms of ∫ c |∇Σ s φ|² for Σ |s| = 1: `plain` and `terms` of the shape
    terms: np.ndarray

    @classmethod
    def empty(cls, functions: int, count: int) -> "_CellEnergies":
        """Allocate the arrays of `count` cells."""
        slope, own = np.empty((functions, 3, count)), np.empty((3, count))
        return cls(slope, own, np.empty((count, 2)), np.empty((2, count)))

    def fill(
        self,
        part: slice,
        shape: QuarterShape,
        coefficient: np.ndarray,
        corner_values: Sequence[np.ndarray],
    ) -> None:
        """Fill in n cells from c on their quarters (4 n,) and corner values (n, 3) of each v."""
        c = coefficient.reshape(4, -1)
        slope = self.slope.reshape(-1, self.slope.shape[2])
        rows = [*slope, *self.own, *self.with_first.T, *self.terms]
        slopes = (slope for v in corner_values for slope in shape.slopes(v, c))
        total = c.sum(axis=0)
        terms = shape.plain * total, shape.terms * total
        entries = *slopes, *shape.stiffness(c), *shape.couplings(c), *terms
        for row, values in zip(rows, entries, strict=True):
            row[part] = values


class _BubbleForm:
    """Energy of v + Σ s φ on all cells of a block, less that of v, for each function v.

    `bubble` (3, n) is the number of the bubble function of each side, `count` for none.
    Coefficients s are (count + 1,), zero in the last place.
    """

    def __init__(self, cells: _CellEnergies, bubble: np.ndarray, count: int):
        self._cells, self._bubble = cells, bubble
        self._starts = [-_summed(bubble, slope, count) for slope in cells.slope]
        self._diagonal = _summed(bubble, cells.own, count)
        # Stiffness (n, count + 1) of bubbles 1 and 2 of each cell with its bubble 0.
        starts = np.arange(0, 2 * bubble.shape[1] + 1, 2, dtype=np.int32)
        columns = bubble[1:].T.astype(np.int32).ravel()
        shape = len(starts) - 1, count + 1
        self._others = csr_matrix((cells.with_first.ravel(), columns, starts), shape)

    def _stiffness(self, s: np.ndarray) -> np.ndarray:
        """A s."""
        first = self._bubble[0]
        product = self._diagonal * s
        product += self._others.T @ s.take(first)
        product += _summed(first, self._others @ s, len(s) - 1)
        return product

    def lowered(self, free: np.ndarray) -> list[np.ndarray]:
        """Coefficients for each function v after a few steps of CG from s = 0.

        Only the coefficients of `free` (count,) bool change.
        """
        moved = np.append(free, False) & (self._diagonal > 0)
        inverse = np.divide(1.0, self._diagonal, out=np.zeros(len(moved)), where=moved)
        return [_few_steps_of_cg(self._stiffness, start, inverse) for start in self._starts]

    def drops(self, coefficients: Sequence[np.ndarray]) -> Drops:
        """Drops by coefficients of each function.

        The energy of functions a and b changes by r_a·s_b + r_b·s_a + s_a·A·s_b. It is computed
        from s alone, not from what CG says of itself, so that the rounding errors of CG do not
        count; NumPy sums in pairs.
        """
        residuals = [
            start - self._stiffness(s) for start, s in zip(self._starts, coefficients, strict=True)
        ]
        rows = [
            [
                (s_b * start + s_a * residual).sum()
                for s_b, residual in zip(coefficients, residuals, strict=True)
            ]
            for s_a, start in zip(coefficients, self._starts, strict=True)
        ]
        in_cell = (np.abs(s).take(self._bubble).sum(axis=0) for s in coefficients)
        terms = [(self._cells.terms * (s * s)).sum(axis=1) for s in in_cell]
        return Drops((np.array(rows) + np.transpose(rows)) / 2, np.array(terms))


def _few_steps_of_cg(
    stiffness: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    inverse: np.ndarray,
) -> np.ndarray:
    """Coefficients s after some steps of CG for A s = start, from s = 0.

    `inverse` is the diagonal preconditioner, zero where a coefficient stays zero.
    """
    r, rz_before = start.copy(), np.inf
    s, d = np.zeros((2, len(start)))
    for _ in range(STEPS):
        z = inverse * r
        rz = z @ r
        if not rz > 0:
            break
        d *= rz / rz_before
        d += z
        Ad = stiffness(d)
        alpha = rz / (d @ Ad)
        s += alpha * d
        r -= alpha * Ad
        rz_before = rz
    return s


def _summed(bubble: np.ndarray, of_sides: np.ndarray, count: int) -> np.ndarray:
    """Sum the values of sides for each bubble; the last entry is for sides without one."""
    return np.bincount(bubble.ravel(), of_sides.ravel(), count + 1)
