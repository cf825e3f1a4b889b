"""The flow on the last mesh in SI units, its points parted where the pressure jumps."""

import numpy as np

from fem_seal.film import Film, GridFilm
from fem_seal.flow.energy import gradients, shape_gradients
from fem_seal.flow.families import Pressures
from fem_seal.flow.level import LevelProblem, LevelSolution
from fem_seal.flow.traces import mean_gradient_values
from fem_seal.leak_rate import FacetTag, FlowField
from fem_seal.mesh.mesh import end_slots, ends_of_sides, find_edges


def flow_field(solution: LevelSolution, film: Film, pressure_drop: float, rate: float) -> FlowField:
    """Gap, pressure and flux of a solution.

    `rate` is the leak rate [m³/s] in which the problem is written, `pressure_drop` is in Pa.
    """
    problem, (pressure,) = solution.problem, solution.pressure.minima
    flux = -problem.data.K[:, None] * problem.gradients(pressure.corner_values)
    if solution.stream is not None:
        # Where the pressure was taken to be constant, take the flux from the stream function.
        equipotential = problem.data.equipotential
        psi = mean_gradient_values(
            solution.stream.psi[0][problem.cells], problem.data.contact_vertex
        )
        dx, dy = problem.gradients(psi)[equipotential].T
        flux[equipotential] = solution.stream.conductance * np.stack([dy, -dx], axis=1)
    number, first = parted_points(problem)
    vertex, mesh = problem.cells.ravel()[first], problem.mesh
    spacing = np.array(film.gap.spacing) if isinstance(film, GridFilm) else None
    return FlowField(
        points=(mesh.xy if spacing is None else mesh.points(spacing))[vertex],
        cells=number,
        gap=film.largest_gap * problem.vertex_gap[vertex],
        pressure=pressure_drop * pressure.corner_values.ravel()[first],
        flux=flux * rate / length_unit(film),
        facet_tags=facet_tags(problem, number),
    )


def length_unit(film: Film) -> float:
    """Length [m] in which the normalised problem is written."""
    return max(film.gap.spacing if isinstance(film, GridFilm) else film.size)


def parted_points(problem: LevelProblem) -> tuple[np.ndarray, np.ndarray]:
    """Number (C, 3) of the point at each corner, and one corner of each point, as 3 cell + k.

    A vertex is one point for each pressure that the cells have there.
    """
    numbering = problem.primal_numbering
    # Label of the pressure: unknowns count from 2, the outlet has 1, the inlet 0.
    pressure = numbering.of_corner - numbering.offset + 2
    key = problem.cells.astype(np.int64) * (numbering.count + 2) + pressure
    _, corner, point = np.unique(key.ravel(), return_index=True, return_inverse=True)
    return point.reshape(-1, 3), corner


def facet_tags(problem: LevelProblem, points: np.ndarray) -> np.ndarray:
    """`FacetTag` (C, 3) of the side opposite each corner, INSIDE where two cells share a side.

    `points` (C, 3) are those of the corners, of `parted_points`.
    """
    mesh, sides = problem.mesh, problem.mesh.edges.slots()
    flows = np.zeros((len(problem.kept) + 1, 3), dtype=bool)  # the last row is outside, slot -1
    flows[:-1][problem.kept] = ~problem.data.zero_gap
    alone = sides[:, 1] < 0
    through = flows.ravel()[sides[:, 0]] & (alone | flows.ravel()[sides[:, 1]])
    tags = np.full(3 * len(problem.kept), FacetTag.CONTACT, dtype=np.int8)
    on_seam = mesh.sides_on_top().ravel()[sides].any(axis=1) & ~alone
    tags[sides[through & ~alone]] = FacetTag.INSIDE
    tags[sides[through & on_seam]] = FacetTag.SEAM
    side = sides[through & alone, 0]
    ends = mesh.cells.ravel()[end_slots(side)]
    at_inlet, at_outlet = (end[ends].all(axis=1) for end in (mesh.inlet, mesh.outlet))
    tags[side] = np.select([at_inlet, at_outlet], [FacetTag.INLET, FacetTag.OUTLET], FacetTag.WALL)
    tags = tags.reshape(-1, 3)[problem.kept]
    # A contact line of a single side has the same two points on both of its sides.
    edges = find_edges(ends_of_sides(points)).of_cell
    tags[np.bincount(edges.ravel())[edges] == 2] = FacetTag.INSIDE
    return tags


def boundary_flows(problem: LevelProblem, pressure: Pressures) -> tuple[float, float]:
    """Inflow and outflow from the residuals of the discrete equations at inlet and outlet."""
    prescribed = problem.primal_numbering.of_corner < 0
    inlet = problem.primal_numbering.offset
    at_ends = np.flatnonzero(prescribed.any(axis=1))
    sides = inlet[at_ends], (prescribed & (inlet == 0))[at_ends]
    slopes, areas = shape_gradients(problem.corners(at_ends))
    slope = gradients(slopes, pressure.minima[0].corners(at_ends))
    weight = areas * problem.data.K[at_ends]
    into, out = (
        (weight * (slope * gradients(slopes, side.astype(float))).sum(axis=1)).sum()
        for side in sides
    )
    return float(into), float(-out)
