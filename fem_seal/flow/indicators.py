"""What shows where a mesh is too coarse: error indicators, blocked flux, and jumps of the flux."""

from collections.abc import Sequence

import numpy as np

from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.level import LevelProblem
from fem_seal.flow.solution import FlowEstimate
from fem_seal.flow.traces import mean_gradient_values


def error_indicators(problem: LevelProblem, flows: Sequence[FlowEstimate]) -> np.ndarray:
    """Error indicators e_T (C,): the part of each cell in upper - lower (Prager and Synge).

    e_T = ∫_T (K|∇p|² + Q² ∇ψ·R ∇ψ + 2 j·∇p) >= 0 with the flux j = Q (∂ψ/∂y, -∂ψ/∂x), summed
    over the flows. For the true dual of a leak rate Σ e_T = upper - lower exactly. For the
    regularised dual the sum is off by about 1e-4, since ψ in blocked cells does not match the
    power traces of their neighbours.
    """
    indicators = np.zeros(problem.space.count)
    for cells, slopes, areas in problem.batches():
        K, contact = problem.data.K[cells], problem.data.contact_vertex[cells]
        xx, xy, yy = problem.resistivity(flows[0].flux.chi, cells).T
        for flow in flows:
            px, py = gradients(slopes, flow.pressure(cells)).T
            psi, Q = flow.stream[problem.cells[cells]], flow.flux.rate
            sx, sy = gradients(slopes, psi).T
            mx, my = gradients(slopes, mean_gradient_values(psi, contact)).T
            primal = K * (px * px + py * py)
            # Not Q² first: it may underflow.
            dual = Q * (Q * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy))
            indicators[cells] += areas * (primal + dual + 2 * Q * (my * px - mx * py))
    return indicators


def blocked_fluxes(problem: LevelProblem, flows: Sequence[FlowEstimate]) -> np.ndarray:
    """Σ |j| × width × pressure drop of each blocked cell (C,); zero in all other cells."""
    flux, blocked = np.zeros(problem.space.count), np.flatnonzero(problem.data.blocked)
    slopes, areas = shape_gradients(problem.corners(blocked))
    for flow in flows:
        steepness = np.linalg.norm(gradients(slopes, flow.stream[problem.cells[blocked]]), axis=1)
        flux[blocked] += flow.flux.drop * flow.flux.rate * steepness * np.sqrt(2 * areas)
    return flux


def flux_residuals(problem: LevelProblem, flows: Sequence[FlowEstimate]) -> np.ndarray:
    """Residual estimate (C,) of the pressures' error: Σ over sides (jump of the flux)²/K.

    The flux of the exact pressure is continuous across sides and zero through walls and along
    contact. The jump is divided by the K of the cell itself, not by the larger K of the two
    cells: this keeps the estimate reliable where good conductors touch at a single vertex
    (C. Bernardi and R. Verfürth, Numer. Math. 85, 579 (2000); M. Petzoldt, Adv. Comput. Math.
    16, 47 (2002)). There a linear pressure lets fluid leak through the vertex at almost no
    cost in energy. The smallest K to divide by is the conductance of the flow.
    """
    residuals = np.zeros(problem.space.count)
    side = problem.mesh.edges.of_cell.compress(problem.kept, axis=0)
    for flow in flows:
        out = np.empty((problem.space.count, 3))  # flux out of each cell through its sides
        for cells, slopes, areas in problem.batches():
            weight = -2 * areas * problem.data.K[cells]
            slope = gradients(slopes, flow.pressure(cells))
            out[cells] = weight[:, None] * (slopes * slope[:, None]).sum(axis=2)
        jump = np.bincount(side.ravel(), out.ravel())[side]
        jump[problem.data.zero_gap] = out[problem.data.zero_gap]
        # No condition on the flux through sides of prescribed pressure.
        a, b, c = (problem.primal_numbering.of_corner < 0).T
        jump[np.stack([b & c, c & a, a & b], axis=1)] = 0.0
        residuals += (jump * jump).sum(axis=1) / np.maximum(problem.data.K, flow.flux.conductance)
    return residuals
