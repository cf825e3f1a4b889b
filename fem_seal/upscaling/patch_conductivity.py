"""K(w) of a scene's patch: a chain of dry contacts and flows, refined in load where it matters.

K is that between straight ends: the leak rate Q of the patch from its inlet to its outlet gives
K = Q Lx/(Ly Δp). (On a patch 8 long wavelengths wide it is up to a fifth above the component of
the conductivity tensor, whose current need not cross straight ends.)
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from fem_seal import parallel
from fem_seal.contact.load_path import Predictor
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.errors import present
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.steps import elastic_contact
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.seal_flow import MOST_FALL, SealFlow

TOLERANCE = 0.1  # (upper - lower)/√(lower upper) of the leak rate of a seal
MOST_LOADS = 40
# Part of the error of the load table that is refined at a time (Dörfler).
SHARE = 0.5


class LoadedPatch:
    """A patch under any net load, each computed once.

    Parameters
    ----------
    patch : Patch
        Of a scene with an elastic contact on a grid. Its own load does not count.
    """

    def __init__(self, patch: Patch):
        self.patch = patch
        self.reasons: list[str] = []
        self._states: dict[float, ContactState] = {}
        self._bounds: dict[float, tuple[float, float]] = {}

    def bounds(self, load: float) -> tuple[float, float]:
        """Bounds of K at a net load [Pa].

        The contact starts from an extrapolation of the two states nearest in load.

        Returns
        -------
        (lower, upper) : (float, float)
            K [m³/(Pa s)]; both 0 where the patch is sealed.

        Raises
        ------
        NotConverged
            If the contact is not solved to its tolerance.
        """
        if load not in self._bounds:
            self._states[load] = parallel.on_root(lambda: self._pressed(load), self.patch.comm)
            self._bounds[load] = self._conductivity(self._states[load])
        return self._bounds[load]

    def table(self, loads: Sequence[float] = ()) -> ConductivityTable:
        """Table of all loads computed so far, and of these [Pa]."""
        for load in sorted(loads):
            self.bounds(load)
        rows = sorted((load, *bounds) for load, bounds in self._bounds.items())
        return ConductivityTable(*np.array(rows).T)

    def _pressed(self, load: float) -> ContactState:
        nearest = sorted(self._states, key=lambda known: abs(known - load))[:2]
        predictor = Predictor()
        for known in reversed(nearest):
            predictor.remember(Load("pressure", known), self._states[known])
        wanted = Load("pressure", load)
        patch = self.patch
        surface = present(patch.surface, "surface")
        return elastic_contact(patch.scene, surface, predictor.start(wanted), wanted, patch.report)

    def _conductivity(self, state: ContactState) -> tuple[float, float]:
        patch = self.patch
        film = patch.film_of(state.gap)
        leak = LeakRate.sealed("") if film.sealed else patch.leak_rate_of(film)
        if not leak.converged:
            self.reasons.append(f"at a net load of {state.mean_pressure:g} Pa: {leak.reason}")
        length, width = state.gap.size
        per_rate = length / (width * patch.scene.drive.pressure_drop)
        lower, upper = leak.bounds
        return lower * per_rate, upper * per_rate


@dataclass(frozen=True, eq=False)
class PatchFlow:
    """A patch's table, and what a seal leaks all of whose patches are like it.

    Parameters
    ----------
    table : ConductivityTable or None
        None if the seal lifts off.
    flow : SealFlow
    converged : bool
        Whether the bounds are as near each other as asked for.
    reason : str
        Why not, else empty.
    """

    table: ConductivityTable | None
    flow: SealFlow
    converged: bool = True
    reason: str = ""


def refined(
    patch: LoadedPatch,
    flow_of: Callable[[ConductivityTable], SealFlow],
    highest: float,
    inlet: float,
    outlet: float,
    *,
    uniform: bool,
    tolerance: float = TOLERANCE,
    most_loads: int = MOST_LOADS,
) -> PatchFlow:
    """Add loads to a patch's table until the leak rate of the seal is known to a tolerance.

    Intervals of the table are halved where K changes most, weighted with the influence on the leak
    rate of the places that have their loads.

    Parameters
    ----------
    patch : LoadedPatch
    flow_of : callable
        The seal's leak rate from a table.
    highest : float
        Largest contact pressure of the profile [Pa].
    inlet, outlet : float
        Pressures above ambient [Pa].
    uniform : bool
        Whether the contact pressure is the same everywhere; then the seal has no net load below
        highest - inlet.
    tolerance : float
        Of (upper - lower)/√(lower upper).
    most_loads : int

    Returns
    -------
    PatchFlow

    Raises
    ------
    NotConverged
        If a contact is not solved to its tolerance.
    """
    if highest <= inlet:
        return PatchFlow(None, SealFlow("lifted off", inf, inf, inf))
    # The highest net load that can let no fluid pass decides whether the seal is sealed.
    decisive = highest - inlet
    table = patch.table([decisive])
    if table.sealing_load == decisive:
        return PatchFlow(table, flow_of(table))
    below = np.empty(0) if uniform else np.linspace(0, decisive, 4, endpoint=False)
    table = patch.table([*below, highest - outlet])
    while True:
        flow = flow_of(table)
        if _width(flow) <= tolerance:
            return PatchFlow(table, flow)
        error, from_loads = _load_error(table, flow)
        marked = _marked(error, from_loads, tolerance)
        loads = 0.5 * (table.loads[:-1] + table.loads[1:])[marked]
        if not loads.size or table.loads.size + loads.size > most_loads:
            return PatchFlow(table, flow, False, _reason(patch, flow, tolerance, most_loads))
        table = patch.table(loads)


def _width(flow: SealFlow) -> float:
    if flow.upper == 0:
        return 0.0
    return (flow.upper - flow.lower) / np.sqrt(flow.lower * flow.upper) if flow.lower else inf


def _load_error(table: ConductivityTable, flow: SealFlow) -> tuple[np.ndarray, float]:
    """Part of ln(upper/lower) of the leak rate that each interval of the loads makes.

    Returns
    -------
    error : (n - 1,) float
    total : float
    """
    along = present(flow.path, "path of the flow")
    net = along.contact_pressure - along.fluid_pressure
    interval = np.searchsorted(table.loads, 0.5 * (net[1:] + net[:-1])) - 1
    known = (interval >= 0) & (interval < table.loads.size - 1)
    shares = np.bincount(interval[known], along.influence[known], table.loads.size - 1)
    if flow.lower == 0 and table.lower[-1] == 0:
        # Only the load that lets no fluid pass is wanted.
        shares[np.argmax(table.lower[1:] == 0)] = 1.0
    K = np.maximum(table.value, table.value[0] * np.exp(-MOST_FALL))
    error = shares * np.log(K[:-1] / K[1:])
    return error, float(error.sum())


def _marked(error: np.ndarray, total: float, tolerance: float) -> np.ndarray:
    """Intervals that make the larger part of the error; none if the loads are not to blame."""
    if total <= 0.2 * tolerance:
        return np.zeros(0, dtype=int)
    order = np.argsort(error)[::-1]
    count = 1 + int(np.searchsorted(np.cumsum(error[order]), SHARE * total))
    return order[:count]


def _reason(patch: LoadedPatch, flow: SealFlow, tolerance: float, most_loads: int) -> str:
    if patch.reasons:
        return patch.reasons[0]
    return (
        f"the leak rate of the seal is known to {_width(flow):.2g} with at most {most_loads} "
        f"loads, {tolerance:.2g} was asked for; raise seal.max_loads or lower flow.rtol"
    )
