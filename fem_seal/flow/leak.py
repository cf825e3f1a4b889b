"""The leak rate of a gap with its bounds, in SI units."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fem_seal.errors import InvalidInput, present
from fem_seal.fenicsx import MPI, explained_compilation
from fem_seal.film import Film, GridFilm, MeshFilm, film_conductivity, require_film
from fem_seal.film.law import CUBE, FilmLaw, leak_rate_of_square
from fem_seal.flow.adapt import refined, unchanged
from fem_seal.flow.film_on_mesh import LevelSolution, Start
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, GapOnMesh, VertexGap
from fem_seal.flow.level import LevelProblem
from fem_seal.flow.marking import Strategy, Tuning
from fem_seal.flow.nearby import MeshedFlow
from fem_seal.flow.slipping import SlippingFilm
from fem_seal.flow.stopping import Decision, SolvedLevel, Stopping, Tolerance
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField, LeakRate, Level
from fem_seal.limits import USUAL_GROWTH, Limits
from fem_seal.mesh.bisection import AnyMesh
from fem_seal.mesh.nested import coarsest_width, uniform_mesh
from fem_seal.registry import require_known, require_positive

METHODS = ("adaptive", "uniform")
NARROWEST = 1e-60  # smallest critical constriction, as a part of the largest gap


@explained_compilation()
def leak_rate(
    film: Film,
    *,
    viscosity: float,
    pressure_drop: float,
    slip: Slip | None = None,
    method: str = "adaptive",
    rtol: float = 0.05,
    decide: float | None = None,
    margin: float = 0.0,
    limits: Limits | None = None,
    progress: Callable[[Level], None] | None = None,
    field: bool = False,
    every_dual: bool = False,
    tuning: Tuning | None = None,
    start: Start | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    keep: Callable[[MeshedFlow], None] | None = None,
) -> LeakRate:
    """Leak rate of a film with guaranteed bounds, refined until they agree.

    Dirichlet's and Thomson's principles on the same mesh give Q_hi = ∫K|∇p|² and
    Q_lo = 1/∫|∇ψ|²/K with exact cell averages of K = g³/(12 η) and 1/K, so that the leak rate of
    the gap as represented lies between them whatever the mesh and the solver tolerance.

    Parameters
    ----------
    film : a gap on a grid with its sides (flow along the first axis), or on the mesh of a shape,
        which is refined as it is
    viscosity : η [Pa s]
    pressure_drop : p_in - p_out [Pa]; for a gas that of the liquid that leaks as much without slip
    slip : slip of a gas at the walls; None if there is none
    method : "adaptive" or "uniform" (the pixel or given mesh and its uniform refinements)
    rtol : stop when upper - lower ≤ rtol √(lower upper); for a gas that slips this holds for the
        bounds at the mean pressure, since no mesh closes the rest
    decide : in place of rtol, a leak rate [m³/s]: stop when it does not lie between the bounds
    margin : error of ln Q beside the bounds, such as that of the lift; it widens them for `decide`
    limits : limits on unknowns, time and memory; if one ends the refinement, the result has
        `converged` False and a `reason`
    progress : called with every Level, in m³/s
    field : keep the flow on the last mesh
    every_dual : compute bounds from both sides on every level, to show how they close
    tuning : parameters that change the cost of the bounds, never their validity
    start : mesh and functions to begin with, those of the flow through another film on one grid;
        for the adaptive method
    comm : all its ranks must call this together, with the same film
    keep : called with the flow on the last mesh, for starts and bounds of other films on the same
        grid; not called if a limit ends the refinement between two meshes

    Raises
    ------
    InvalidInput
        If a value is out of range, or `film` is not a film.
    Inconsistent
        If the bounds cross, which would be a defect.

    Notes
    -----
    Where the linear solver cannot reach its tolerance, the functions it has reached still give
    bounds; they are returned, with `converged` False if they are further apart than asked for.
    """
    require_positive(viscosity=viscosity, pressure_drop=pressure_drop, rtol=rtol)
    if decide is not None:
        require_positive(decide=decide)
    require_known(METHODS, method, "method")
    require_film(film, (GridFilm, MeshFilm))
    if film.sealed:
        return LeakRate.sealed(method)
    scale = leak_rate_of_square(film.highest, viscosity, pressure_drop)
    critical = present(film.constriction, "constriction").gap
    slipping = None if slip is None else SlippingFilm(slip, film.highest, critical)
    slip_factor = slipping.slip_factor if slipping else 1.0
    scale *= slip_factor
    criterion = Tolerance(rtol) if decide is None else Decision(decide, scale, margin)
    narrowest = critical / film.highest
    require_conducting("the critical constriction", narrowest)
    stopping = Stopping(
        criterion,
        limits or Limits(),
        growth=4.0 if method == "uniform" else USUAL_GROWTH,
        narrowest=narrowest,
        comm=comm,
        advice=(
            f" (the critical constriction is {narrowest:.0e} of the largest gap: set such gaps to "
            "0 if they are contact)"
        ),
    )
    # A mesh of a similar film is likely to be fine enough: solve the dual on it at once.
    strategy = Strategy(
        uniform=method == "uniform",
        rtol=criterion.rtol,
        every_dual=every_dual or decide is not None or stopping.doubtful or start is not None,
        max_unknowns=stopping.limits.unknowns,
        tuning=tuning or Tuning(),
    )
    coarsest = None if strategy.uniform else strategy.tuning.coarsest
    law = slipping.mean_law if slipping else CUBE
    gap, mesh = first_mesh(film, narrowest, strategy.tuning, coarsest, law)

    def make_problem(mesh: AnyMesh, values: np.ndarray) -> LevelProblem:
        return LevelProblem(gap, mesh, values, comm, strategy.tuning.tolerance)

    start = Start.first(gap, mesh) if start is None else start.through(gap)
    widen = slipping.widened if slipping else unchanged
    levels: list[Level] = []
    for solution in refined(make_problem, start, strategy, stopping, widen):
        levels.append(_in_si(solution.level, scale))
        if progress is not None:
            progress(levels[-1])
        result = _result(solution, levels, method, scale)
        drawn = _field(solution, film, viscosity, pressure_drop, slip_factor) if field else None
        if keep is not None and stopping.ended and isinstance(film, GridFilm):
            keep(MeshedFlow(film, solution, slip_factor))
        # Free this mesh before the next one is made.
        del solution
    reason = stopping.reason
    if reason:
        missed = result.refined_bounds if decide is None else result.bounds
        reason = f"{reason}; {criterion.missed(*missed)}"
    return replace(result, converged=not reason, reason=reason, field=drawn)


def require_conducting(tightest: str, narrowest: float) -> None:
    """Raise InvalidInput if the cube of smallest gap over largest leaves double precision."""
    if narrowest < NARROWEST:
        raise InvalidInput(
            f"{tightest} is {narrowest:.0e} of the largest gap; its cube is beyond double "
            f"precision below {NARROWEST:.0e}: set such gaps to 0 if they are contact"
        )


def first_mesh(
    film: Film, narrowest: float, tuning: Tuning, coarsest: int | None, law: FilmLaw
) -> tuple[GapOnMesh, AnyMesh]:
    """Gap in units of its maximum, as the narrowest one is, and the first mesh.

    `coarsest` squares lie along the shorter side of the first mesh on a grid; None: those of its
    pixels. A shape begins with the mesh that it has.
    """
    cut, floor, ceiling = (narrowest * p for p in (tuning.cut, tuning.floor, tuning.ceiling))
    if isinstance(film, MeshFilm):
        # Pockets may stay: the gap is linear on each cell, so no cell joins a pocket to a channel.
        scaled = film.values / film.highest
        return VertexGap(scaled, length_unit(film), cut, floor, ceiling, law), film.mesh
    # Treat pockets as contact: nothing flows in them, but a coarse cell that covers parts of a
    # pocket and of a channel would seem to conduct.
    scaled = np.where(film.carrying, film.samples / film.highest, 0.0)
    # Linear gaps live on the pixels between samples, one fewer along each axis.
    linear = film.representation == "linear"
    squares = scaled.shape[0] - linear, scaled.shape[1] - linear
    width = 1 if coarsest is None else coarsest_width(squares, coarsest)
    gap_type = REPRESENTATIONS[film.representation]
    gap = gap_type(GridField(scaled, film.gap.spacing), cut, floor, width, ceiling, law)
    return gap, uniform_mesh(gap.squares, width, film.sides == "periodic")


def length_unit(film: Film) -> float:
    """Length [m] in which the normalised problem is written."""
    if isinstance(film, GridFilm):
        return max(film.gap.spacing)
    return float(np.ptp(film.mesh.xy, axis=0).max())


def points_of(film: Film, mesh: AnyMesh) -> np.ndarray:
    """Vertex coordinates (V, 2) [m] of a mesh that refines the first mesh of a film."""
    return mesh.points(np.array(film.gap.spacing)) if isinstance(film, GridFilm) else mesh.xy


def _in_si(level: SolvedLevel, scale: float) -> Level:
    lower, upper = (bound * scale for bound in level.bounds)
    return Level(level.unknowns, level.cells, lower, upper, level.iterations, level.seconds)


def _result(solution: LevelSolution, levels: list[Level], method: str, scale: float) -> LeakRate:
    lower, upper = levels[-1].lower, levels[-1].upper
    interval = None
    if solution.slip is not None:
        interval = solution.slip.over(solution.level.bounds)
        lower, upper = (bound * scale for bound in solution.slip)
    inflow, outflow = solution.problem.boundary_flows(solution.pressure)
    return LeakRate(
        state="leaking",
        method=method,
        # Geometric mean of the bounds, or the upper bound where there is no lower one yet.
        value=lower * float(np.sqrt(upper / lower)) if lower > 0 else upper,
        lower=lower,
        upper=upper,
        unknowns=solution.level.unknowns,
        inflow=inflow * scale,
        outflow=outflow * scale,
        levels=tuple(levels),
        slip_interval=interval,
    )


def _field(
    solution: LevelSolution,
    film: Film,
    viscosity: float,
    pressure_drop: float,
    slip_factor: float,
) -> FlowField:
    """The flow on the mesh of a solution, its points parted where the pressure jumps."""
    problem = solution.problem
    conductivity = slip_factor * film_conductivity(film.highest, viscosity)
    flux = -problem.data.K[:, None] * problem.gradients(solution.pressure.corner_values)
    if solution.stream is not None:
        # Where the pressure was taken to be constant, take the flux from the stream function.
        equipotential = problem.data.equipotential
        flux[equipotential] = problem.flux(solution.stream)[equipotential]
    number, first = problem.parted_points()
    vertex = problem.mesh.cells[problem.kept].ravel()[first]
    return FlowField(
        points=points_of(film, problem.mesh)[vertex],
        cells=number,
        gap=film.highest * problem.vertex_gap[vertex],
        pressure=pressure_drop * solution.pressure.corner_values.ravel()[first],
        flux=flux * conductivity * pressure_drop / length_unit(film),
        facet_tags=problem.facet_tags(number),
    )
