"""The effective conductivity tensor of a periodic cell, refined until its bounds agree."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fem_seal.errors import present
from fem_seal.fenicsx import MPI, explained_compilation
from fem_seal.film.law import CUBE, mean_pressure_law
from fem_seal.film.winding import periodic_sites, widest_winding
from fem_seal.flow.adapt import Strategy, Tuning, part_of_a_step
from fem_seal.flow.cell_problem import CellProblem, Family, lower_matrix, upper_matrix
from fem_seal.flow.convergence import ConvergenceHistory, out_of_reach
from fem_seal.flow.energy import ROUNDING
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, ConstantGap, LinearGap
from fem_seal.flow.leak import require_conducting, require_positive, unit_of_leak_rate
from fem_seal.flow.marking import doerfler, halvings
from fem_seal.flow.tensor_bounds import TensorBounds, relative_width, widest
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.limits import USUAL_GROWTH, Limits
from fem_seal.mesh.bisection import Refinement, TooFine, bisect
from fem_seal.mesh.nested import NestedMesh, coarsest_width, uniform_mesh
from fem_seal.mesh.seams import squares_across, unmatched

LEAST_SQUARES = 4  # across the cell; with fewer a side could not be told from its copy
# Smallest part of the largest conductivity that can be resolved. The pressure is prescribed
# nowhere, so its rounding errors in open regions hide smaller conductivities.
LEAST_CONDUCTIVITY = 1e-15
GROWTH = 2.2  # largest growth of the unknowns from level to level: bisecting all cells doubles them
TIGHTEST = "the tightest place on the widest way around the cell"


@explained_compilation()
def conductivity_tensor(
    gap: GridField,
    *,
    viscosity: float,
    slip: Slip | None = None,
    representation: str = "linear",
    rtol: float = 0.05,
    limits: Limits | None = None,
    progress: Callable[[int, float], None] | None = None,
    tuning: Tuning | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> TensorBounds:
    """Effective conductivity tensor K* of a gap that is periodic in both directions.

    The mean flux under a mean pressure gradient is -K*·gradient, K* in m³/(Pa s); a smooth channel
    of height h has h³/(12 η). With slip it is that at the mean of the two pressures, since the
    pressure changes little across one cell: to first order (h³ + B h²/p)/(12 η). Bounds as in
    `cell_problem`, for the gap as represented.

    Parameters
    ----------
    gap : gap in metres, zero in contact, periodic
    viscosity : η [Pa s]
    slip : of a gas; None: it does not slip
    representation : "linear" or "constant"
    rtol : stop when upper - lower <= rtol √(lower upper) in every direction
    limits : where to stop before that
    progress : called with unknowns and relative width of each mesh
    tuning : cost of the bounds, never their truth
    comm : all its ranks must call this together, with the same gap

    Returns
    -------
    TensorBounds [m³/(Pa s)]; zero matrices if nothing winds around the cell.

    Raises
    ------
    InvalidInput
        If the gap is not periodic, a choice is unknown, or a value is out of range.
    """
    require_positive({"viscosity": viscosity, "rtol": rtol})
    sites = periodic_sites(gap, representation)
    limits, tuning = limits or Limits(), tuning or Tuning()
    widest = [widest_winding(gap, representation, axis) for axis in (0, 1)]
    if not any(widest):
        return TensorBounds(np.zeros((2, 2)), np.zeros((2, 2)))
    highest = float(sites.max())
    per_pascal = unit_of_leak_rate(highest, viscosity, pressure_drop=1.0)
    law = CUBE
    if slip is not None:
        law = mean_pressure_law(slip, highest)
        per_pascal *= slip.gain(highest)
    scaled = GridField(sites / highest, gap.spacing, periodic=True)
    narrowest = min(h for h in widest if h > 0) / highest
    require_conducting(TIGHTEST, narrowest)
    width = coarsest_width((sites.shape[0], sites.shape[1]), tuning.coarsest)
    represented = REPRESENTATIONS[representation](
        scaled, tuning.cut * narrowest, tuning.floor * narrowest, width, law=law
    )
    Lx, Ly = scaled.size
    # From fluxes per jump to mean flux per gradient: D A* D/(Lx Ly), D = diag(Lx, Ly).
    lengths = np.array([[Lx / Ly, 1.0], [1.0, Ly / Lx]])
    doubt = _rounding_doubt(narrowest)
    bounds = _refined(represented, width, rtol, limits, tuning, comm, progress)
    scale = per_pascal * lengths
    bounds = replace(bounds, lower=bounds.lower * scale, upper=bounds.upper * scale)
    if bounds.converged:
        return bounds
    return replace(bounds, reason=f"{bounds.reason}; {_missed(bounds, rtol)}{doubt}")


def _missed(bounds: TensorBounds, rtol: float) -> str:
    """Message on the distance of the bounds from the tolerance, and the direction."""
    width, (x, y) = widest(bounds.lower, bounds.upper)
    along = (x, y) @ bounds.upper @ (x, y) / np.linalg.eigvalsh(bounds.upper)[-1]
    known = f"known to {width:.2g}" if np.isfinite(width) else "without a lower bound"
    return (
        f"the tensor is {known} along {np.degrees(np.arctan2(y, x)) % 180:.3g} degrees, where it "
        f"is {along:.2g} of its largest; {rtol:.2g} was asked for"
    )


def _rounding_doubt(narrowest: float) -> str:
    """Message if the constriction's gap (over the largest) is too small for double precision."""
    if narrowest**3 >= LEAST_CONDUCTIVITY:
        return ""
    return (
        f" ({TIGHTEST} conducts {narrowest**3:.0e} of the largest gap; double precision holds "
        f"{LEAST_CONDUCTIVITY:.0e}: set gaps to 0 where they are contact)"
    )


def _refined(
    gap: LinearGap | ConstantGap,
    width: int,
    rtol: float,
    limits: Limits,
    tuning: Tuning,
    comm: MPI.Comm,
    progress: Callable[[int, float], None] | None,
) -> TensorBounds:
    """Solve on ever finer meshes until the bounds agree or a limit is met."""
    started, levels, reason = time.perf_counter(), [], ""
    strategy = Strategy(rtol=rtol, max_unknowns=limits.unknowns, tuning=tuning)

    laps = [started]

    def why_stop(history: ConvergenceHistory) -> str:
        laps.append(time.perf_counter())
        limit = limits.exceeded(started, USUAL_GROWTH, laps[-1] - laps[-2])
        return comm.bcast(limit or out_of_reach(history, rtol, USUAL_GROWTH))

    # Meshes are nested: the last upper bound is the smallest, and the last lower one the largest.
    lower, upper = np.zeros((2, 2)), None
    try:
        for bounds in _levels(gap, width, strategy, comm, why_stop):
            lower, upper = lower if bounds.lower is None else bounds.lower, bounds.upper
            levels.append((bounds.unknowns, relative_width(lower, upper)))
            if progress is not None:
                progress(*levels[-1])
            reason = "" if levels[-1][1] <= rtol else bounds.reason
            if levels[-1][1] <= rtol or reason:
                break
        else:
            reason = f"the next mesh would have more than {limits.unknowns} unknowns"
    except TooFine as limit:
        if upper is None:
            raise
        reason = str(limit)
    lower, upper = lower * (1 - ROUNDING), present(upper, "upper bound") * (1 + ROUNDING)
    return TensorBounds(lower, upper, levels[-1][0], not reason, reason, tuple(levels))


@dataclass(frozen=True, eq=False)
class _LevelBounds:
    """Bounds on one mesh.

    Attributes
    ----------
    lower : array or None
        Lower bound; None on a mesh too coarse for it.
    upper : array
        Upper bound.
    unknowns : int
        Pressure unknowns for one direction.
    reason : str
        Reason why no finer mesh follows, "" if one does.
    """

    lower: np.ndarray | None
    upper: np.ndarray
    unknowns: int
    reason: str


@dataclass(frozen=True, eq=False)
class _Start:
    """A mesh with matching seams, the gap on it, and functions (4, C, 3) to start from.

    The first two are pressures for unit jumps across x and y, the others stream functions.
    """

    mesh: NestedMesh
    values: np.ndarray
    functions: np.ndarray

    def after(self, gap: LinearGap | ConstantGap, step: Refinement) -> "_Start":
        assert isinstance(step.mesh, NestedMesh)  # bisection keeps the kind of a mesh
        values = gap.refined_values(self.values, step.mesh, step.edge_ends)
        return _Start(step.mesh, values, np.array([step.prolong(f) for f in self.functions]))

    def refined(self, gap: LinearGap | ConstantGap, times: np.ndarray) -> "_Start":
        """Bisect each cell at least `times` times, and more where the seams must match."""
        start = self
        while times.any():
            step = bisect(start.mesh, times > 0)
            start, times = start.after(gap, step), np.maximum(times[step.parent] - 1, 0)
            while (missing := unmatched(start.mesh)).any():
                step = bisect(start.mesh, missing)
                start, times = start.after(gap, step), times[step.parent]
        return start


def _first(gap: LinearGap | ConstantGap, width: int) -> _Start:
    mesh = uniform_mesh(gap.squares, width, periodic_sides=False)
    unit = np.moveaxis((mesh.xy / mesh.xy.max(axis=0))[mesh.cells], -1, 0)
    start = _Start(mesh, gap.vertex_values(mesh), np.concatenate([unit, unit]))
    while squares_across(start.mesh) < LEAST_SQUARES:
        start = start.refined(gap, np.full(len(start.mesh.cells), 2))
    return start


def _levels(
    gap: LinearGap | ConstantGap,
    width: int,
    strategy: Strategy,
    comm: MPI.Comm,
    why_stop: Callable[[ConvergenceHistory], str],
) -> Iterator[_LevelBounds]:
    start, most, tuning = _first(gap, width), strategy.max_unknowns or np.inf, strategy.tuning
    history: list[tuple[int, float]] = []
    while True:
        problem = CellProblem(gap, start.mesh, start.values, comm, tuning.tolerance)
        if history and problem.unknowns > most:
            return
        guess = start.functions[:, problem.kept]
        pressures = problem.pressures(guess[:2])
        regularised = problem.regularised_streams(guess[2:], tuning.epsilon)
        upper = upper_matrix(pressures)
        reached = relative_width(lower_matrix(regularised), upper)
        last = not history or GROWTH * problem.unknowns > most
        history.append((problem.unknowns, reached))
        reason, lower = why_stop(history), None
        if len(history) > 1 and not reached < 0.99 * history[-2][1]:
            reason = reason or pressures.stalled or regularised.stalled
        if last or reason or reached < 2 * strategy.rtol:
            lower = lower_matrix(problem.streams(_by_jumps(regularised, guess[2:])))
        yield _LevelBounds(lower, upper, problem.unknowns, reason)
        if lower is not None and np.isfinite(relative_width(lower, upper)):
            reached = relative_width(lower, upper)
        part = part_of_a_step(reached, strategy)
        indicators = problem.indicators(pressures, regularised, tuning.epsilon)
        times = np.zeros(len(problem.kept), dtype=int)
        times[problem.kept] = np.maximum(
            halvings(indicators, doerfler(indicators, part * tuning.theta)),
            doerfler(problem.blocked_flux(pressures, regularised), part * tuning.theta_blocked),
        )
        functions = start.functions.copy()
        functions[:2, problem.kept] = _by_jumps(pressures, guess[:2])
        functions[2:, problem.kept] = _by_jumps(regularised, guess[2:])
        start = replace(start, functions=functions).refined(gap, times)
        del problem, pressures, regularised


def _by_jumps(family: Family, otherwise: np.ndarray) -> np.ndarray:
    """Functions (2, C, 3) for unit jumps out of a family that may have fewer."""
    if len(family.jumps) < 2:
        # Only the component along the family's one direction is used later.
        return np.array([family.combined(row) for row in np.linalg.pinv(family.jumps)])
    return family.corner_values if len(otherwise) else otherwise
