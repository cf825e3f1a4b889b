"""Sharper bounds for the price of arithmetic: the hats of the middles of all edges.

Halve every cell twice in thought. What the finer mesh adds is spanned by the hats of the middles of
the edges, and these hardly couple (the hierarchical basis of Yserentant, Numer. Math. 49, 379
(1986); Deuflhard, Leinen and Yserentant, Impact Comput. Sci. Eng. 1, 3 (1989), estimate errors with
it): a few steps of CG with the diagonal find nearly the best of them to add to a solution. The sum
is an admissible function on the finer mesh, hence a bound, and no larger system was solved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.fenicsx import MPI
from fem_seal.flow.gap_on_mesh import CellContact, CellData, ConstantGap, LinearGap, VertexGap
from fem_seal.flow.gradients import gradients, shape_gradients
from fem_seal.mesh.grouping import consecutive, parts
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

_AT_ONCE = 1 << 12  # cells
_BLOCK = 1 << 17  # cells
_STEPS = 4  # the bracket is 0.48, 0.41, 0.39, 0.39 times as wide after one, two, ... of them


def pressure_hats(mesh: NestedMesh, data: CellContact, kept: np.ndarray) -> np.ndarray:
    """Hat of each side (C, 3) of the cells of a mesh, -1 for none: p is given on inlet and outlet.

    A shut side parts its cells, and each has a hat of its own.
    """
    ends = mesh.ends_of_sides()
    given = mesh.inlet[ends].all(axis=2) | mesh.outlet[ends].all(axis=2)
    return _numbered(mesh, kept[:, None] & ~given, data.shut)


def stream_hats(mesh: NestedMesh, data: CellContact, kept: np.ndarray) -> np.ndarray:
    """The same for ψ: given on side walls, constant in closed cells, no hat on power traces."""
    usable = kept & ~data.closed & ~data.contact.any(axis=1)
    usable = usable[:, None] & ~mesh.sides_on_wall()
    return _numbered(mesh, usable, np.zeros(usable.shape, dtype=bool))


def _numbered(mesh: NestedMesh | TriangleMesh, usable: np.ndarray, alone: np.ndarray) -> np.ndarray:
    """Number the edges that all their cells can use; a side that stands alone is an edge itself.

    Parameters
    ----------
    usable, alone : (C, 3) bool
    """
    _, of_cell = mesh.edges
    count = int(of_cell.max()) + 1
    # At the depth of the integer coordinates there is no middle to stand on.
    usable = usable & mesh.can_halve_twice()[:, None]
    own = np.arange(count, count + alone.size, dtype=np.int32).reshape(-1, 3)
    edge = np.where(alone, own, of_cell)
    free = np.ones(count + alone.size, dtype=bool)
    free[edge[~usable]] = False
    has_one = free[edge]
    hat = np.full(edge.shape, -1, dtype=np.int32)
    hat[has_one], _ = consecutive(edge[has_one], len(free))
    return hat


@dataclass(frozen=True, eq=False)
class Sharpening:
    """One energy ∫ c |∇v|² that hats shall lower.

    hat : (C, 3), from `pressure_hats` or `stream_hats`
    corner_values : of v, (n, 3), on n cells with a hat
    coefficient : c of the cells
    """

    hat: np.ndarray
    corner_values: Callable[[np.ndarray], np.ndarray]
    coefficient: Callable[[CellData], np.ndarray]


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
    wanted = np.flatnonzero(np.any([(e.hat >= 0).any(axis=1) for e in energies], axis=0))
    sides = [np.bincount((e.hat + 1).ravel())[1:].astype(np.int8) for e in energies]
    drops = np.zeros(len(energies))
    # The hats of all cells at once would be the most memory of all. Those on the rim of a block are
    # done without, which widens a bracket by 0.3 %: whatever is added of the others is admissible.
    for block in list(parts(0, len(wanted), _BLOCK))[comm.rank :: comm.size]:
        found = _hats_of(gap, mesh, values, energies, wanted[block])
        for k, (energy, hats) in enumerate(zip(energies, found, strict=True)):
            # Where contact is everywhere near, ψ has no hat at all.
            if len(sides[k]):
                drops[k] += hats.drop(_inside(energy.hat[wanted[block]], sides[k]))
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
    for part in parts(0, len(block), _AT_ONCE):
        cells = block[part]
        quarters = _Quarters.of(gap, mesh, values, cells)
        slopes, _ = shape_gradients(mesh.points(gap.aspect, mesh.cells[cells]))
        for energy, hats in zip(energies, found, strict=True):
            usable = np.flatnonzero((energy.hat[cells] >= 0).any(axis=1))
            v = np.zeros((2, len(cells)))
            v[:, usable] = gradients(slopes[usable], energy.corner_values(cells[usable])).T
            hats.fill(part, quarters, energy.coefficient(quarters.data), v)
    return found


def _inside(hat: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Number those hats of a block that no other cell knows.

    Parameters
    ----------
    hat : (n, 3), of the cells of the block, -1 for none
    sides : how many sides of all cells each hat stands on

    Returns
    -------
    (n, 3), consecutive numbers, -1 for none and for hats that reach beyond the block
    """
    number = np.full(hat.shape, -1, dtype=np.int32)
    has_one = hat >= 0
    number[has_one], count = consecutive(hat[has_one], len(sides))
    within = np.bincount((number + 1).ravel(), minlength=count + 1)[number + 1]
    number[has_one & (within < sides[hat])] = -1
    return number


@dataclass(frozen=True, eq=False)
class _Quarters:
    """Cells (a, b, c) halved twice; m, d and e are the middles of bc, ab and ca (n cells).

    data : of the 4 n quarters, all (d, m, a), then all (e, m, c), (d, b, m) and (e, a, m)
    area : (4, n)
    of_half : (2, 2, n), x and y of the gradient of the hat of m on (m, a, b) and on (m, c, a)
    of_quarter : (2, 4, n), those of the hat of the first corner
    """

    data: CellData
    area: np.ndarray
    of_half: np.ndarray
    of_quarter: np.ndarray

    @classmethod
    def of(
        cls,
        gap: LinearGap | ConstantGap | VertexGap,
        mesh: NestedMesh | TriangleMesh,
        values: np.ndarray,
        cells: np.ndarray,
    ) -> "_Quarters":
        """Of some cells (n,) of a mesh with the gap at its vertices."""
        halves, ends = mesh.halves(cells)
        at_halves = gap.refined_values(values[mesh.cells[cells].T.ravel()], halves, ends)
        quarters, ends = halves.halves(np.arange(2 * len(cells)))
        at_corners = at_halves[halves.cells.T.ravel()]
        # Of resistivities that the ceiling raises, the mean is not that of the cell: with the true
        # ones of the parts, what the hats take off is at most what they take off the raised one.
        at_quarters = gap.refined_values(at_corners, quarters, ends)
        data = gap.cell_data(quarters, at_quarters, limited=False)
        of_half, _ = _first_gradients(halves.points(gap.aspect), halves.cells)
        of_quarter, area = _first_gradients(quarters.points(gap.aspect), quarters.cells)
        shaped = of_half.reshape(2, 2, -1), of_quarter.reshape(2, 4, -1)
        return cls(data, area.reshape(4, -1), *shaped)


def _first_gradients(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (2, n) of the hat of the first corner, and area (n,), of triangles (n, 3)."""
    x, y = points.T
    a, b, c = cells.T
    ux, uy, vx, vy = x[c] - x[b], y[c] - y[b], x[a] - x[b], y[a] - y[b]
    twice = ux * vy - uy * vx
    return np.stack([-uy / twice, ux / twice]), np.abs(twice) / 2


@dataclass(frozen=True, eq=False)
class _CellEnergies:
    """Energy of v + Σ s φ on each of n cells, a quadratic in the s of the hats φ of its sides.

    slope : (n, 3), half the derivative by s at s = 0
    stiffness : (n, 5), entries 00, 11, 22, 01 and 02; the hats of sides 1 and 2 do not meet
    """

    slope: np.ndarray
    stiffness: np.ndarray

    @classmethod
    def empty(cls, count: int) -> "_CellEnergies":
        """Room for so many cells."""
        return cls(np.empty((count, 3)), np.empty((count, 5)))

    def fill(
        self, part: slice, quarters: _Quarters, coefficient: np.ndarray, v: np.ndarray
    ) -> None:
        """Enter some cells: the coefficient of their quarters (4 n,), the gradient of v (2, n)."""
        first, second = quarters.of_half[:, 0], quarters.of_half[:, 1]
        weight = quarters.area * coefficient.reshape(4, -1)
        on_first, on_second = weight[0] + weight[2], weight[1] + weight[3]
        m = on_first * first + on_second * second
        m_own = on_first * _dot(first, first) + on_second * _dot(second, second)
        flux = weight * quarters.of_quarter
        own = _dot(flux, quarters.of_quarter)
        d, e = flux[:, 0] + flux[:, 2], flux[:, 1] + flux[:, 3]
        slope, stiffness = self.slope[part].T, self.stiffness[part].T
        slope[:] = _dot(m, v), _dot(e, v), _dot(d, v)
        stiffness[:3] = m_own, own[1] + own[3], own[0] + own[2]
        stiffness[3:] = _dot(e, second), _dot(d, first)

    def drop(self, hat: np.ndarray) -> float:
        """How much the energy falls in a few steps of CG from s = 0.

        Parameters
        ----------
        hat : (n, 3), number of the hat of each side, -1 for none
        """
        residual = -_summed(hat, self.slope)
        diagonal = _summed(hat, self.stiffness[:, :3])
        inverse = np.divide(1.0, diagonal, out=np.zeros_like(diagonal), where=diagonal > 0)
        s, direction, before = np.zeros_like(residual), np.zeros_like(residual), np.inf
        for _ in range(_STEPS):
            descent = inverse * residual
            slope = descent @ residual
            if not slope > 0:
                break
            direction = descent + slope / before * direction
            change = _summed(hat, self._times(_at_sides(hat, direction)))
            step = slope / (direction @ change)
            s, residual, before = s + step * direction, residual - step * change, slope
        at_sides = _at_sides(hat, s)
        # Summed cell by cell, whatever rounding has done to the steps.
        return -float((at_sides * (2 * self.slope + self._times(at_sides))).sum())

    def _times(self, s: np.ndarray) -> np.ndarray:
        """The stiffness of each cell times s (n, 3)."""
        s0, s1, s2 = s.T
        a00, a11, a22, a01, a02 = self.stiffness.T
        rows = a00 * s0 + a01 * s1 + a02 * s2, a01 * s0 + a11 * s1, a02 * s0 + a22 * s2
        return np.stack(rows, axis=1)


def _summed(hat: np.ndarray, of_sides: np.ndarray) -> np.ndarray:
    """Sum values at the sides (n, 3) into their hats."""
    # Sides without a hat are counted into a place of their own, and left out.
    return np.bincount((hat + 1).ravel(), of_sides.ravel(), int(hat.max(initial=-1)) + 2)[1:]


def _at_sides(hat: np.ndarray, of_hats: np.ndarray) -> np.ndarray:
    """Values of the hats at the sides (n, 3), zero where there is none."""
    return np.append(of_hats, 0.0)[hat]


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[0] * b[0] + a[1] * b[1]
