"""K(w) of a scene's patch: a chain of dry contacts and flows, refined in load where it matters.

K is the conductivity between straight ends: K = Q Lx/(Ly Δp), with the leak rate Q of the patch
from its inlet to its outlet. (On a patch 8 long wavelengths wide it is up to a fifth above the
component of the conductivity tensor, whose current need not cross straight ends.) For a gas that
slips, K is taken at the mean of the pressures of inlet and outlet.

A mirrored map is even about the lines x = 0 and y = 0, and so is its flow: no fluid crosses y = 0
and y = Ly/2, and the pressure is uniform at x = Lx/2. So the film is a quarter of the patch,
between walls: its K is that of the patch.

Bounds between two loads. The gap g(x; w) of a half-space falls with the load w and is convex in it.
Proof: let M be the stiffness, whose kernel is negative off the diagonal, and f = M h for the
heights h. Then g(w) is the least element of the set {g >= 0, M g + f + w >= 0} (R. W. Cottle and
A. F. Veinott, Math. Program. 3, 238 (1972)). If g_1 and g_2 are in the sets of w_1 and w_2, their
mean is in the set of the mean load, and so at least as large as the least element there. Hence for
a < w < b < c

    g_b + (b - w)/(c - b) (g_b - g_c)  <=  g(w)  <=  ((b - w) g_a + (w - a) g_b)/(b - a).

The flows at b and at a bound the flow through either gap (`flow.nearby`). These bounds are narrower
by one power of b - a than the conductivities at a and b themselves.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import inf
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from fem_seal import parallel
from fem_seal.contact.load_path import Predictor
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.digits import per_cent, with_prefix
from fem_seal.errors import present
from fem_seal.film import GridFilm, film_conductivity
from fem_seal.flow_settings import FlowSettings
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, Level, half_width_of, relative_width
from fem_seal.patch import Patch
from fem_seal.steps import elastic_contact
from fem_seal.upscaling.conductivity import ConductivityTable, Enclosure
from fem_seal.upscaling.leak_path import EndPressures, LeakPath
from fem_seal.upscaling.profile import Profile, is_uniform
from fem_seal.upscaling.seal_flow import MOST_FALL, SealFlow, seal_flow

if TYPE_CHECKING:
    from fem_seal.flow.nearby import MeshedFlow
    from fem_seal.flow.solution import Start

TOLERANCE = 0.1  # (upper - lower)/√(lower upper) of the leak rate of a seal
MOST_LOADS = 40
SHARE = 0.5  # part of the error of the load table that is refined at a time (Dörfler)
LEFT = 0.25  # part of its error that a halved interval keeps: enclosures are of second order
# Relative width of an enclosure over the square of the fall of ln K in its interval, as measured.
WIDTH = 0.22
# Intervals that make less of the error than this part of the tolerance are not enclosed.
SMALL = 0.02
# Tolerance of a flow that begins on the mesh of another load, over that of the first one: many of
# these meshes miss the tolerance by a tenth, and the next mesh costs as much again.
STARTED = 1.15
BETWEEN = 2  # intervals between the places of an enclosure
BEYOND = 0.125  # (c - b)/(b - a), where c is the load that gives the line beyond b
SIMPSON = (4, 1, 1)  # weights of the value and of both bounds
# The load from which on a sealed patch is sealed is known to this part of the highest one.
MARGIN = 1 / 16
NARROW = 1e-6  # relative distance of two pressures that count as one
# Most samples of all flows that are kept; the oldest flows are dropped first.
KEPT = 1 << 25


def _ignore(text: str) -> None:
    """Show nothing."""


class LoadedPatch:
    """A patch of an elastic contact on a grid under any net load, each computed once.

    The first flow is solved to `rtol`, the others to `STARTED` times that. The load of the scene is
    not used.
    """

    def __init__(self, patch: Patch, rtol: float):
        self.patch, self.rtol = patch, rtol
        self.reasons: list[str] = []
        # Whether all loads so far agree with the enclosures of their intervals.
        self.convex = True
        self._states: dict[float, ContactState] = {}
        self._bounds: dict[float, tuple[float, float]] = {}
        self._flows: dict[float, MeshedFlow] = {}
        self._enclosures: dict[tuple[float, float], Enclosure | None] = {}

    def with_flows_to(self, rtol: float) -> "LoadedPatch":
        """The same patch and contacts, with flows that start from those so far."""
        if rtol == self.rtol:
            return self
        other = LoadedPatch(self.patch, rtol)
        other._states, other._flows = self._states, dict(self._flows)
        return other

    def bounds(self, load: float) -> tuple[float, float]:
        """Bounds of K [m³/(Pa s)] at a net load [Pa]; both 0 where the patch is sealed.

        The contact starts from an extrapolation of the two states nearest in load, the flow from
        the mesh and the functions of the nearest lower load.
        """
        if load not in self._bounds:
            self._bounds[load] = self._conductivity(load)
        return self._bounds[load]

    def table(self, loads: Sequence[float] = ()) -> ConductivityTable:
        """Compute `loads` [Pa]; table of these and all earlier loads, with the enclosures."""
        for load in sorted(loads):
            if load not in self._bounds:
                self._compare(load)
        rows = sorted((load, *bounds) for load, bounds in self._bounds.items())
        between = tuple(
            self._enclosures.get(pair) if self.convex else None
            for pair in pairwise(row[0] for row in rows)
        )
        at, lower, upper = map(np.array, zip(*rows, strict=True))
        return ConductivityTable(at, lower, upper, between)

    def enclose(self, intervals: Iterable[tuple[float, float]]) -> ConductivityTable:
        """Table with enclosures of intervals between neighbouring loads [Pa].

        An interval has none if a flow is not kept any more, or if the gap is not linear on a grid.
        """
        for pair in intervals:
            self._enclosures[pair] = self._enclosure(*pair)
        return self.table()

    def enclosed(self, intervals: Iterable[tuple[float, float]]) -> np.ndarray:
        """Intervals that `enclose` cannot narrow: it has been called, or no enclosure holds."""
        return np.array([not self.convex or pair in self._enclosures for pair in intervals])

    def sealed(self, load: float) -> bool:
        """Whether no open path joins inlet and outlet at a net load [Pa]; no flow is solved."""
        return self._film(self._gap(load)).sealed

    def _enclosure(self, a: float, b: float) -> Enclosure | None:
        if a not in self._flows:
            return None
        places = np.linspace(0, 1, BETWEEN + 1)
        gap_a, gap_b = self._gap(a), self._gap(b)
        below = [self._film((1 - s) * gap_a + s * gap_b) for s in places[1:]]
        flow = self._flows[a]
        scale = self._per_square(flow)
        upper = scale * flow.conductances_below([flow.film, *below])
        lower = np.full(BETWEEN + 1, self.bounds(b)[0])
        if b in self._flows:
            c = b + BEYOND * (b - a)
            fall = (b - a) / (c - b) * (gap_b - self._gap(c))
            above = [self._film(gap_b + s * fall) for s in places[1:]]
            flow = self._flows[b]
            resistances = flow.resistances_above([flow.film, *above])
            lower = self._per_square(flow) / resistances[::-1]
        return Enclosure(tuple(lower.tolist()), tuple(upper.tolist()))

    def critical_gap(self, load: float) -> float | None:
        """Gap [m] of the critical constriction at a net load [Pa]; None if sealed."""
        flow = self._flows.get(load)
        constriction = (flow.film if flow else self._film(self._gap(load))).constriction
        return None if constriction is None else constriction.gap

    @cached_property
    def _quartered(self) -> bool:
        """Whether a quarter of the patch has the conductivity of the whole."""
        heights = present(self.patch.surface, "surface").values
        return (
            self.patch.scene.flow.representation == "linear"
            and not any(n % 2 for n in heights.shape)
            and np.array_equal(heights[1:], heights[:0:-1])
            and np.array_equal(heights[:, 1:], heights[:, :0:-1])
        )

    def _film(self, gap: np.ndarray) -> GridFilm:
        if self._quartered:
            nx, ny = gap.shape
            return GridFilm(GridField(gap[: nx // 2 + 1, : ny // 2 + 1], self._spacing))
        film = self.patch.film_of(GridField(gap, self._spacing, periodic=True))
        return present(film if isinstance(film, GridFilm) else None, "film on a grid")

    def _gap(self, load: float) -> np.ndarray:
        return self._state(load).gap.values

    @property
    def _spacing(self) -> tuple[float, float]:
        return present(self.patch.surface, "surface").spacing

    def _per_square(self, flow: "MeshedFlow") -> float:
        """K [m³/(Pa s)] of the patch if its conductance is that of a square of the largest gap."""
        length, width = flow.film.size
        K = film_conductivity(flow.film.largest_gap, self.patch.scene.viscosity)
        return flow.slip_factor * K * length / width

    def _compare(self, load: float) -> None:
        """Compute K at a load, and compare it with the enclosure of the interval that it halves."""
        lower, upper = self.bounds(load)
        for (a, b), enclosure in self._enclosures.items():
            if enclosure is None or not a < load < b:
                continue
            place = np.array((load - a) / (b - a))
            if upper < enclosure.lower_at(place) or lower > enclosure.upper_at(place):
                self.convex = False

    def _state(self, load: float) -> ContactState:
        if load not in self._states:
            # All processes make the surface together: the first one must not make it alone.
            surface = present(self.patch.surface, "surface")
            state = parallel.on_root(lambda: self._pressed(surface, load), self.patch.comm)
            self._states[load] = state
        return self._states[load]

    def _pressed(self, surface: GridField, load: float) -> ContactState:
        nearest = sorted(self._states, key=lambda other: abs(other - load))[:2]
        predictor = Predictor()
        for other in reversed(nearest):
            predictor.remember(Load("pressure", other), self._states[other])
        target = Load("pressure", load)
        patch = self.patch
        return elastic_contact(patch.scene, surface, predictor.start(target), target, patch.report)

    def _conductivity(self, load: float) -> tuple[float, float]:
        state = self._state(load)
        film = self._film(state.gap.values)
        if film.sealed:
            return 0.0, 0.0
        leak = self._leak_rate(load, film)
        if not leak.converged:
            load_text = with_prefix(state.mean_pressure, "Pa")
            # The rest of the reason names the tolerance of this flow, which is not the seal's.
            cause = leak.reason.partition(";")[0]
            self.reasons.append(f"its flow at a net load of {load_text} ended early, since {cause}")
        length, width = state.gap.size
        per_rate = length / (width * self.patch.scene.drive.pressure_drop)
        lower, upper = leak.bounds
        return lower * per_rate, upper * per_rate

    def _leak_rate(self, load: float, film: GridFilm) -> LeakRate:
        from fem_seal.flow import leak_rate

        scene, report = self.patch.scene, self.patch.report
        nearby = film.representation == "linear" and scene.flow.method == "adaptive"

        def progress(level: Level) -> None:
            report("flow", f"{level.unknowns} unknowns, ±{per_cent(level.half_width)}")

        def keep(flow: "MeshedFlow") -> None:
            self._flows[load] = flow
            while len(self._flows) > max(1, KEPT // film.samples.size):
                del self._flows[next(iter(self._flows))]

        start = self._nearest(load) if nearby else None
        settings = FlowSettings(
            scene.viscosity,
            scene.drive.pressure_drop,
            slip=at_mean_pressure(scene.slip),
            method=scene.flow.method,
            rtol=self.rtol if start is None else STARTED * self.rtol,
            limits=scene.flow.limits,
        )
        return leak_rate(
            film,
            settings,
            progress=progress,
            comm=parallel.communicator(self.patch.comm),
            start=start,
            keep=keep if nearby else None,
        )

    def _nearest(self, load: float) -> "Start | None":
        """Flow at a load itself, at the highest load below, or at the lowest one above."""
        if not self._flows:
            return None
        below = [other for other in self._flows if other <= load]
        return self._flows[max(below) if below else min(self._flows)].start


def at_mean_pressure(slip: Slip | None) -> Slip | None:
    """The law of slip with both pressures at their mean."""
    if slip is None:
        return None
    mean = slip.mean_pressure
    return replace(slip, inlet_pressure=(1 + NARROW) * mean, outlet_pressure=(1 - NARROW) * mean)


@dataclass(frozen=True, eq=False)
class PatchFlow:
    """Conductivity table of a patch, and the leak rate of a seal that consists of such patches."""

    table: ConductivityTable | None  #: none if the seal lifts off
    seal_flow: SealFlow
    converged: bool = True  #: whether the bounds of the leak rate meet the tolerance
    reason: str = ""  #: why they do not, and what to change; else empty


def refined_table(
    patch: LoadedPatch,
    profile: Profile,
    path: LeakPath,
    ends: EndPressures,
    *,
    tolerance: float = TOLERANCE,
    most_loads: int = MOST_LOADS,
    max_seconds: float | None = None,
    progress: Callable[[str], None] = _ignore,
) -> PatchFlow:
    """Add loads to a patch's table until the leak rate of the seal is known to a tolerance.

    The intervals of the table on which the error depends most are halved, until their enclosures
    should be narrow enough. Then these are computed; the widest ones are halved again if need be.
    After `max_seconds` the bounds that have been reached are returned.
    """
    if profile.highest <= ends.inlet:
        return PatchFlow(None, SealFlow("lifted off", inf, inf, inf))
    # Where the contact pressure is highest, and fluid at the inlet's pressure arrives, the net load
    # is the decisive one. If it seals the patch, no fluid passes there.
    decisive = profile.highest - ends.inlet
    progress("whether it seals")
    if patch.sealed(decisive):
        opens, sealed = 0.0, decisive  # for the margin; no flow is solved
        while sealed - opens > MARGIN * decisive:
            middle = 0.5 * (opens + sealed)
            opens, sealed = (opens, middle) if patch.sealed(middle) else (middle, sealed)
        table = patch.table([sealed, decisive])
        return PatchFlow(table, seal_flow(table, profile, path, ends))
    from fem_seal.flow.marking import doerfler

    started = perf_counter()
    # Begin with the lowest load: its open channels contain those of all higher loads. Under a
    # uniform pressure no net load is below the decisive one.
    first = [decisive] if is_uniform(profile) else np.linspace(0, decisive, 5).tolist()
    progress(f"its first {len(first) + 1} net loads")
    table = patch.table([*first, profile.highest - ends.outlet])
    while True:
        flow = seal_flow(table, profile, path, ends)
        if _width(flow) <= tolerance:
            return PatchFlow(table, flow)
        progress(_state_of_table(table, flow, tolerance, most_loads))
        if max_seconds is not None and perf_counter() - started > max_seconds:
            reason = f"its {max_seconds:g} s are used up; raise seal.max_seconds"
            return PatchFlow(table, flow, False, reason)
        intervals = list(pairwise(table.loads.tolist()))
        enclosed = patch.enclosed(intervals)
        error, expected, of_flows = _errors(table, flow)
        large = error > SMALL * tolerance
        to_enclose = np.flatnonzero(~enclosed & large)
        error = np.where(enclosed, error, expected)
        if error.sum() + of_flows <= tolerance and to_enclose.size:
            table = patch.enclose(intervals[k] for k in to_enclose)
            continue
        # Halve no more intervals than the tolerance needs, and a little.
        excess = max(error.sum() + of_flows - tolerance, 0.0) / (1 - LEFT) + 0.1 * tolerance
        error = np.where(large, error, 0.0)
        marked = doerfler(error, min(SHARE, excess / max(error.sum(), excess)))
        loads = 0.5 * (table.loads[:-1] + table.loads[1:])[marked]
        full = table.loads.size + loads.size > most_loads
        if full or not loads.size or of_flows > tolerance:
            reason = f"it may take {most_loads} net loads; raise seal.max_loads"
            if patch.reasons:
                reason = f"{patch.reasons[0]}; raise that limit"
            return PatchFlow(table, flow, False, reason)
        table = patch.table(loads.tolist())


def _state_of_table(
    table: ConductivityTable, flow: SealFlow, tolerance: float, most_loads: int
) -> str:
    """Text on the number of loads and the width of the bounds, reached and asked for."""
    reached, target = per_cent(half_width_of(_width(flow))), per_cent(half_width_of(tolerance))
    return f"{table.loads.size} of at most {most_loads} net loads, ±{reached}, ±{target} wanted"


def _width(flow: SealFlow) -> float:
    return relative_width(flow.lower, flow.upper) if flow.upper > 0 else 0.0


def _errors(table: ConductivityTable, flow: SealFlow) -> tuple[np.ndarray, np.ndarray, float]:
    """Parts of ln(upper/lower) of the leak rate: of each interval, and of all flows.

    First those of the intervals (n - 1,) with the present enclosures, then what would be left of
    them if all were enclosed.

    Let ln K_t go linearly from the lower bounds at t = 0 to the upper ones at t = 1. Then
    ln(upper/lower) of the leak rate is ∫ Σ influence_t × ln(K_upper/K_lower) dt. Simpson's rule
    takes the influences of the value and of both bounds. Where the bounds are far apart, these have
    different net loads.
    """
    count = table.loads.size - 1
    error, influences = np.zeros(count), np.zeros(count)
    paths = (present(flow.path, "path of the flow"), *flow.bounding)
    weights = np.array(SIMPSON[: len(paths)]) / sum(SIMPSON[: len(paths)])
    for weight, along in zip(weights, paths, strict=True):
        net, influence = along.net_loads.ravel(), weight * along.influences.ravel()
        interval = np.searchsorted(table.loads, net) - 1
        inside = (interval >= 0) & (interval < count)
        interval, net, influence = interval[inside], net[inside], influence[inside]
        fall = _log_ratio(table.highest(net), table.lowest(net))
        error += np.bincount(interval, influence * fall, count)
        influences += np.bincount(interval, influence, count)
    of_ends = _log_ratio(table.upper, table.lower)
    of_flows = 0.5 * influences * (of_ends[:-1] + of_ends[1:])
    error = np.maximum(error - of_flows, 0.0)
    falls = _log_ratio(table.value[:-1], table.value[1:])
    expected = np.minimum(influences * WIDTH * falls**2, error)
    if flow.lower == 0 and table.lower[-1] == 0:
        # Without a lower bound, refine only towards the load that seals.
        error = expected = np.zeros(count)
        error[np.argmax(table.lower[1:] == 0)] = MOST_FALL
    return error, expected, float(of_flows.sum())


def _log_ratio(upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """ln(upper/lower), at most MOST_FALL; 0 where both are 0."""
    least = np.exp(-MOST_FALL)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(upper > 0, np.minimum(lower / upper, 1.0), 1.0)
    return -np.log(np.maximum(np.where(np.isfinite(upper), ratio, least), least))
