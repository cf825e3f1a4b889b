"""The conductivity table of a patch, with as many net loads as the leak rate of its seal needs.

Let ρ be the influence of ln K on ln Q per unit of the net load w, and f the fall of ln K there. An
enclosure of an interval leaves the error WIDTH × ∫ρ dw × (∫f dw)² in ln Q, if the interval is
short. The sum of the errors of a number of intervals is smallest if all have the same

    ∫ (ρ f²)^(1/3) dw,

the *demand* for loads; WIDTH times its cube is then the error of the interval. ρ and f are those of
the table so far, whose ln K is extrapolated beyond its ends. So the loads follow from a few first
ones at once, and seldom need a correction.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt
from time import perf_counter

import numpy as np

from fem_seal import parallel
from fem_seal.digits import per_cent
from fem_seal.errors import present
from fem_seal.leak_rate import half_width_of, relative_half_width, relative_width
from fem_seal.pressure_profile import Profile, is_uniform
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.leak_path import EndPressures, LeakPath
from fem_seal.upscaling.patch_conductivity import LoadedPatch
from fem_seal.upscaling.path_flow import MOST_FALL, SealFlow, lifted_off, seal_flow

SEAL_TOLERANCE = 0.1  # (upper - lower)/√(lower upper) of the leak rate of a seal
MOST_LOADS = 40  # 4 to 26 were solved (docs/measurements/seals.md)
# Relative width of an enclosure over the square of the fall of ln K in its interval, as measured.
WIDTH = 0.22
# Part of a table's error that net loads below its first load and above its last one may have.
REST = 0.1
# The tolerance of a flow is that of the flow at the decisive load times FIRST_MULTIPLE to
# LOOSEST_MULTIPLE, the more the less it matters. FIRST_MULTIPLE is above 1: many flows miss a
# tolerance by a tenth on the mesh of another load, and the next mesh costs as much again.
FIRST_MULTIPLE, LOOSEST_MULTIPLE = 1.15, 3.0
OTHER_MULTIPLE = 1.4  # the same for the other first loads
# The load from which on a sealed patch is sealed is known to this part of the highest one.
SEALED_LOAD_KNOWN = 1 / 16


def refined_flow(
    loaded: LoadedPatch,
    profile: Profile,
    path: LeakPath,
    ends: EndPressures,
    *,
    tolerance: float = SEAL_TOLERANCE,
    most_loads: int = MOST_LOADS,
    max_seconds: float | None = None,
    progress: Callable[[str], None] = lambda state: None,
) -> SealFlow:
    """Flow of a seal of such patches; loads are added to their table until it has a tolerance.

    Loads are added until the enclosures of all intervals should be narrow enough; then all of these
    are computed. After `max_seconds` the bounds that have been reached are returned.
    """
    if profile.highest <= ends.inlet:
        return lifted_off(profile, ends)
    # Where the total pressure is highest, and fluid at the inlet's pressure arrives, the net load
    # is the decisive one. If it seals the patch, no fluid passes there.
    decisive = profile.highest - ends.inlet
    progress("whether it seals")
    if loaded.film(decisive).sealed:
        table = loaded.table({_sealed_from(loaded, decisive): 1.0, decisive: 1.0})
        return seal_flow(table, profile, path, ends)

    started = perf_counter()
    # Under a uniform pressure no net load is below the decisive one.
    span = (decisive if is_uniform(profile) else 0.0), profile.highest - ends.outlet
    first = {decisive: 1.0} | {
        0.5 * (decisive + end): OTHER_MULTIPLE for end in span if end != decisive
    }
    progress(f"its first {len(first)} net loads")
    table = loaded.table(first)
    while True:
        flow = seal_flow(table, profile, path, ends)
        if relative_width(flow.lower, flow.upper) <= tolerance:
            return flow
        progress(_state_of_table(table, flow, tolerance, most_loads))
        if max_seconds is not None:
            # Times differ from process to process.
            taken = parallel.on_root(lambda: perf_counter() - started, loaded.patch.comm)
            if taken > max_seconds:
                reason = f"its {max_seconds:g} s are used up; raise seal.max_seconds"
                return replace(flow, reason=reason)
        enclosed = loaded.enclosed()
        marked = marked_loads(table, flow, enclosed, tolerance, span, most_loads)
        if not marked and flow.lower > 0 and enclosed.all():
            marked = _halved(table, span, int(np.argmax(_errors(table, flow)[0])))
        loads = loaded.missing(marked)
        if loads and len(loads.keys() | set(table.loads.tolist())) <= most_loads:
            table = loaded.table(loads)
        elif flow.lower > 0 and not enclosed.all():
            table = loaded.enclose()
        else:
            reason = f"it may take {most_loads} net loads; raise seal.max_loads"
            if loaded.reason:
                reason = f"{loaded.reason}; raise that limit"
            elif flow.lower > 0 and _errors(table, flow)[1] >= tolerance:
                reason = "its bounds at the net loads are no narrower; raise seal.rtol"
            return replace(flow, reason=reason)


def _sealed_from(loaded: LoadedPatch, sealed: float) -> float:
    """Load [Pa] from which on a patch is sealed, below one that seals it; no flow is solved."""
    opens, known = 0.0, SEALED_LOAD_KNOWN * sealed
    while sealed - opens > known:
        middle = 0.5 * (opens + sealed)
        opens, sealed = (opens, middle) if loaded.film(middle).sealed else (middle, sealed)
    return sealed


def _state_of_table(
    table: ConductivityTable, flow: SealFlow, tolerance: float, most_loads: int
) -> str:
    """Text on the number of loads and the width of the bounds, reached and asked for."""
    widths = relative_half_width(flow.lower, flow.upper), half_width_of(tolerance)
    reached, target = map(per_cent, widths)
    return f"{table.loads.size} of at most {most_loads} net loads, ±{reached}, ±{target} wanted"


def marked_loads(
    table: ConductivityTable,
    flow: SealFlow,
    enclosed: np.ndarray,
    tolerance: float,
    span: tuple[float, float],
    most_loads: int = MOST_LOADS,
) -> dict[float, float]:
    """Loads [Pa] that the table should have, each with a multiple of the flows' tolerance.

    The dict is empty if the table has them already. `enclosed` are the intervals that have their
    enclosures, `span` the smallest and the largest load along the path.
    """
    loads = table.loads
    if flow.lower == 0:
        # Without a lower bound, refine only towards the load that seals.
        return _halved(table, span, int(np.argmax(np.append(table.lower, 0.0) == 0)))
    demand = _Demand.of(table, flow)
    error, of_flows = _errors(table, flow)
    # Error that may stay in the intervals between the loads.
    allowed = (1 - REST) * (tolerance - of_flows)
    if allowed <= 0:
        return demand.multiples(loads, span)
    first, last = demand.extent(span, REST / (1 - REST) * allowed)
    if loads.size + 2 > most_loads:
        first, last = loads[[0, -1]]
    nodes = np.concatenate([[min(first, loads[0])], loads, [max(last, loads[-1])]])
    # Error of each interval with an enclosure: its own, or what is expected before one is made.
    uncut = WIDTH * demand.between(nodes) ** 3
    uncut[1:-1] = np.where(enclosed, error[1:-1], np.minimum(uncut, error)[1:-1])
    # An interval cut into n pieces of the same demand keeps 1/n² of its error. Cut where one more
    # piece gains most, until the errors are small enough.
    pieces = np.ones(uncut.size, dtype=int)
    most = most_loads + nodes.size - 1 - np.unique(nodes).size
    while (uncut / pieces**2).sum() > allowed and pieces.sum() < most:
        pieces[np.argmax(uncut * (1 / pieces**2 - 1 / (pieces + 1) ** 2))] += 1
    added = np.setdiff1d(demand.cut(nodes, pieces), loads)
    return demand.multiples(np.union1d(loads, added), span) if added.size else {}


def _halved(table: ConductivityTable, span: tuple[float, float], k: int) -> dict[float, float]:
    """The middle of interval k, if it has a width; interval 0 lies below the loads of the table."""
    below, above = np.concatenate([span[:1], table.loads, span[1:]])[k : k + 2].tolist()
    return {} if below == above else {0.5 * (below + above): OTHER_MULTIPLE}


@dataclass(frozen=True, eq=False)
class _Demand:
    """Where a table needs loads, on m short parts of the net load."""

    edges: np.ndarray  #: (m + 1,), ends of the parts [Pa]
    influence: np.ndarray  #: (m,), ∫ρ dw of each part
    demand: np.ndarray  #: (m,), ∫(ρ f²)^(1/3) dw of each part

    @classmethod
    def of(cls, table: ConductivityTable, flow: SealFlow) -> "_Demand":
        """Take ρ from the flow at the value, f from the interpolated K."""
        edges, K = table.interpolated.loads, table.interpolated.conductivity[1:-1]
        log_K = np.log(np.maximum(K, np.finfo(float).tiny))
        fall = -np.gradient(log_K, 0.5 * (edges[1:] + edges[:-1])) * np.diff(edges)
        along = present(flow.path, "path of the flow")
        influence, _ = np.histogram(along.net_loads, edges, weights=along.influences)
        return cls(edges, influence, np.cbrt(influence * fall**2))

    def extent(self, span: tuple[float, float], rest: float) -> np.ndarray:
        """Ends [Pa] of the loads that count: about `rest` of ln Q is left to those beyond.

        Above, K counts as constant, as it does in the upper bound.
        """
        below = np.cumsum(self.influence) <= rest
        per_load = self.influence / np.diff(self.edges)
        above = per_load * (span[1] - self.edges[:-1]) <= rest
        ends = np.argmin(below), above.size - np.argmin(above[::-1])
        return np.clip(self.edges[list(ends)], *span)

    def between(self, loads: np.ndarray) -> np.ndarray:
        """Demand between neighbouring loads."""
        return np.diff(self._up_to(self.demand, loads))

    def cut(self, loads: np.ndarray, pieces: np.ndarray) -> np.ndarray:
        """Cut each interval between loads (n,) into pieces (n - 1,) of the same demand."""
        total = np.append(0.0, np.cumsum(self.demand))
        places = [loads]
        for below, above, many in zip(loads[:-1], loads[1:], pieces, strict=True):
            first, last = self._up_to(self.demand, np.array([below, above]))
            places.append(np.interp(np.linspace(first, last, many + 1)[1:-1], total, self.edges))
        return np.unique(np.concatenate(places))

    def multiples(self, loads: np.ndarray, span: tuple[float, float]) -> dict[float, float]:
        """Each load with the multiple of the flows' tolerance that its influence allows.

        With n loads of influences ρ_k the errors Σ ρ_k r_k are the same at the least cost Σ 1/r_k
        for r_k ∝ ρ_k^(-1/2); a load of influence 1/n counts as a usual one.
        """
        nodes = np.concatenate([span[:1], loads, span[1:]])
        share = np.diff(self._up_to(self.influence, nodes))
        influence = np.maximum(0.5 * (share[1:] + share[:-1]), np.finfo(float).tiny)
        multiples = np.clip((loads.size * influence) ** -0.5, FIRST_MULTIPLE, LOOSEST_MULTIPLE)
        return dict(zip(loads.tolist(), multiples.tolist(), strict=True))

    def _up_to(self, of_parts: np.ndarray, loads: np.ndarray) -> np.ndarray:
        return np.interp(loads, self.edges, np.append(0.0, np.cumsum(of_parts)))


def intervals_needed(table: ConductivityTable, flow: SealFlow, tolerance: float) -> float:
    """Number of intervals of the same demand whose enclosures meet the tolerance of a leak rate."""
    demand = float(_Demand.of(table, flow).demand.sum())
    return sqrt(WIDTH * demand**3 / ((1 - REST) * tolerance))


def _errors(table: ConductivityTable, flow: SealFlow) -> tuple[np.ndarray, float]:
    """Parts of ln(upper/lower) of the leak rate: of each interval, and of all flows.

    Of n loads there are n + 1 intervals, with those below the first load and above the last one.

    To first order ln(upper/lower) of the leak rate is Σ influence × ln(K_upper/K_lower).
    """
    count, along = table.loads.size + 1, present(flow.path, "path of the flow")
    net, influence = along.net_loads.ravel(), along.influences.ravel()
    interval = np.searchsorted(table.loads, net)
    fall = _limited_fall(table.highest(net), table.lowest(net))
    error, influences = (np.bincount(interval, x, count) for x in (influence * fall, influence))
    of_ends = np.pad(_limited_fall(table.upper, table.lower), 1)
    of_flows = 0.5 * influences * (of_ends[:-1] + of_ends[1:])
    return np.maximum(error - of_flows, 0.0), float(of_flows.sum())


def _limited_fall(upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """ln(upper/lower), at most MOST_FALL; 0 where both are 0."""
    least = np.exp(-MOST_FALL)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(upper > 0, np.minimum(lower / upper, 1.0), 1.0)
    return -np.log(np.maximum(np.where(np.isfinite(upper), ratio, least), least))
