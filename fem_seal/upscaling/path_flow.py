"""Leak rate of a seal whose film conducts K(P(x) - p): scales apart.

Where the roughness is much finer than the leak path, the film at x sees one fluid pressure p(x) and
conducts what a patch does at the net load P(x) - p. With s = ∫ dx/width(x) along the path,

    K(P(x) - p) dΦ/ds = -Q,    Φ = p of a liquid, T0 p_abs²/(2 T p0) of a gas (`fluid`).

The equation is integrated from the outlet backwards. In each cell P takes its smallest or largest
value and K is a step function of the load, so that every cell is solved exactly: Φ rises by
Q Δs/K(w) until w = P - p reaches the next step. The resistance 1/K(P - p) falls with p and grows
with P. A larger resistance everywhere makes p at the inlet larger, and so does a larger Q. So the
upper steps of K with the smallest P of each cell bound Q from above, the lower steps with the
largest P from below. Where P <= p the film is open, K is infinite and p constant: the seal begins
where P = p_in.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from fem_seal.arguments import require_count
from fem_seal.errors import Inconsistent, InvalidInput
from fem_seal.leak_rate import Bounded, FlowState
from fem_seal.pressure_profile import Profile, is_uniform
from fem_seal.upscaling.conductivity import ConductivitySteps, ConductivityTable
from fem_seal.upscaling.leak_path import EndPressures, LeakPath
from fem_seal.upscaling.march import SHOOTING, March, path_leak_rate

LEAST_CELLS = 1000  # least number of cells of the leak path
COARSE = 4  # one in so many of them is laid evenly, the others where the total pressure matters
PLACES = 8  # places in each cell at which the influence is computed
# Parts of the influence before start, middle and end of the part that decides.
INFLUENCE_BEFORE = (0.05, 0.5, 0.95)
# Largest ln of the ratio of two conductivities; one of 0 counts as smaller by that ratio.
MOST_FALL = 20.0


@dataclass(frozen=True)
class SealingPart:
    """The part of the leak path that decides the leak rate."""

    #: distances from the inlet [m]. Of the influence on the leak rate 5 % lie before the start,
    #: half before the middle, and 5 % behind the end. For a sealed seal: start and end of the part
    #: that no fluid passes, and the middle between them
    start: float
    middle: float
    end: float


@dataclass(frozen=True, eq=False)
class PathFlow:
    """Pressures and conductivity along the leak path, from the inlet to the outlet."""

    x: np.ndarray  #: (n,), ends of the cells [m]
    total_pressure: np.ndarray  #: (n,), P [Pa], which solid and fluid carry together
    fluid_pressure: np.ndarray  #: (n,), p [Pa] above ambient
    conductivity: np.ndarray  #: (n,), K(P - p) [m³/(Pa s)]; infinite where the film is open, P <= p
    #: (n - 1, m), net loads [Pa] along each cell, and the influence of ln K at each of them on ln
    #: Q: d ln Q = Σ influence × d ln K. The sum is 1
    net_loads: np.ndarray
    influences: np.ndarray

    def __post_init__(self) -> None:
        shapes = {values.shape for values in (self.x, self.total_pressure, self.fluid_pressure)}
        if shapes != {self.conductivity.shape} or not (np.diff(self.x) > 0).all():
            raise Inconsistent(f"a leak path whose cells are out of order, of shapes {shapes}")

    @property
    def influence(self) -> np.ndarray:
        """Influence of each cell's ln K on ln Q, (n - 1,) float."""
        return self.influences.sum(axis=1)

    @property
    def sealing_length(self) -> float:
        """Length [m] of the path that decides: 1/Σ influence²/Δx, at most the whole path."""
        return float(1 / np.sum(self.influence**2 / np.diff(self.x)))

    @property
    def sealing(self) -> "SealingPart":
        """The part of the path that has 90 % of the influence on the leak rate."""
        total = np.concatenate([[0.0], np.cumsum(self.influence)])
        start, middle, end = np.interp(INFLUENCE_BEFORE, total / total[-1], self.x)
        return SealingPart(float(start), float(middle), float(end))


@dataclass(frozen=True, eq=False)
class SealFlow(Bounded):
    """Leak rate [m³/s] of a seal of equal patches, under the hypothesis that scales are apart.

    It is that of a gas at reference conditions; 0 if sealed, infinite if lifted off.
    """

    #: "lifted off": P <= p_in everywhere, there is no contact left and no leak rate
    state: FlowState
    #: pressures and conductivity along the path at the value. If sealed, no place has an influence;
    #: if lifted off, the fluid has the pressure of the inlet everywhere
    path: PathFlow | None = None
    sealing: SealingPart | None = None  #: part of the path that decides; None if lifted off
    table: ConductivityTable | None = None  #: conductivity of the patches; None if lifted off
    #: why the bounds do not meet a tolerance, and what to change; empty if they do
    reason: str = ""


def seal_flow(
    table: ConductivityTable,
    profile: Profile,
    path: LeakPath,
    ends: EndPressures,
    *,
    cells: int = LEAST_CELLS,
) -> SealFlow:
    """Leak rate of a seal all of whose patches have the conductivity of a table.

    The leak path has at least so many cells, finer where the total pressure changes in a cell and
    matters. The bounds hold for any number.
    """
    require_count(cells=cells)
    if abs(profile.length - path.length) > 1e-9 * path.length:
        raise InvalidInput(
            f"the pressure profile is {profile.length:g} m long and the leak path {path.length:g} m"
        )
    if profile.highest <= ends.inlet:
        return lifted_off(profile, ends)
    if profile.highest - ends.inlet >= table.sealing_load:
        return _sealed(table, profile, ends)
    if table.sealing_load == table.loads[0]:
        raise InvalidInput(
            f"the smallest load of the conductivity table, {table.loads[0]:g} Pa, seals, and the "
            f"seal has at most {profile.highest - ends.inlet:g} Pa where the fluid has the inlet's "
            "pressure; the table needs a load there at which the patch leaks"
        )
    # A uniform profile is solved in one cell. Another one is solved twice: only a first flow tells
    # where the total pressure matters.
    x = profile.nodes if is_uniform(profile) else _cell_ends(profile, ends, cells // COARSE)
    laid = _Cells.of(profile, path, x)
    value = path_leak_rate(table.interpolated, laid.pressure, laid.lengths, ends)
    if not is_uniform(profile):
        x = _refined(laid.flow(table.interpolated, ends, value), cells)
        laid = _Cells.of(profile, path, x)
        value = path_leak_rate(table.interpolated, laid.pressure, laid.lengths, ends)
    # A K that is too small everywhere gives a Q that is too small.
    P = profile(x)
    low, high = np.minimum(P[:-1], P[1:]), np.maximum(P[:-1], P[1:])
    lower = path_leak_rate(table.lowest, high, laid.lengths, ends) * (1 - 2 * SHOOTING)
    upper = path_leak_rate(table.highest, low, laid.lengths, ends) * (1 + 2 * SHOOTING)
    value = float(np.clip(value, lower, upper))
    along = laid.flow(table.interpolated, ends, value)
    return SealFlow(value, lower, upper, "leaking", along, along.sealing, table)


@dataclass(frozen=True, eq=False)
class _Cells:
    """The leak path in n cells, each of one total pressure."""

    profile: Profile
    path: LeakPath
    x: np.ndarray  #: (n + 1,), ends of the cells [m]
    pressure: np.ndarray  #: (n,), P of each cell [Pa]
    lengths: np.ndarray  #: (n,), Δs

    @classmethod
    def of(cls, profile: Profile, path: LeakPath, x: np.ndarray) -> "_Cells":
        """Cells with the total pressure of their middle."""
        return cls(profile, path, x, profile(0.5 * (x[:-1] + x[1:])), np.diff(path.resistance(x)))

    def flow(self, steps: ConductivitySteps, ends: EndPressures, rate: float) -> PathFlow:
        """Pressures along the path at a leak rate [m³/s]."""
        laid = self
        if is_uniform(self.profile):
            # A uniform profile is solved in one cell, and drawn in many.
            laid = self.of(self.profile, self.path, np.linspace(0, self.x[-1], LEAST_CELLS + 1))
        fluid = March(steps, laid.pressure, laid.lengths, ends).pressures(rate)
        P = self.profile(laid.x)
        net, influences = _influences(steps, laid.pressure, fluid, ends)
        return PathFlow(laid.x, P, fluid, steps(P - fluid), net, influences)


def lifted_off(profile: Profile, ends: EndPressures) -> SealFlow:
    """Flow of a seal whose total pressure is nowhere above the pressure of the inlet."""
    x = _cell_ends(profile, ends, LEAST_CELLS)
    none = np.zeros((len(x) - 1, 0))
    along = PathFlow(x, profile(x), np.full_like(x, ends.inlet), np.full_like(x, inf), none, none)
    return SealFlow(inf, inf, inf, "lifted off", along)


def _sealed(table: ConductivityTable, profile: Profile, ends: EndPressures) -> SealFlow:
    """A sealed flow: p_in before the middle of the part that seals, p_out behind it."""
    x = _cell_ends(profile, ends, LEAST_CELLS)
    P, none = profile(x), np.empty((x.size - 1, 0))
    # The highest pressure seals, also where rounding puts it below the load of the table.
    sealed = x[P - ends.inlet >= min(table.sealing_load, P.max() - ends.inlet)]
    start, end = float(sealed.min()), float(sealed.max())
    middle = 0.5 * (start + end)
    fluid = np.where(x <= middle, ends.inlet, ends.outlet)
    along = PathFlow(x, P, fluid, table.interpolated(P - fluid), none, none)
    sealing = SealingPart(start, middle, end)
    return SealFlow(0.0, 0.0, 0.0, "sealed", along, sealing, table=table)


def _cell_ends(profile: Profile, ends: EndPressures, cells: int) -> np.ndarray:
    """Ends [m] of at least `cells` cells, with the nodes of the profile and where P = p_in.

    Without the last ones a peak narrower than a cell would seal nowhere.
    """
    from scipy.optimize import brentq

    nodes, tolerance = profile.nodes, 1e-12 * profile.length
    closes = np.flatnonzero(np.diff(profile(nodes) > ends.inlet))
    crossings = [
        brentq(lambda x: float(profile(x)) - ends.inlet, *nodes[k : k + 2], xtol=tolerance)
        for k in closes
    ]
    even = np.linspace(0, profile.length, cells + 1)
    start, *inner, end = np.unique(np.concatenate([even, nodes, crossings])).tolist()
    # A node of a table may differ from an even place by rounding alone, which leaves no cell.
    before = [start, *inner[:-1]]
    kept = [x for x, last in zip(inner, before, strict=True) if min(x - last, end - x) > tolerance]
    return np.array([start, *kept, end])


def _refined(along: PathFlow, cells: int) -> np.ndarray:
    """Ends [m] of cells that cut those of a flow into about `cells` parts more.

    A cell in which the total pressure changes by ΔP sets the bounds of ln Q apart by its
    influence times |d ln K/dw| ΔP. The sum is least with parts in proportion to the root of that.
    """
    apart = np.sqrt(along.influence * np.abs(np.diff(along.total_pressure)))
    apart = np.convolve(apart, np.ones(3), "same")  # the bounds matter a little beside the value
    # All are 0 where the influence of every cell with a ΔP rounds to 0.
    parts = 1 + (cells * apart / max(apart.sum(), np.finfo(float).tiny)).astype(int)
    return np.interp(np.arange(parts.sum() + 1), np.append(0, np.cumsum(parts)), along.x)


def _influences(
    steps: ConductivitySteps, middle: np.ndarray, fluid: np.ndarray, ends: EndPressures
) -> tuple[np.ndarray, np.ndarray]:
    """Net loads along each cell, and their influence on the leak rate; see `PathFlow`.

    A change δ ln K changes p by δp with (δp)' + a δp = -(dp/ds) (δ ln K - δ ln Q), where
    a = d ln K/dp dp/ds at constant P, and δp = 0 at both ends. Hence the influence is -μ dp with
    μ = exp(∫ a ds). Each cell has one P, so that μ is proportional to K in it.
    """
    loads, K = 0.5 * (steps.loads[1:] + steps.loads[:-1]), steps.conductivity[1:-1]
    if not K.size:
        loads, K = steps.loads, steps.conductivity[-1:]
    positive = K[(K > 0) & np.isfinite(K)]
    # At loads that seal ln K has no value: K counts as exp(-MOST_FALL) of the smallest that leaks.
    least = max(positive.min(initial=1.0) * np.exp(-MOST_FALL), np.finfo(float).tiny)
    log_K = np.log(np.clip(K, least, max(positive.max(initial=0.0), least)))
    share = (np.arange(PLACES) + 0.5) / PLACES
    pressure = fluid[:-1, None] + np.diff(fluid)[:, None] * share
    net = middle[:, None] - pressure
    at_inlet, inside, at_outlet = (
        np.interp(loads_of, loads, log_K)
        for loads_of in (middle - fluid[:-1], net, middle - fluid[1:])
    )
    before = np.append(0.0, np.cumsum(at_outlet - at_inlet)[:-1])
    log_factor = (before - at_inlet)[:, None] + inside
    edges = fluid[:-1, None] + np.diff(fluid)[:, None] * np.linspace(0, 1, PLACES + 1)
    influences = np.exp(log_factor - log_factor.max()) * -np.diff(ends.potential(edges), axis=1)
    return net, influences / influences.sum()
