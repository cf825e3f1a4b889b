"""The leak rate of a gap with its bounds, in SI units."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fem_seal import parallel
from fem_seal.arguments import choose, require_kind
from fem_seal.errors import InvalidInput, present
from fem_seal.fenicsx import MPI, explained_compilation
from fem_seal.film import Film, GridFilm, MeshFilm, require_film
from fem_seal.film.law import CUBE, FilmLaw, leak_rate_of_square
from fem_seal.flow.adapt import GROWTH, refined
from fem_seal.flow.field import boundary_flows, flow_field, length_unit
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, GapOnMesh, VertexGap
from fem_seal.flow.level import LevelSolution
from fem_seal.flow.marking import REFINEMENTS, Strategy, Tuning
from fem_seal.flow.nearby import MeshedFlow
from fem_seal.flow.slipping import SlippingFilm
from fem_seal.flow.solution import SolvedLevel, Start
from fem_seal.flow.stopping import Decision, Stopping, Tolerance, unchanged
from fem_seal.flow_settings import FlowSettings
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, LevelRecord, middle_of
from fem_seal.limits import USUAL_GROWTH
from fem_seal.mesh.bisection import AnyMesh, coarse_mesh
from fem_seal.mesh.nested import coarsest_width

NARROWEST = 1e-60  # smallest critical constriction, as a part of the largest gap


@explained_compilation()
def leak_rate(
    film: Film,
    settings: FlowSettings,
    *,
    progress: Callable[[LevelRecord], None] | None = None,
    every_dual: bool = False,
    tuning: Tuning | None = None,
    start: Start | None = None,
    comm: parallel.Comm = None,
    keep: Callable[[MeshedFlow], None] | None = None,
) -> LeakRate:
    """Leak rate of a film with guaranteed bounds, refined until they agree.

    Dirichlet's and Thomson's principles on the same mesh give Q_hi = ∫K|∇p|² and
    Q_lo = 1/∫|∇ψ|²/K with exact cell averages of K = g³/(12 η) and 1/K, so that the leak rate of
    the gap as represented lies between them whatever the mesh and the solver tolerance.

    Parameters
    ----------
    film
        A gap on a grid with its sides (flow along the first axis), or on the mesh of a shape, which
        is refined as it is.
    settings
        Fluid, pressures, method ("adaptive" or "uniform") and accuracy.
    progress
        Called with every LevelRecord, in m³/s.
    every_dual
        Compute bounds from both sides on every level, to show how they close.
    tuning
        Parameters that change the cost of the bounds, never their validity.
    start
        Mesh and functions to begin with, those of the adaptive flow through another film on the
        same grid.
    comm
        All its ranks must call this together, with the same film; all of this run if left out.
    keep
        Called with the flow on the last mesh, for starts and bounds of other films on the same
        grid; not called if a limit ends the refinement between two meshes.

    Raises
    ------
    InvalidInput
        If the method is not one of the two, it is "uniform" beside a `start`, a film to `keep` is
        not on a grid, or the critical constriction is so narrow a part of the largest gap that its
        cube leaves double precision.
    Inconsistent
        If the bounds cross, which would be a defect.

    Notes
    -----
    Where the linear solver cannot reach its tolerance, the functions it has reached still give
    bounds; they are returned, with `converged` False if they are further apart than asked for.
    """
    require_kind(FlowSettings, settings=settings)
    marking = choose(REFINEMENTS, settings.method, "method")
    require_film(film, (GridFilm, MeshFilm))
    if start is not None and marking is None:
        raise InvalidInput("leak_rate refines a start for method = 'adaptive': leave out `start`")
    if keep is not None and isinstance(film, MeshFilm):
        raise InvalidInput("leak_rate keeps flows through films on a grid alone: leave out `keep`")
    if film.sealed:
        return LeakRate.sealed(settings.method)
    slipping = None if settings.slip is None else SlippingFilm(settings.slip, film)
    slip_factor, law = 1.0, CUBE
    if slipping is not None:
        slip_factor, law = slipping.slip_factor, slipping.mean_law
    # The bounds on a mesh are in units of the leak rate [m³/s] of a square of the largest gap.
    square = leak_rate_of_square(film.largest_gap, settings.viscosity, settings.pressure_drop)
    unit = square * slip_factor
    stopping = _stopping(film, settings, unit, slipping, parallel.communicator(comm))
    # A decision and a doubtful tolerance want both bounds on each mesh, and the mesh of a similar
    # film is likely to be fine enough: solve the dual at once.
    at_once = settings.decide is not None or stopping.doubtful or start is not None
    strategy = Strategy(
        marking=marking,
        rtol=stopping.criterion.rtol,
        every_dual=every_dual or at_once,
        tuning=tuning or Tuning(),
    )
    gap, mesh = first_mesh(film, stopping.narrowest, strategy, law)
    start = Start.first(gap, mesh) if start is None else start.through(gap)
    levels: list[LevelRecord] = []
    drawn = None
    for solution in refined(gap, start, strategy, stopping):
        levels.append(_level_in(unit, solution.level))
        if progress is not None:
            progress(levels[-1])
        result = _leak_rate_in(unit, solution, settings.method, levels)
        # On each mesh: a limit may end the refinement once this solution has been freed.
        if settings.field:
            drawn = flow_field(solution, film, settings.pressure_drop, unit)
        if keep is not None and stopping.ended and isinstance(film, GridFilm):
            keep(MeshedFlow(film, solution, slip_factor))
        # Free this mesh before the next one is made.
        del solution
    reason = stopping.reason
    if reason:
        reason = f"{reason}; {stopping.criterion.missed(result)}"
        if strategy.uniform:
            reason += "; method = 'adaptive' needs fewer unknowns"
    return replace(result, reason=reason, field=drawn)


def _stopping(
    film: Film,
    settings: FlowSettings,
    unit: float,
    slipping: SlippingFilm | None,
    comm: MPI.Comm,
) -> Stopping:
    """When the refinement ends; InvalidInput if the constriction is too narrow for it."""
    criterion: Tolerance | Decision = Tolerance(settings.rtol)
    if settings.decide is not None:
        criterion = Decision(settings.decide, unit, settings.margin)
    narrowest = present(film.constriction, "constriction").gap / film.largest_gap
    require_conducting("the critical constriction", narrowest)
    advice = (
        f" (the critical constriction is {narrowest:.0e} of the largest gap: set such gaps to "
        "0 if they are contact)"
    )
    growth = GROWTH if REFINEMENTS[settings.method] is None else USUAL_GROWTH
    widened = unchanged if slipping is None else slipping.widened
    return Stopping(criterion, settings.limits, growth, narrowest, comm, advice, widened)


def require_conducting(tightest: str, narrowest: float) -> None:
    """Raise InvalidInput if the cube of smallest gap over largest leaves double precision."""
    if narrowest < NARROWEST:
        raise InvalidInput(
            f"{tightest} is {narrowest:.0e} of the largest gap; its cube is beyond double "
            f"precision below {NARROWEST:.0e}: set such gaps to 0 if they are contact"
        )


def first_mesh(
    film: Film, narrowest: float, strategy: Strategy, law: FilmLaw
) -> tuple[GapOnMesh, AnyMesh]:
    """The gap for the meshes, and the first mesh; gap and `narrowest` are in units of the maximum.

    Uniform refinement begins with the pixels of a grid. A shape begins with the mesh that it has.
    """
    tuning = strategy.tuning
    cut, floor, ceiling = (narrowest * p for p in (tuning.cut, tuning.floor, tuning.ceiling))
    if isinstance(film, MeshFilm):
        # Pockets may stay: the gap is linear on each cell, so no cell joins a pocket to a channel.
        scaled = film.values / film.largest_gap
        return VertexGap(scaled, length_unit(film), cut, floor, ceiling, law), film.mesh
    # Treat pockets as contact: nothing flows in them, but a coarse cell that covers parts of a
    # pocket and of a channel would seem to conduct.
    scaled = np.where(film.carrying, film.samples / film.largest_gap, 0.0)
    width = 1 if strategy.uniform else coarsest_width(film.pixels, tuning.coarsest)
    gap_type = REPRESENTATIONS[film.representation]
    gap = gap_type(GridField(scaled, film.gap.spacing), cut, floor, width, ceiling, law)
    return gap, coarse_mesh(gap.pixels, width, film.sides == "periodic")


def _level_in(unit: float, level: SolvedLevel) -> LevelRecord:
    """A mesh with its bounds in m³/s."""
    lower, upper = (bound * unit for bound in level.bounds.numbers)
    iterations = {stage: len(residuals) for stage, residuals in level.residuals.items()}
    return LevelRecord(
        unknowns=level.unknowns,
        cells=level.cells,
        lower=lower,
        upper=upper,
        iterations=iterations,
        seconds=level.seconds,
        residuals=level.residuals,
    )


def _leak_rate_in(
    unit: float, solution: LevelSolution, method: str, levels: list[LevelRecord]
) -> LeakRate:
    """Leak rate of a solution, with its bounds."""
    level, slip = solution.level, solution.slip
    lower, upper = (bound * unit for bound in (slip or level.bounds).numbers)
    flows = boundary_flows(solution.problem, solution.pressure)
    inflow, outflow = (flow * unit for flow in flows)
    return LeakRate(
        state="leaking",
        method=method,
        value=middle_of(lower, upper),
        lower=lower,
        upper=upper,
        unknowns=level.unknowns,
        inflow=inflow,
        outflow=outflow,
        levels=tuple(levels),
        slip_interval=None if slip is None else slip.slip_factors(level.bounds),
    )
