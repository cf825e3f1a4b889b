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

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass
from math import exp, inf, log, pi, sqrt
from typing import TypeVar

import numpy as np

from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.fluid import Drive, GasDrive
from fem_seal.leak_rate import FlowState
from fem_seal.upscaling.conductivity import ConductivitySteps, ConductivityTable
from fem_seal.upscaling.profile import Profile

CELLS = 1000  # least number of cells of the leak path
# Relative error of the leak rate that solves the boundary condition; bounds are widened by it.
SHOOTING = 1e-9
ROUNDING = 1e-12  # relative rounding error of a pressure
# Length of a step in ln Q by which an end of the searched range is moved, and most such steps.
WIDENING, MOST_WIDENINGS = 5.0, 100
# Most iterations of the search: fifty halvings of a range of 1000 make it shorter than SHOOTING.
MOST_ITERATIONS = 100
RELATIVE = 4 * np.finfo(float).eps  # smallest relative tolerance that SciPy accepts
PLACES = 8  # places in each cell at which the influence is computed
PARTS = (0.05, 0.5, 0.95)  # of the influence before start, middle and end of the sealing part
# Largest ln of the ratio of two conductivities; a sealed load counts as so much less conductive.
MOST_FALL = 20.0


@dataclass(frozen=True)
class StraightPath:
    """A leak path of constant width.

    Parameters
    ----------
    length : float
        L along the flow [m].
    circumference : float
        W across it [m].

    Raises
    ------
    InvalidInput
        If a length is not positive.
    """

    length: float
    circumference: float

    def __post_init__(self) -> None:
        if not (self.length > 0 and self.circumference > 0):
            raise InvalidInput("leak path and circumference of a seal must be positive")

    def resistance(self, x: np.ndarray) -> np.ndarray:
        """∫ dx/W from the inlet to x [m], without unit."""
        return np.asarray(x) / self.circumference


@dataclass(frozen=True)
class RingPath:
    """A flat ring, through which the fluid leaks from one radius to the other.

    Parameters
    ----------
    inlet_radius, outlet_radius : float
        Radii [m]; the inlet may be inside or outside.

    Raises
    ------
    InvalidInput
        If the radii are not positive or equal.
    """

    inlet_radius: float
    outlet_radius: float

    def __post_init__(self) -> None:
        if not (min(self.inlet_radius, self.outlet_radius) > 0 and self.length > 0):
            raise InvalidInput("the radii of a ring must be positive and differ")

    @property
    def length(self) -> float:
        """``L = |r_outlet - r_inlet|`` [m]."""
        return abs(self.outlet_radius - self.inlet_radius)

    @property
    def circumference(self) -> float:
        """Mean circumference [m]."""
        return pi * (self.outlet_radius + self.inlet_radius)

    def resistance(self, x: np.ndarray) -> np.ndarray:
        """``|ln(r/r_inlet)|``/(2π) from the inlet to x [m], without unit."""
        outwards = 1 if self.outlet_radius > self.inlet_radius else -1
        return np.abs(np.log1p(outwards * np.asarray(x) / self.inlet_radius)) / (2 * pi)


LeakPath = StraightPath | RingPath
Number = TypeVar("Number", float, np.ndarray)


@dataclass(frozen=True)
class EndPressures:
    """Pressures above ambient at both ends, and the quantity Φ whose gradient drives the fluid.

    Parameters
    ----------
    inlet, outlet : float
        p_in > p_out [Pa], above the pressure on the back of the solid.
    ambient : float
        Absolute pressure on the back of the solid [Pa]; used for a gas only.
    per_square : float
        0 for a liquid, Φ = p. For a gas T0/(2 T p0) [1/Pa], Φ = per_square × p_abs²: volumes count
        at T0 and p0.

    Raises
    ------
    InvalidInput
        If the inlet's pressure is not above the outlet's.
    """

    inlet: float
    outlet: float = 0.0
    ambient: float = 0.0
    per_square: float = 0.0

    def __post_init__(self) -> None:
        if not self.inlet > self.outlet:
            raise InvalidInput(
                f"the inlet's pressure, {self.inlet:g} Pa, must be above the outlet's, "
                f"{self.outlet:g} Pa"
            )

    @classmethod
    def of(cls, drive: Drive, gauge_pressures: tuple[float, float]) -> "EndPressures":
        """Take the pressures of a scene.

        Parameters
        ----------
        drive : LiquidDrive or GasDrive
        gauge_pressures : (float, float)
            Pressures of inlet and outlet above ambient [Pa].
        """
        inlet, outlet = gauge_pressures
        if not isinstance(drive, GasDrive):
            return cls(inlet, outlet)
        squares = drive.inlet_pressure**2 - drive.outlet_pressure**2
        ambient = drive.outlet_pressure - outlet
        return cls(inlet, outlet, ambient, drive.pressure_drop / squares)

    def potential(self, pressure: Number) -> Number:
        """Φ [Pa] of a pressure above ambient [Pa], or of many."""
        if self.per_square == 0:
            return pressure
        return self.per_square * (pressure + self.ambient) ** 2

    @property
    def drop(self) -> float:
        """Φ(p_in) - Φ(p_out) [Pa]."""
        return self.potential(self.inlet) - self.potential(self.outlet)


@dataclass(frozen=True)
class SealingPart:
    """The part of the leak path that seals.

    Parameters
    ----------
    start, middle, end : float
        Distances from the inlet [m]. Of the influence on the leak rate 5 % lie before the start,
        half before the middle, and 5 % behind the end. Of a sealed seal: start and end of the part
        that no fluid passes, and the middle between them.
    """

    start: float
    middle: float
    end: float


@dataclass(frozen=True, eq=False)
class PathFlow:
    """Pressures and conductivity along the leak path, from the inlet to the outlet.

    Parameters
    ----------
    x : (n,) float
        Ends of the cells [m].
    contact_pressure, fluid_pressure : (n,) float
        P and p [Pa], p above ambient.
    conductivity : (n,) float
        K(P - p) [m³/(Pa s)]; infinite where the film is open, P <= p.
    net_loads, influences : (n - 1, m) float
        Net loads [Pa] along each cell, and the influence of ln K at each of them on ln Q: d ln Q =
        Σ influence × d ln K. The sum is 1.
    """

    x: np.ndarray
    contact_pressure: np.ndarray
    fluid_pressure: np.ndarray
    conductivity: np.ndarray
    net_loads: np.ndarray
    influences: np.ndarray

    @property
    def influence(self) -> np.ndarray:
        """Influence of each cell's ln K on ln Q, (n - 1,) float."""
        return self.influences.sum(axis=1)

    @property
    def sealing_length(self) -> float:
        """Length [m] of the path that seals: 1/Σ influence²/Δx, at most the whole path."""
        return float(1 / np.sum(self.influence**2 / np.diff(self.x)))

    @property
    def sealing(self) -> "SealingPart":
        """The part of the path that has 90 % of the influence on the leak rate."""
        total = np.concatenate([[0.0], np.cumsum(self.influence)])
        start, middle, end = np.interp(PARTS, total / total[-1], self.x)
        return SealingPart(float(start), float(middle), float(end))


@dataclass(frozen=True, eq=False)
class SealFlow:
    """Leak rate of a seal with bounds, under the hypothesis that the scales are apart.

    Parameters
    ----------
    state : FlowState
        "lifted off": P <= p_in everywhere, there is no contact left and no leak rate.
    value, lower, upper : float
        Leak rate [m³/s], of a gas at reference conditions; 0 if sealed, infinite if lifted off.
    path : PathFlow or None
        Pressures and conductivity along the path at the value. If sealed, no place has an
        influence; if lifted off, the fluid has the pressure of the inlet everywhere.
    sealing : SealingPart or None
        Part of the path that seals; None if lifted off.
    bounding : tuple of PathFlow
        The same at the lower and at the upper bound, if they are positive and finite.
    """

    state: FlowState
    value: float
    lower: float
    upper: float
    path: PathFlow | None = None
    sealing: SealingPart | None = None
    bounding: tuple[PathFlow, ...] = ()


def seal_flow(
    table: ConductivityTable,
    profile: Profile,
    path: LeakPath,
    ends: EndPressures,
    *,
    cells: int = CELLS,
) -> SealFlow:
    """Leak rate of a seal all of whose patches have the conductivity of a table.

    Parameters
    ----------
    table : ConductivityTable
        K of a patch against its net load.
    profile : Profile
        Contact pressure P(x).
    path : StraightPath or RingPath
        Of the profile's length.
    ends : EndPressures
    cells : int
        Least number of cells of the leak path, which are equally long but for the nodes of the
        profile. The bounds hold for any number.

    Returns
    -------
    SealFlow

    Raises
    ------
    InvalidInput
        If profile and leak path differ in length.
    """
    if abs(profile.length - path.length) > 1e-9 * path.length:
        raise InvalidInput(
            f"the pressure profile is {profile.length:g} m long and the leak path {path.length:g} m"
        )
    if profile.highest <= ends.inlet:
        return lifted_off(profile, ends, cells)
    if profile.highest - ends.inlet >= table.sealing_load:
        sealing = _sealed_part(profile, ends.inlet + table.sealing_load, cells)
        along = _sealed_path(table, profile, sealing, ends, cells)
        return SealFlow("sealed", 0.0, 0.0, 0.0, along, sealing)
    x = _cell_ends(profile, cells)
    P, s = profile(x), path.resistance(x)
    low, high = np.minimum(P[:-1], P[1:]), np.maximum(P[:-1], P[1:])
    middle = profile(0.5 * (x[:-1] + x[1:]))
    lengths = np.diff(s)
    lower = _leak_rate(table.lowest, high, lengths, ends) * (1 - 2 * SHOOTING)
    upper = _leak_rate(table.highest, low, lengths, ends) * (1 + 2 * SHOOTING)
    value = _leak_rate(table.interpolated, middle, lengths, ends)
    cuts = [(table.interpolated, middle, value), (table.lowest, high, lower)]
    cuts.append((table.highest, low, upper))
    along, *bounding = (
        _path_flow(steps, profile, x, P, lengths, ends, rate)
        for steps, P, rate in cuts
        if 0 < rate < inf
    )
    return SealFlow("leaking", value, lower, upper, along, along.sealing, tuple(bounding))


def lifted_off(profile: Profile, ends: EndPressures, cells: int = CELLS) -> SealFlow:
    """Flow of a seal whose contact pressure is nowhere above the pressure of the inlet."""
    x = np.union1d(np.linspace(0, profile.length, cells + 1), profile.nodes)
    none = np.zeros((len(x) - 1, 0))
    along = PathFlow(x, profile(x), np.full_like(x, ends.inlet), np.full_like(x, inf), none, none)
    return SealFlow("lifted off", inf, inf, inf, along)


def _sealed_part(profile: Profile, pressure: float, cells: int) -> SealingPart:
    """The part of the path on which the contact pressure is at least a pressure [Pa]."""
    x = np.union1d(np.linspace(0, profile.length, cells + 1), profile.nodes)
    sealed = x[profile(x) >= pressure]
    start, end = float(sealed.min()), float(sealed.max())
    return SealingPart(start, 0.5 * (start + end), end)


def _sealed_path(
    table: ConductivityTable,
    profile: Profile,
    sealing: SealingPart,
    ends: EndPressures,
    cells: int,
) -> PathFlow:
    """Pressures along a sealed path: p_in before the part that seals, p_out behind it."""
    x = np.unique(np.append(np.linspace(0, profile.length, cells + 1), profile.nodes))
    P, none = profile(x), np.empty((x.size - 1, 0))
    fluid = np.where(x <= sealing.middle, ends.inlet, ends.outlet)
    return PathFlow(x, P, fluid, table.interpolated(P - fluid), none, none)


def _cell_ends(profile: Profile, cells: int) -> np.ndarray:
    """Ends [m] of at least `cells` cells, with the nodes of the profile; one cell if uniform."""
    if len(profile.nodes) == 2 and np.ptp(profile(profile.nodes)) == 0:
        return profile.nodes
    even = np.linspace(0, profile.length, cells + 1)
    return np.union1d(even, profile.nodes)


def _leak_rate(
    steps: ConductivitySteps, pressure: np.ndarray, lengths: np.ndarray, ends: EndPressures
) -> float:
    """Leak rate [m³/s] at which the fluid has the inlet's pressure at the inlet.

    Parameters
    ----------
    steps : ConductivitySteps
    pressure, lengths : (n,) float
        P of each cell [Pa], and its Δs.
    ends : EndPressures
    """
    net = pressure.max() - ends.inlet
    if net <= 0:
        return inf
    # The place of the highest load decides: K is 0 there if the seal is sealed, infinite if open.
    K = float(steps(np.nextafter(net, inf)))
    if K in (0.0, inf):
        return K
    march = _March(steps, pressure, lengths, ends)
    finite = steps.conductivity[np.isfinite(steps.conductivity) & (steps.conductivity > 0)]
    scale = ends.drop / lengths.sum()
    low, high = log(finite.min() * scale) - 1, log(finite.max() * scale) + 1
    return exp(_root(lambda log_rate: march.excess(exp(log_rate)), low, high))


def _root(
    excess: Callable[[float], float],
    low: float,
    high: float,
    *,
    most: int = MOST_ITERATIONS,
) -> float:
    """Root of an excess that grows with ln Q, from two guesses of its bracket.

    Algorithm 748 halves its bracket in each iteration at least (G. E. Alefeld, F. A. Potra and
    Y. Shi, ACM Trans. Math. Softw. 21, 327 (1995)), so that `MOST_ITERATIONS` are never needed.

    Parameters
    ----------
    excess : callable
        Of ln Q, without unit.
    low, high : float
        Guesses of ln Q, moved until one is below the root and the other above.
    most : int
        Largest number of iterations.

    Raises
    ------
    NotConverged
        If no bracket is found, or the iterations end before ln Q is known to `SHOOTING`.
    """
    from scipy.optimize import toms748

    low, high = _widened(excess, low, -WIDENING), _widened(excess, high, WIDENING)
    # A root at an end of the bracket is returned as it is.
    root, outcome = toms748(
        excess, low, high, xtol=SHOOTING, rtol=RELATIVE, maxiter=most, full_output=True, disp=False
    )
    if not outcome.converged:
        raise NotConverged(
            f"the leak rate at which the fluid has the inlet's pressure at the inlet is not known "
            f"after {outcome.iterations} iterations: ln Q is near {root:.6g} (Q in m^3/s), with "
            f"{SHOOTING:g} asked for; this is a defect of fem_seal, please report it"
        )
    return float(root)


def _widened(excess: Callable[[float], float], log_rate: float, step: float) -> float:
    """Move ln Q in steps until the excess is 0 or has the sign of the step.

    Raises
    ------
    NotConverged
        If `MOST_WIDENINGS` steps are not enough.
    """
    for _ in range(MOST_WIDENINGS):
        reached = excess(log_rate)
        if reached * step >= 0:
            return log_rate
        log_rate += step
    raise NotConverged(
        f"no leak rate gives the fluid the inlet's pressure at the inlet: at ln Q = "
        f"{log_rate - step:.6g} (Q in m^3/s) it still differs by {abs(reached):.3g} of the "
        "pressure drop"
    )


class _March:
    """Integration of dΦ/ds = -Q/K from the outlet to the inlet, cell by cell.

    Parameters
    ----------
    steps : ConductivitySteps
    pressure, lengths : (n,) float
        P of each cell [Pa], and its Δs; the first cell is at the inlet.
    ends : EndPressures
    """

    def __init__(
        self,
        steps: ConductivitySteps,
        pressure: np.ndarray,
        lengths: np.ndarray,
        ends: EndPressures,
    ):
        self._loads, self._K = steps.loads.tolist(), steps.conductivity.tolist()
        self._cells = list(zip(pressure[::-1].tolist(), lengths[::-1].tolist(), strict=True))
        self._ends, self._length = ends, float(lengths.sum())
        closed = np.flatnonzero(pressure > ends.inlet)
        # Δs of the cells at the inlet whose film is open.
        self._open = float(lengths[: closed[0]].sum()) if closed.size else self._length

    def excess(self, rate: float) -> float:
        """By how much a leak rate Q [m³/s] is too large, without unit; negative if too small.

        If Q is too small, the pressure at the inlet is below p_in: the excess is the difference
        over the pressure drop. If Q is too large, the pressure reaches p_in before the inlet: the
        excess is the part of ∫ ds that is left. It is nearly linear in ln Q on either side of the
        leak rate.
        """
        # If the first load of the table is P - p_in, p stops at p_in for all larger Q, and the leak
        # rate is the smallest root. Rounding of P - (P - p_in) must not hide it: aim a little below
        # p_in.
        drop = self._ends.inlet - self._ends.outlet
        target = self._ends.inlet - ROUNDING * drop
        p, left = self._marched(rate, target, [])
        if p < target:
            return (p - target) / drop
        return (left - self._open) / self._length

    def pressures(self, rate: float) -> np.ndarray:
        """Fluid pressure [Pa] at the ends of the cells, the inlet first."""
        visited = [self._ends.outlet]
        self._marched(rate, inf, visited)
        return np.array(visited[::-1])

    def _marched(self, rate: float, target: float, visited: list[float]) -> tuple[float, float]:
        """Last pressure [Pa], and ∫ ds from there to the inlet.

        The march ends where p reaches the target [Pa]. The pressure at the inlet's side of each
        cell is appended to `visited`.
        """
        loads, K, per_square, ambient = (
            self._loads, self._K, self._ends.per_square, self._ends.ambient,
        )  # fmt: skip
        p, left = self._ends.outlet, self._length
        potential = self._ends.potential(p)
        for P, length in self._cells:
            flux = rate * length
            # At step k the load has the conductivity K[k] until it has fallen to loads[k - 1].
            step = bisect_left(loads, P - p) if p < P else -1
            while step >= 0 and K[step] != inf:
                next_p = min(P - loads[step - 1] if step else P, target)
                next_potential = per_square * (next_p + ambient) ** 2 if per_square else next_p
                rise = K[step] * (next_potential - potential)
                if rise >= flux and K[step] > 0:
                    potential += flux / K[step]
                    p = sqrt(potential / per_square) - ambient if per_square else potential
                    p = min(next_p, p)
                    flux = 0.0
                    break
                flux -= rise
                p, potential = next_p, next_potential
                if p >= target:
                    return p, left - length * (1 - flux / (rate * length))
                step -= 1
            visited.append(p)
            left -= length
        return p, left


def _path_flow(
    steps: ConductivitySteps,
    profile: Profile,
    x: np.ndarray,
    middle: np.ndarray,
    lengths: np.ndarray,
    ends: EndPressures,
    rate: float,
) -> PathFlow:
    """Pressures along the path at a leak rate [m³/s]; see `seal_flow`."""
    if len(lengths) == 1:
        # A uniform profile is solved in one cell, and drawn in many.
        x = np.linspace(0, x[-1], CELLS + 1)
        middle, lengths = np.full(CELLS, middle[0]), np.full(CELLS, lengths[0] / CELLS)
    fluid = _March(steps, middle, lengths, ends).pressures(rate)
    P = profile(x)
    net, influences = _influences(steps, middle, fluid, ends)
    return PathFlow(x, P, fluid, steps(P - fluid), net, influences)


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
    known = K[(K > 0) & np.isfinite(K)]
    # At loads that seal, K counts as exp(-MOST_FALL) of the smallest K that leaks.
    least = max(known.min(initial=1.0) * np.exp(-MOST_FALL), np.finfo(float).tiny)
    log_K = np.log(np.clip(K, least, max(known.max(initial=0.0), least)))
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
