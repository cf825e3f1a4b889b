"""Sharper bounds for the price of arithmetic: the exact minimum over the hypotenuse bubbles.

Take the hat function of the middle of a hypotenuse on the two halves of each of its two cells.
Hats of different hypotenuses share no cell, so that the minimum of an energy over all of them,
added to a given function v, is explicit: each bubble φ lowers it by a(v, φ)²/a(φ, φ). The result
is an admissible function on the mesh of halves, hence a bound, and no larger system was solved.
"""

import numpy as np

from fem_seal.flow.gap_on_mesh import CellData, ConstantGap, LinearGap
from fem_seal.mesh.nested import PIXEL, NestedMesh


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


def pressure_bubbles(mesh: NestedMesh, data: CellData, kept: np.ndarray) -> np.ndarray:
    """Bubble of each cell (C,) of the mesh, -1 for none: the pressure is given on inlet and outlet.

    A shut hypotenuse parts its cells, and each has a bubble of its own.
    """
    ends = mesh.cells[:, 1:]
    given = mesh.inlet[ends].all(axis=1) | mesh.outlet[ends].all(axis=1)
    return _pair_up(mesh, kept & ~given, free=data.shut[:, 0])


def stream_bubbles(mesh: NestedMesh, data: CellData, kept: np.ndarray) -> np.ndarray:
    """The same for ψ: given on side walls, constant in closed cells, no hat on power traces."""
    ends = mesh.cells[:, 1:]
    wall = (mesh.bottom[ends].all(axis=1) | mesh.top[ends].all(axis=1)) & (not mesh.periodic)
    usable = kept & ~data.closed & ~data.contact.any(axis=1) & ~wall
    return _pair_up(mesh, usable, free=np.zeros(len(kept), dtype=bool))


def _pair_up(mesh: NestedMesh, usable: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Number the hypotenuses that all their cells can use and see as hypotenuse.

    free : (C,) bool, cells whose hypotenuse does not tie them to a neighbour
    """
    _, of_cell = mesh.edges
    hypotenuse, count = of_cell[:, 0], int(of_cell.max()) + 1
    # At the depth of the integer coordinates there is no middle to stand on.
    usable = usable & (mesh.xy[mesh.cells[:, 1:]].sum(axis=1) % 2 == 0).all(axis=1)
    needed = np.bincount(of_cell.ravel(), minlength=count)
    able = np.bincount(hypotenuse, usable, minlength=count)
    bubble = np.where(usable & (able == needed)[hypotenuse], hypotenuse, -1)
    own = np.flatnonzero(usable & free)
    bubble[own] = count + own
    return bubble


def energy_drop(
    gap: LinearGap | ConstantGap,
    mesh: NestedMesh,
    values: np.ndarray,
    bubble: np.ndarray,
    gradient: np.ndarray,
    coefficient: str,
) -> float:
    """How much the best bubbles lower ∫ c |∇v|².

    Parameters
    ----------
    gap, mesh, values : the gap, the mesh and the gap at its vertices
    bubble : (C,), from `pressure_bubbles` or `stream_bubbles`
    gradient : (C, 2), of v on each cell
    coefficient : "K" or "resistivity"
    """
    cells = np.flatnonzero(bubble >= 0)
    a, b, c = mesh.cells[cells].T
    middle = len(mesh.xy) + np.arange(len(cells))
    halves = NestedMesh(
        np.concatenate([mesh.xy, (mesh.xy[b] + mesh.xy[c]) // 2]),
        np.concatenate([np.stack([middle, a, b], 1), np.stack([middle, c, a], 1)]),
        mesh.squares,
        np.concatenate([mesh.twin, middle]),
    )
    ends = np.stack([b, c], axis=1)
    data = gap.cell_data(halves, gap.refined_values(values, halves, ends))
    c = data.K if coefficient == "K" else data.resistivity[:, 0]
    hat, area = shape_gradients(halves.xy[halves.cells] / PIXEL * gap.aspect)
    hat, v = hat[:, 0], np.tile(gradient[cells], (2, 1))
    number = np.tile(bubble[cells], 2)
    coupling = np.bincount(number, area * c * (v * hat).sum(axis=1))
    stiffness = np.bincount(number, area * c * (hat * hat).sum(axis=1))
    used = stiffness > 0
    return float((coupling[used] ** 2 / stiffness[used]).sum())
