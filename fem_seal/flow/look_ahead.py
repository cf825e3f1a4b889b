"""Refine where a solve has marked cells, and further where the next one would mark their parts.

A solve says which cells to halve, not where in them the flow will pass. Near percolation one half
of a cell with contact would be marked by the next solve, a half of that by the one after it, and so
on down to the pixel. Here ψ takes at each new vertex the value that is best if all others stay:
with it and the averages on the new cells, those that would be marked are halved without a solve.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.flow.gap_on_mesh import CellData, ConstantGap, LinearGap, VertexGap
from fem_seal.flow.gradients import gradients, shape_gradients
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.level import Stream
from fem_seal.flow.marking import Marks
from fem_seal.flow.start import Start
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

# Of the smallest marked share. Without a pressure only the least that a share can be is known, and
# the true one is larger: of 1, 0.5 and 0.25, a half took the least time and the fewest unknowns.
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

    Returns
    -------
    Start, ψ at the new vertices better than linear
    """
    before = len(start.stream)
    start = start.refined(gap, marks.times)
    for _ in range(times):
        new = np.flatnonzero((start.mesh.cells >= before).any(axis=1))
        mesh = start.mesh.part(new)
        data = gap.cell_data(mesh, start.values)
        look = _Look(mesh, gap.aspect, data, data.regularised(guide.leak, gap.cut))
        psi = look.relaxed(start.stream, before, _on_rim(start.mesh))
        once = np.zeros(len(start.mesh.cells), dtype=np.int8)
        once[new] = look.marked(psi, guide.conductance, marks)
        start, before = replace(start, stream=psi), len(psi)
        if not once.any():
            break
        start = start.refined(gap, once)
    return start


def least_share(J: np.ndarray, K: np.ndarray, tensor: np.ndarray) -> np.ndarray:
    """The least that K|∇p|² + J·R·J + 2 J·∇p can be on each cell (n,), whatever the pressure.

    It is so at ∇p = -J/K. On cells with power traces J has another mean, and this is an estimate.

    Parameters
    ----------
    J : (n, 2), the gradient of ψ, not turned, scaled to its leak rate
    K : (n,), mean of g³; where it is zero the share is left out
    tensor : (n, 3), resistivity xx, xy, yy in the axes of that gradient
    """
    (jx, jy), (xx, xy, yy) = J.T, tensor.T
    conducting = np.where(K > 0, K, np.inf)
    # J² alone may be below what double precision holds.
    along_x = jx * (xx * jx + 2 * xy * jy - jx / conducting)
    return along_x + jy * (yy * jy - jy / conducting)


@dataclass(frozen=True, eq=False)
class _Look:
    """All n cells at new vertices, some after the others: their gradients would take most room.

    mesh : these cells, with all vertices
    aspect : of a pixel
    data : of the cells
    tensor : (n, 3), resistivity of the guide
    """

    mesh: NestedMesh | TriangleMesh
    aspect: np.ndarray | float
    data: CellData
    tensor: np.ndarray

    def _parts(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray, np.ndarray]]:
        for part in parts(0, len(self.mesh.cells), AT_ONCE):
            cells = self.mesh.cells[part]
            yield part, cells, *shape_gradients(self.mesh.corners(self.aspect, cells))

    def relaxed(self, psi: np.ndarray, before: int, on_rim: np.ndarray) -> np.ndarray:
        """ψ (V,) with the best value at each vertex from `before` on, if all others stayed.

        on_rim : (V,) bool
        """
        of_corner = np.empty((2, *self.mesh.cells.shape))
        for part, cells, slopes, areas in self._parts():
            xx, xy, yy = (areas * self.tensor[part].T)[:, :, None]
            sx, sy = slopes[..., 0], slopes[..., 1]
            jx, jy = xx * sx + xy * sy, xy * sx + yy * sy
            gx, gy = gradients(slopes, psi[cells]).T[:, :, None]
            of_corner[:, part] = jx * sx + jy * sy, jx * gx + jy * gy
        corners = self.mesh.cells.ravel()
        own, slope = (np.bincount(corners, some.ravel(), len(psi)) for some in of_corner)
        free = np.arange(len(psi)) >= before
        # On walls ψ is given or the same all along, and on a seam two vertices are one.
        free &= ~on_rim
        return psi - np.divide(slope, own, out=np.zeros_like(psi), where=free & (own > 0))

    def marked(self, psi: np.ndarray, conductance: float, marks: Marks) -> np.ndarray:
        """Cells (n,) bool that a solve with this ψ would mark."""
        again = np.empty(len(self.mesh.cells), dtype=bool)
        for part, cells, slopes, areas in self._parts():
            J = conductance * gradients(slopes, psi[cells])
            flow = np.hypot(*J.T) * np.sqrt(2 * areas)
            share = areas * least_share(J, self.data.K[part], self.tensor[part])
            again[part] = self.data.closed[part] & (flow >= marks.least_flow)
            again[part] |= share >= _PART * marks.least_share
        return again & (self.data.K > 0)


def _on_rim(mesh: NestedMesh | TriangleMesh) -> np.ndarray:
    """(V,) bool, vertices on side walls, on islands and on both sides of a seam."""
    on_rim = mesh.bottom | mesh.top
    for pairs in mesh.wall_ties():
        on_rim[pairs] = True
    return on_rim
