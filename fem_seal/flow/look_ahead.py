"""Refine the marked cells, and at once those parts of them that the next solves would mark.

A solve marks cells, but does not show where inside them fluid will flow. Near percolation the next
solve would mark one half of a marked blocked cell, the solve after it one half of that, and so on
down to the pixel. Here each new vertex gets the value of ψ that minimises the energy while all
other vertices keep theirs. With these values and the averages on the new cells, the cells that the
next solve would mark are halved at once.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.flow.cell_data import CellData
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.flow.marking import Marks
from fem_seal.flow.solution import FlowEstimate, Start
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.grouping import parts

# Part of the smallest marked indicator above which a new cell is marked. Without a pressure only a
# lower limit of its indicator is known. Of 1, 0.5 and 0.25, 0.5 took the least time and the fewest
# unknowns.
_PART = 0.5


def refined_ahead(
    start: Start,
    gap: GapOnMesh,
    marks: Marks,
    flows: Sequence[FlowEstimate],
    times: int,
) -> Start:
    """Refine by marks, and so many times further ahead of the next solve.

    At new vertices each ψ of the result is better than its linear interpolation. The stream
    functions of the flows, from which the marks come, are those of the start, or combinations of
    them. Without flows, as where all cells are marked, nothing shows what lies ahead.
    """
    before = len(start.mesh.xy)
    start = start.refined(gap, marks.times)
    for _ in range(times if flows else 0):
        new = np.flatnonzero((start.mesh.cells >= before).any(axis=1))
        mesh = start.mesh.subset(new)
        data = gap.cell_data(mesh, start.values)
        new_cells = _NewCells(mesh, gap.aspect, data, data.regularised(flows[0].chi, gap.cut))
        # On walls ψ is prescribed or constant; on a seam two vertices share one value.
        free = (np.arange(len(start.mesh.xy)) >= before) & ~start.mesh.rim
        streams = np.stack([new_cells.relaxed(psi, free) for psi in start.streams])
        once = np.zeros(len(start.mesh.cells), dtype=np.int8)
        once[new] = new_cells.marked(streams, flows, marks)
        start, before = replace(start, streams=streams), len(start.mesh.xy)
        if not once.any():
            break
        start = start.refined(gap, once)
    return start


def least_indicator(turned: np.ndarray, K: np.ndarray, tensor: np.ndarray) -> np.ndarray:
    """Minimum (n,) of Q² ∇ψ·R ∇ψ + K|∇p|² + 2 J·∇p over all pressures, at ∇p = -J/K.

    `turned` (n, 2) is Q ∇ψ, the flux J = Q (∂ψ/∂y, -∂ψ/∂x) turned by a right angle; the tensor R is
    (n, 3). The minimum is Q² ∇ψ·R ∇ψ - |J|²/K; where K is zero the last term is left out. On cells
    with power traces the mean of J differs from that of `turned`, and the result is an estimate.
    """
    (tx, ty), (xx, xy, yy) = turned.T, tensor.T
    conducting = np.where(K > 0, K, np.inf)
    # Not the square first: it may underflow.
    along_x = tx * (xx * tx + 2 * xy * ty - tx / conducting)
    return along_x + ty * (yy * ty - ty / conducting)


@dataclass(frozen=True, eq=False)
class _NewCells:
    """The n cells at new vertices, visited in batches to save memory."""

    mesh: AnyMesh  #: mesh of these cells, with all vertices
    aspect: np.ndarray | float  #: aspect of a pixel
    data: CellData  #: data of the cells
    tensor: np.ndarray  #: (n, 3), resistivity of the regularised dual

    def _parts(self) -> Iterator[tuple[slice, np.ndarray, np.ndarray, np.ndarray]]:
        for part in parts(0, len(self.mesh.cells), AT_ONCE):
            cells = self.mesh.cells[part]
            yield part, cells, *shape_gradients(self.mesh.corners(self.aspect, cells))

    def relaxed(self, psi: np.ndarray, free: np.ndarray) -> np.ndarray:
        """ψ (V,) with each `free` vertex (V,) at its best value if all others stay."""
        of_corner = np.empty((2, *self.mesh.cells.shape))
        for part, cells, slopes, areas in self._parts():
            xx, xy, yy = (areas * self.tensor[part].T)[:, :, None]
            sx, sy = slopes[..., 0], slopes[..., 1]
            jx, jy = xx * sx + xy * sy, xy * sx + yy * sy
            gx, gy = gradients(slopes, psi[cells]).T[:, :, None]
            of_corner[:, part] = jx * sx + jy * sy, jx * gx + jy * gy
        corners = self.mesh.cells.ravel()
        own, slope = (np.bincount(corners, part.ravel(), len(psi)) for part in of_corner)
        return psi - np.divide(slope, own, out=np.zeros_like(psi), where=free & (own > 0))

    def marked(
        self, streams: np.ndarray, flows: Sequence[FlowEstimate], marks: Marks
    ) -> np.ndarray:
        """Cells (n,) bool that a solve with these stream functions (k, V) would mark."""
        of_flow = [flow.weights @ streams for flow in flows]
        again = np.empty(len(self.mesh.cells), dtype=bool)
        for part, cells, slopes, areas in self._parts():
            flux, indicator = np.zeros((2, len(cells)))
            for flow, psi in zip(flows, of_flow, strict=True):
                turned = flow.rate * gradients(slopes, psi[cells])
                flux += flow.drop * np.hypot(*turned.T) * np.sqrt(2 * areas)
                indicator += areas * least_indicator(turned, self.data.K[part], self.tensor[part])
            again[part] = self.data.blocked[part] & (flux >= marks.least_flux)
            again[part] |= indicator >= _PART * marks.least_indicator
        return again & (self.data.K > 0)
