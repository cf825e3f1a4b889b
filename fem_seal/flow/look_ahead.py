"""Refine where a solve has marked cells, and further where the next one would mark their parts.

A solve says which cells to halve, not where in them the flow will pass. Near percolation one half
of a cell with contact would be marked by the next solve, a half of that by the one after it, and so
on down to the pixel. Here ψ takes at each new vertex the value that is best if all others stay:
with it and the averages on the new cells, those that would be marked are halved without a solve.
"""

from dataclasses import replace

import numpy as np

from fem_seal.flow.gap_on_mesh import CellData, ConstantGap, LinearGap, VertexGap
from fem_seal.flow.gradients import gradients, shape_gradients
from fem_seal.flow.level import Stream
from fem_seal.flow.marking import Marks
from fem_seal.flow.start import Start

# A cell is halved again from this part of the smallest marked share on: what is known of its own
# share, without a pressure, is the least that it can be.
_PART = 0.5


def refined_ahead(
    start: Start,
    gap: LinearGap | ConstantGap | VertexGap,
    marks: Marks,
    guide: Stream,
    times: int,
) -> Start:
    """Carry all to the mesh refined by some marks and ahead of them.

    Parameters
    ----------
    start : on the mesh that was solved
    gap : the gap as represented
    marks : of its cells
    guide : the regularised dual that marked them
    times : how often to look ahead at most
    """
    before = len(start.stream)
    start = start.refined(gap, marks.times)
    for _ in range(times):
        new = np.flatnonzero((start.mesh.cells >= before).any(axis=1))
        cells, mesh = start.mesh.cells[new], start.mesh.part(new)
        data = gap.cell_data(mesh, start.values)
        slopes, areas = shape_gradients(mesh.points(gap.aspect, cells))
        tensor = data.regularised(guide.leak, gap.cut)
        psi = _relaxed(start, before, cells, slopes, areas[:, None] * tensor)
        J = guide.conductance * gradients(slopes, psi[cells])
        flow = np.linalg.norm(J, axis=1) * np.sqrt(2 * areas)
        again = data.closed & (flow >= marks.least_flow)
        again |= areas * least_share(J, data, tensor) >= _PART * marks.least_share
        once = np.zeros(len(start.mesh.cells), dtype=np.int8)
        once[new[again & (data.K > 0)]] = 1
        start, before = replace(start, stream=psi), len(psi)
        if not once.any():
            break
        start = start.refined(gap, once)
    return start


def least_share(J: np.ndarray, data: CellData, tensor: np.ndarray) -> np.ndarray:
    """The least that K|∇p|² + J·R·J + 2 J·∇p can be on each cell (n,), whatever the pressure.

    Parameters
    ----------
    J : (n, 2), the gradient of ψ, not turned; tensor : (n, 3), in the axes of that gradient
    """
    (jx, jy), (xx, xy, yy) = J.T, tensor.T
    least = xx * jx * jx + 2 * xy * jx * jy + yy * jy * jy
    return least - np.divide(jx * jx + jy * jy, data.K, out=least.copy(), where=data.K > 0)


def _relaxed(
    start: Start, before: int, cells: np.ndarray, slopes: np.ndarray, tensor: np.ndarray
) -> np.ndarray:
    """ψ (V,) with the best value at each new vertex, if all others stayed as they are.

    Parameters
    ----------
    before : vertices from this number on are new
    cells, slopes : (n, 3), (n, 3, 2), all cells at new vertices, the gradients of their corners'
        shape functions
    tensor : (n, 3), integrals of the resistivity
    """
    psi = start.stream
    xx, xy, yy = tensor.T[:, :, None]
    sx, sy = slopes[..., 0], slopes[..., 1]
    jx, jy = xx * sx + xy * sy, xy * sx + yy * sy
    gx, gy = gradients(slopes, psi[cells]).T[:, :, None]
    own, slope = (
        np.bincount(cells.ravel(), of_corner.ravel(), len(psi))
        for of_corner in (jx * sx + jy * sy, jx * gx + jy * gy)
    )
    free = np.arange(len(psi)) >= before
    # On the side walls ψ is given, and on a seam two vertices are one.
    free &= ~(start.mesh.bottom | start.mesh.top)
    return psi - np.divide(slope, own, out=np.zeros_like(psi), where=free & (own > 0))
