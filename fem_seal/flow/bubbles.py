"""Sharper bounds for the price of arithmetic: the exact minimum over the hypotenuse bubbles.

Take the hat function of the middle of a hypotenuse on the two halves of each of its two cells.
Hats of different hypotenuses share no cell, so that the minimum of an energy over all of them,
added to a given function v, is explicit: each bubble φ lowers it by a(v, φ)²/a(φ, φ). The result
is an admissible function on the mesh of halves, hence a bound, and no larger system was solved.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.flow.gap_on_mesh import CellContact, CellData, ConstantGap, LinearGap, VertexGap
from fem_seal.mesh.grouping import stable_order
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

_AT_ONCE = 1 << 14  # cells


def shape_gradients(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the barycentric coordinates and areas of triangles.

    Parameters
    ----------
    x : (C, 3, 2), corners

    Returns
    -------
    (C, 3, 2), (C,)
    """
    opposite = x[:, [2, 0, 1]] - x[:, [1, 2, 0]]
    twice = opposite[:, 0, 0] * opposite[:, 1, 1] - opposite[:, 0, 1] * opposite[:, 1, 0]
    turned = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1)
    return turned / twice[:, None, None], np.abs(twice) / 2


def gradients(slopes: np.ndarray, corner_values: np.ndarray) -> np.ndarray:
    """Gradients (n, 2) of linear functions, from those of the barycentric coordinates (n, 3, 2).

    From differences of the corner values (n, 3): the same added to all is not even rounded.
    """
    return np.einsum("cid,ci->cd", slopes[:, 1:], corner_values[:, 1:] - corner_values[:, :1])


def pressure_bubbles(mesh: NestedMesh, data: CellContact, kept: np.ndarray) -> np.ndarray:
    """Bubble of each cell (C,) of the mesh, -1 for none: the pressure is given on inlet and outlet.

    A shut hypotenuse parts its cells, and each has a bubble of its own.
    """
    ends = mesh.cells[:, 1:]
    given = mesh.inlet[ends].all(axis=1) | mesh.outlet[ends].all(axis=1)
    return _pair_up(mesh, kept & ~given, free=data.shut[:, 0])


def stream_bubbles(mesh: NestedMesh, data: CellContact, kept: np.ndarray) -> np.ndarray:
    """The same for ψ: given on side walls, constant in closed cells, no hat on power traces."""
    usable = kept & ~data.closed & ~data.contact.any(axis=1) & ~mesh.hypotenuse_on_wall()
    return _pair_up(mesh, usable, free=np.zeros(len(kept), dtype=bool))


def _pair_up(mesh: NestedMesh, usable: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Number the hypotenuses that all their cells can use and see as hypotenuse.

    free : (C,) bool, cells whose hypotenuse does not tie them to a neighbour
    """
    _, of_cell = mesh.edges
    hypotenuse, count = of_cell[:, 0], int(of_cell.max()) + 1
    # At the depth of the integer coordinates there is no middle to stand on.
    usable = usable & mesh.can_halve()
    needed = np.bincount(of_cell.ravel(), minlength=count)
    able = np.bincount(hypotenuse, usable, minlength=count)
    bubble = np.where(usable & (able == needed)[hypotenuse], hypotenuse, np.int32(-1))
    own = np.flatnonzero(usable & free)
    bubble[own] = count + own
    return bubble


@dataclass(frozen=True, eq=False)
class Sharpening:
    """One energy ∫ c |∇v|² that bubbles shall lower.

    bubble : (C,), from `pressure_bubbles` or `stream_bubbles`
    corner_values : of v, (n, 3), on n cells with a bubble
    coefficient : c of the cells
    """

    bubble: np.ndarray
    corner_values: Callable[[np.ndarray], np.ndarray]
    coefficient: Callable[[CellData], np.ndarray]


def energy_drops(
    gap: LinearGap | ConstantGap | VertexGap,
    mesh: NestedMesh | TriangleMesh,
    values: np.ndarray,
    energies: Sequence[Sharpening],
) -> list[float]:
    """How much the best bubbles lower each of some energies on one mesh.

    Parameters
    ----------
    gap, mesh, values : the gap, the mesh and the gap at its vertices
    energies : what is to be lowered; all share the averages on the halves
    """
    drops = np.zeros(len(energies))
    # A batch at a time: the halves of all cells at once would be the most memory of all.
    for cells in _batches(mesh, np.any([e.bubble >= 0 for e in energies], axis=0)):
        data, hat, area = _halves(gap, mesh, values, cells)
        slopes, _ = shape_gradients(mesh.points(gap.aspect, mesh.cells[cells]))
        for k, energy in enumerate(energies):
            bubble, weight = energy.bubble[cells], area * energy.coefficient(data)
            has_one = np.flatnonzero(bubble >= 0)
            v = np.zeros((len(cells), 2))
            v[has_one] = gradients(slopes[has_one], energy.corner_values(cells[has_one]))
            a, b = (
                (weight * np.einsum("cd,cd->c", w, hat)).reshape(2, -1).sum(axis=0)[has_one]
                for w in (np.tile(v, (2, 1)), hat)
            )
            drops[k] += _drop(bubble[has_one], a, b)
    return drops.tolist()


def _batches(mesh: NestedMesh | TriangleMesh, wanted: np.ndarray) -> Iterator[np.ndarray]:
    """Indices of the wanted cells (C,), those that share a hypotenuse together."""
    _, of_cell = mesh.edges
    cells = np.flatnonzero(wanted)
    hypotenuse = of_cell[cells, 0]
    order = stable_order(hypotenuse, int(of_cell.max()) + 1)
    cells, hypotenuse = cells[order], hypotenuse[order]
    cuts = np.arange(_AT_ONCE, len(cells), _AT_ONCE)
    yield from np.split(cells, cuts + (hypotenuse[cuts] == hypotenuse[cuts - 1]))


def _drop(bubble: np.ndarray, coupling: np.ndarray, stiffness: np.ndarray) -> float:
    """Σ a(v, φ)² / a(φ, φ) from what each cell (n,) adds to its bubble, the next to the last's."""
    if not len(bubble):
        return 0.0
    first = np.flatnonzero(np.diff(bubble, prepend=-1))
    a, b = (np.add.reduceat(of_cell, first) for of_cell in (coupling, stiffness))
    # Not a²/b: the square may be beyond double precision.
    return float((a[b > 0] * (a[b > 0] / b[b > 0])).sum())


def _halves(
    gap: LinearGap | ConstantGap | VertexGap,
    mesh: NestedMesh | TriangleMesh,
    values: np.ndarray,
    cells: np.ndarray,
) -> tuple[CellData, np.ndarray, np.ndarray]:
    """Both halves of each cell, one after the other: data, gradient of the hat, area."""
    halves, ends = mesh.halves(cells)
    at_corners = values[mesh.cells[cells].T.ravel()]
    data = gap.cell_data(halves, gap.refined_values(at_corners, halves, ends))
    hat, area = shape_gradients(halves.points(gap.aspect)[halves.cells])
    return data, hat[:, 0], area
