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

import numpy as np
from scipy.sparse import csr_matrix

from fem_seal.fenicsx import MPI
from fem_seal.flow.cell_data import CellContact
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.numbering import numbered
from fem_seal.flow.quarters import QuarterData, QuarterShape
from fem_seal.memory import slices
from fem_seal.mesh.bisection import AnyMesh

# Steps of CG. The bracket is 0.48, 0.41, 0.39, 0.39 times as wide after 1, 2, 3, 4 of them.
STEPS = 4
# Cells of a block, whose bubble functions are computed together. Bubble functions on the rim of a
# block are left out, which widens the bracket by 0.3 %.
BLOCK = 1 << 17
QUARTERED_AT_ONCE = 1 << 13  # cells whose quarters are integrated at once


def bubble_edges(
    mesh: AnyMesh, contact: CellContact, kept: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Edge (C, 3) at each side of a cell; whether (2, E) it has a bubble function for ψ, and for p.

    It has one if all its cells admit that, and have integer coordinates at its midpoint. There is
    none for ψ on side walls, in blocked cells and on power traces, and none for p on inlet and
    outlet. A zero-gap edge has none for ψ and two for p, one per cell: it counts as two edges.
    """
    ends, of_cell = mesh.edges.ends, mesh.edges.of_cell
    usable = kept & mesh.can_halve_twice()
    zero_gap, edge = np.flatnonzero(contact.zero_gap), of_cell.copy()
    parted = of_cell.ravel()[zero_gap]
    edge.ravel()[zero_gap] = len(ends) + np.arange(len(parted))
    free = np.zeros((2, len(ends) + len(parted)), dtype=bool)
    for_psi, for_p = free
    for_psi[: len(ends)] = True
    for_psi[of_cell[mesh.sides_on_wall()]] = False
    for_psi[of_cell[~usable | contact.blocked | contact.contact_vertex.any(axis=1)]] = False
    for_p[: len(ends)] = ~(mesh.inlet[ends].all(axis=1) | mesh.outlet[ends].all(axis=1))
    for_p[len(ends) :] = for_p[parted]
    for_p[edge[~usable]] = False
    return edge, free


@dataclass(frozen=True, eq=False)
class Correction:
    """An energy ∫ c |∇v|² to be lowered by bubble functions, for k functions v."""

    count: int  #: number k of functions
    #: corner values (n, 3) of each function on n cells
    corner_values: Callable[[np.ndarray], Sequence[np.ndarray]]
    coefficient: Callable[[QuarterData], np.ndarray]  #: coefficient c (4, n) on the quarters


@dataclass(frozen=True, eq=False)
class Drops:
    """Amounts by which bubble functions lower the energies of k functions v."""

    energies: np.ndarray  #: (k, k), decrease of ∫ c ∇v_a·∇v_b, each with its own bubble functions
    terms: np.ndarray  #: (k, 2), terms of the bubble functions, as of `Energy.error_of_drop`
    sides: "BubbleSides"  #: edges of the bubble functions
    #: coefficients (edges + 1,) of the bubble functions, for each block of cells of this process
    #: and each function
    coefficients: list[list[np.ndarray]]

    def with_block(self, form: "BubbleForm", s: list[np.ndarray]) -> "Drops":
        """The drops with those on one more block of cells, by its coefficients s."""
        drop, terms = form.drops(s)
        return Drops(self.energies + drop, self.terms + terms, self.sides, [*self.coefficients, s])

    def of_all(self, comm: MPI.Comm) -> "Drops":
        """The drops on the blocks of all processes."""
        energies, terms = comm.allreduce(self.energies), comm.allreduce(self.terms)
        return Drops(energies, terms, self.sides, self.coefficients)


def energy_drops(
    gap: GapOnMesh,
    mesh: AnyMesh,
    values: np.ndarray,
    energies: Sequence[Correction],
    comm: MPI.Comm,
    sides: "BubbleSides",
    applied: list[list[np.ndarray]] | None = None,
) -> list[Drops]:
    """Drops of energies on one mesh, with the gap at its vertices.

    All use the same averages on the quarters. The energies are one for ψ and one for p, and the
    coefficients are chosen for the largest drops; or there is one energy, with the coefficients
    `applied`, those of `Drops` of the same functions in another gap: the drop is negative where
    they raise the energy.
    """
    counts = [energy.count for energy in energies]
    drops = [Drops(np.zeros((n, n)), np.zeros((n, 2)), sides, []) for n in counts]
    # Process the cells in blocks: the data of all bubble functions at once would take more memory
    # than anything else. Leaving out the bubble functions on the rim of a block is admissible.
    for number, block in enumerate(range(comm.rank, len(sides.blocks), comm.size)):
        bubble, free = sides.of_block(block)
        for k, rows in enumerate(_rows_of(sides.blocks[block], gap, mesh, values, energies)):
            form = BubbleForm(rows, bubble, len(free[k]))
            s = applied[number] if applied else form.lowered(free[k])
            drops[k] = drops[k].with_block(form, s)
    return [drop.of_all(comm) for drop in drops]


def _rows_of(
    block: np.ndarray,
    gap: GapOnMesh,
    mesh: AnyMesh,
    values: np.ndarray,
    energies: Sequence[Correction],
) -> list[np.ndarray]:
    """`bubble_rows` of a block of cells (n,) for each energy."""
    rows = [np.empty((3 * energy.count + 7, len(block))) for energy in energies]
    aspect_x, aspect_y = np.broadcast_to(gap.aspect, 2)
    blur = mesh.blur * float(np.max(gap.aspect))
    for part in slices(0, len(block), QUARTERED_AT_ONCE):
        cells = block[part]
        vertices = mesh.cells.take(cells, axis=0).T.astype(np.intp, order="C")
        xy = mesh.xy.take(vertices, axis=0)
        data = gap.quarter_data(xy, values.take(vertices, axis=0))
        relative = xy - xy[0]
        shape = QuarterShape.of(relative[..., 0] * aspect_x, relative[..., 1] * aspect_y, blur)
        for energy, of_block in zip(energies, rows, strict=True):
            corner_values = energy.corner_values(cells)
            of_block[:, part] = bubble_rows(shape, energy.coefficient(data), corner_values)
    return rows


def bubble_rows(
    shape: QuarterShape, c: np.ndarray, corner_values: Sequence[np.ndarray]
) -> np.ndarray:
    """Energy on n cells of v + Σ s φ, quadratic in s, for k functions v: rows (3 k + 7, n).

    They hold, for each v, half the derivatives by s at s = 0 (3 rows); the stiffness of each bubble
    function φ (3), and that of bubbles 1 and 2 with bubble 0 (2), as the former two do not overlap;
    and bounds of the terms of ∫ c |∇Σ s φ|² for Σ |s| = 1, `plain` and `terms` of the shape (2).

    c is (4, n), on the quarters; each v has corner values (n, 3).
    """
    slopes = (slope for v in corner_values for slope in shape.slopes(v, c))
    total = c.sum(axis=0)
    terms = shape.plain * total, shape.terms * total
    return np.stack([*slopes, *shape.stiffness(c), *shape.couplings(c), *terms])


@dataclass(frozen=True, eq=False)
class BubbleSides:
    """Edges with a bubble function, numbered in the order of the cells, and blocks of the cells."""

    #: (C, 3) int32, number of the edge at each side, -1 where no energy has a bubble function
    number: np.ndarray
    blocks: list[np.ndarray]  #: cells with a bubble function, (n,) indices for each block
    #: first edge number that is new in each block; at the end the number of all edges
    first: list[int]
    #: (2, edges) bool, for ψ and for p: edges with a bubble function all of whose cells lie in one
    #: block
    free: np.ndarray

    @classmethod
    def of(cls, mesh: AnyMesh, contact: CellContact, kept: np.ndarray) -> "BubbleSides":
        """Number the edges, and cut the cells into blocks; those `kept` (C,) carry flow."""
        edge, free = bubble_edges(mesh, contact, kept)
        number, count = numbered(edge, free.any(axis=0))
        with_bubble = np.flatnonzero((number >= 0).any(axis=1))
        blocks = [with_bubble[part] for part in slices(0, len(with_bubble), BLOCK)]
        first, alone = [0], np.ones(count, dtype=bool)
        for cells in blocks:
            # Cells between those of the block have no bubble function: their numbers are -1.
            of_block = number[cells[0] : cells[-1] + 1]
            alone[of_block[(of_block >= 0) & (of_block < first[-1])]] = False
            first.append(max(first[-1], int(of_block.max()) + 1))
        edge_of = np.empty(count + 1, dtype=np.int32)
        # Sides without a bubble function have number -1, the last entry.
        edge_of[number.ravel()] = edge.ravel()
        return cls(number, blocks, first, free[:, edge_of[:-1]] & alone)

    def of_block(self, block: int) -> tuple[np.ndarray, np.ndarray]:
        """Edge number of the sides (3, n) of a block, from 0, and which edges (2, edges) are free.

        Sides without a bubble function, and sides whose edge belongs to an earlier block, get the
        number after the last.
        """
        begin, end = self.first[block : block + 2]
        number = self.number.take(self.blocks[block], axis=0).T.astype(np.intp, order="C") - begin
        number[number < 0] = end - begin
        return number, self.free[:, begin:end]


class BubbleForm:
    """Energy of v + Σ s φ on all cells of a block, less that of v, for each function v.

    `rows` are those of `bubble_rows`. `bubble` (3, n) is the number of the bubble function of each
    side, `count` for none. Coefficients s are (count + 1,), zero in the last place.
    """

    def __init__(self, rows: np.ndarray, bubble: np.ndarray, count: int):
        slopes, own, with_first, self._terms = np.split(rows, [-7, -4, -2])
        self._bubble = bubble
        self._starts = [
            -_by_bubbles(bubble, slope, count) for slope in slopes.reshape(-1, *own.shape)
        ]
        self._diagonal = _by_bubbles(bubble, own, count)
        # Stiffness (n, count + 1) of bubbles 1 and 2 of each cell with its bubble 0.
        starts = np.arange(0, 2 * bubble.shape[1] + 1, 2, dtype=np.int32)
        columns = bubble[1:].T.astype(np.int32).ravel()
        shape = len(starts) - 1, count + 1
        self._others = csr_matrix((with_first.T.ravel(), columns, starts), shape)

    def _stiffness(self, s: np.ndarray) -> np.ndarray:
        """A s."""
        first = self._bubble[0]
        product = self._diagonal * s
        product += self._others.T @ s.take(first)
        product += _by_bubbles(first, self._others @ s, len(s) - 1)
        return product

    def lowered(self, free: np.ndarray) -> list[np.ndarray]:
        """Coefficients for each function v after a few steps of CG from s = 0.

        Only the coefficients of `free` (count,) bool change.
        """
        moved = np.append(free, False) & (self._diagonal > 0)
        inverse = np.divide(1.0, self._diagonal, out=np.zeros(len(moved)), where=moved)
        return [_few_steps_of_cg(self._stiffness, start, inverse) for start in self._starts]

    def drops(self, coefficients: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Energies (k, k) and terms (k, 2) of `Drops`, by coefficients of each function.

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
        terms = [(self._terms * (s * s)).sum(axis=1) for s in in_cell]
        return (np.array(rows) + np.transpose(rows)) / 2, np.array(terms)


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


def _by_bubbles(bubble: np.ndarray, of_sides: np.ndarray, count: int) -> np.ndarray:
    """Sum the values of sides for each bubble; the last entry is for sides without one."""
    return np.bincount(bubble.ravel(), of_sides.ravel(), count + 1)
