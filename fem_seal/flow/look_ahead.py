"""Refine the marked cells, and at once those parts of them that the next solves would mark.

A solve marks cells, but does not show where inside them fluid will flow. Next to closing the next
solve would mark one half of a marked blocked cell, the solve after it one half of that, and so on
down to the pixel. Here each new vertex gets the value of ψ that minimises the energy while all
other vertices keep theirs. With these values and the averages on the new cells, the cells that the
next solve would mark are halved at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.flow.cell_data import CellData
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.marking import Marks
from fem_seal.flow.solution import Flux, Start

# Part of the smallest marked indicator above which a new cell is marked. Without a pressure only a
# lower limit of its indicator is known. Of 1, 0.5 and 0.25, 0.5 took the least time and the fewest
# unknowns.
_PART = 0.5


def refined_ahead(
    start: Start,
    gap: GapOnMesh,
    marks: Marks,
    fluxes: Sequence[Flux],
    times: int,
) -> Start:
    """Refine by marks, and so many times further ahead of the next solve.

    At new vertices each ψ of the result is better than its linear interpolation. The stream
    functions of the fluxes, from which the marks come, are those of the start, or combinations of
    them. Without fluxes, as where all cells are marked, nothing shows what lies ahead.
    """
    before = len(start.mesh.xy)
    start = start.refined(gap, marks.times)
    for _ in range(times if fluxes else 0):
        new = np.flatnonzero((start.mesh.cells >= before).any(axis=1))
        mesh = start.mesh.subset(new)
        data = gap.cell_data(mesh, start.values)
        shape = shape_gradients(mesh.corners(gap.aspect, mesh.cells))
        new_cells = _NewCells(mesh.cells, data, data.regularised(fluxes[0].chi, gap.cut), *shape)
        # On walls ψ is prescribed or constant; on a seam two vertices share one value.
        free = (np.arange(len(start.mesh.xy)) >= before) & ~start.mesh.rim
        streams = np.stack([new_cells.relaxed(psi, free) for psi in start.streams])
        once = np.zeros(len(start.mesh.cells), dtype=np.int8)
        once[new] = new_cells.marked(streams, fluxes, marks)
        start, before = replace(start, streams=streams), len(start.mesh.xy)
        if not once.any():
            break
        start = start.refined(gap, once)
    return start


def least_indicator(turned: np.ndarray, K: np.ndarray, tensor: np.ndarray) -> np.ndarray:
    """Minimum (n,) of Q² ∇ψ·R ∇ψ + K|∇p|² + 2 j·∇p over all pressures, at ∇p = -j/K.

    `turned` (n, 2) is Q ∇ψ, the flux j = Q (∂ψ/∂y, -∂ψ/∂x) turned by a right angle; the tensor R is
    (n, 3). The minimum is Q² ∇ψ·R ∇ψ - |j|²/K; where K is zero the last term is left out. On cells
    with power traces the mean of j differs from that of `turned`, and the result is an estimate.
    """
    (tx, ty), (xx, xy, yy) = turned.T, tensor.T
    conducting = np.where(K > 0, K, np.inf)
    # Not the square first: it may underflow.
    along_x = tx * (xx * tx + 2 * xy * ty - tx / conducting)
    return along_x + ty * (yy * ty - ty / conducting)


@dataclass(frozen=True, eq=False)
class _NewCells:
    """The n cells at new vertices."""

    cells: np.ndarray  #: (n, 3), vertices
    data: CellData
    tensor: np.ndarray  #: (n, 3), resistivity of the regularised dual
    slopes: np.ndarray  #: (n, 3, 2), gradients of the shape functions
    areas: np.ndarray  #: (n,)

    def relaxed(self, psi: np.ndarray, free: np.ndarray) -> np.ndarray:
        """ψ (V,) with each `free` vertex (V,) at its best value if all others stay."""
        xx, xy, yy = (self.areas * self.tensor.T)[:, :, None]
        sx, sy = self.slopes[..., 0], self.slopes[..., 1]
        jx, jy = xx * sx + xy * sy, xy * sx + yy * sy
        gx, gy = gradients(self.slopes, psi[self.cells]).T[:, :, None]
        of_corner = jx * sx + jy * sy, jx * gx + jy * gy
        corners = self.cells.ravel()
        own, slope = (np.bincount(corners, part.ravel(), len(psi)) for part in of_corner)
        return psi - np.divide(slope, own, out=np.zeros_like(psi), where=free & (own > 0))

    def marked(self, streams: np.ndarray, fluxes: Sequence[Flux], marks: Marks) -> np.ndarray:
        """Cells (n,) bool that a solve with these stream functions (k, V) would mark."""
        total, indicator = np.zeros((2, len(self.cells)))
        for flux in fluxes:
            psi = flux.weights @ streams
            turned = flux.rate * gradients(self.slopes, psi[self.cells])
            total += flux.drop * np.hypot(*turned.T) * np.sqrt(2 * self.areas)
            indicator += self.areas * least_indicator(turned, self.data.K, self.tensor)
        again = self.data.blocked & (total >= marks.least_flux)
        again |= indicator >= _PART * marks.least_indicator
        return again & (self.data.K > 0)
