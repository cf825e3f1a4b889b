"""K(w) of a scene's patch: dry contacts and flows under many loads.

K is the conductivity between straight ends: K = Q Lx/(Ly Δp), with the leak rate Q of the patch
from its inlet to its outlet. (On a patch 8 long wavelengths wide it is up to a fifth above the
component of the conductivity tensor, whose current need not cross straight ends.) For a gas that
slips, K is taken at the mean of the pressures of inlet and outlet.

A mirrored map or twin is even about the lines x = 0 and y = 0, and so is its flow: no fluid
crosses y = 0 and y = Ly/2, and the pressure is uniform at x = Lx/2. So the film is a quarter of the
patch, between walls: its K is that of the patch.

Bounds between two loads. The gap g(x; w) of a half-space falls with the load w and is convex in it
(docs/theory/scales-apart.md, from R. W. Cottle and A. F. Veinott, Math. Program. 3, 238 (1972)).
Hence for a < w < b < c

    g_b + (b - w)/(c - b) (g_b - g_c)  <=  g(w)  <=  ((b - w) g_a + (w - a) g_b)/(b - a).

The flows at b and at a bound the flow through either gap (`flow.nearby`): p of the flow at a is
that of a bound at all gaps of the chord, ψ of the flow at b at all gaps of the line. With K = g³
either bound is ∫ g³ dμ or 1/∫ g⁻³ dμ with one measure μ for all of these gaps. By Minkowski's
inequality its cube root is at most, or at least, the chord of those at both ends. With slip the
same holds for other powers of K. These bounds are narrower by one power of b - a than the
conductivities at a and b.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fem_seal import parallel
from fem_seal.contact.predictor import extrapolated
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.digits import with_prefix
from fem_seal.errors import narrowed, present
from fem_seal.film import GridFilm, film_conductivity
from fem_seal.film.slip_bounds import sag
from fem_seal.flow_settings import FlowSettings
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene_steps import elastic_contact, flow_progress
from fem_seal.upscaling.conductivity import CUBIC, SLIPPING, ConductivityTable, Enclosure

if TYPE_CHECKING:
    from fem_seal.flow.nearby import MeshedFlow
    from fem_seal.flow.solution import Start

BEYOND = 0.125  # (c - b)/(b - a), where c is the load that gives the line beyond b
# A flow is solved again if its tolerance was more than so many times the one that is asked for.
LOOSER_MULTIPLE = 2.0
# Rounding of even heights by a change of their grid, relative to their range.
HEIGHT_ROUNDING = 1e-12
SAME_PRESSURE = 1e-6  # relative distance of two pressures that count as one
# Most samples of all flows that are kept; the oldest flows are dropped first.
KEPT = 1 << 25


class SolvedLoad(NamedTuple):
    """Conductivity of a patch at a net load."""

    bounds: tuple[float, float]  #: of K [m³/(Pa s)]; both 0 where the patch is sealed
    multiple: float  #: of the patch's `rtol`, to which the flow was solved at least
    reason: str = ""  #: why the flow ended early; empty if it did not


class LoadedPatch:
    """A patch of an elastic contact on a grid under any net load, each computed once.

    The flow at each load is solved to a multiple of `rtol`. The load of the scene is not used. As
    `Patch` it keeps what it has computed, and so is not frozen.
    """

    def __init__(self, patch: Patch, rtol: float):
        self.patch, self.rtol = patch, rtol
        self._solved: dict[float, SolvedLoad] = {}
        # Contacts of other loads as well, and flows of the newest ones alone.
        self._states: dict[float, ContactState] = {}
        self._flows: dict[float, MeshedFlow] = {}
        self._enclosures: dict[tuple[float, float], Enclosure | None] = {}

    def bounds(self, load: float, multiple: float = 1.0) -> tuple[float, float]:
        """Bounds of K [m³/(Pa s)] at a net load [Pa]; both 0 where the patch is sealed.

        The flow is solved to `multiple` times `rtol` at least. The contact starts from an
        extrapolation of the two states nearest in load, the flow from the mesh and the functions of
        the nearest lower load.
        """
        if load not in self._solved or multiple < self._solved[load].multiple:
            self._solved[load] = self._solve(load, multiple)
        return self._solved[load].bounds

    @property
    def reason(self) -> str:
        """Why the flow at a load ended early; empty if none did."""
        return next((solved.reason for solved in self._solved.values() if solved.reason), "")

    @property
    def convex(self) -> bool:
        """Whether all loads agree with the enclosures of the intervals that they cut."""
        return all(
            enclosure.overlaps(solved.bounds, (load - a) / (b - a))
            for (a, b), enclosure in self._enclosures.items()
            for load, solved in self._solved.items()
            if enclosure is not None and a < load < b
        )

    def missing(self, loads: Mapping[float, float]) -> dict[float, float]:
        """Loads [Pa], each with a multiple of `rtol`, that `table` has still to compute."""
        return {
            load: multiple
            for load, multiple in loads.items()
            if load not in self._solved or self._solved[load].multiple > LOOSER_MULTIPLE * multiple
        }

    def table(self, loads: Mapping[float, float] | None = None) -> ConductivityTable:
        """Compute loads [Pa], each to a multiple of `rtol`; table of all loads so far."""
        for load, multiple in sorted(self.missing(loads or {}).items()):
            self.bounds(load, multiple)
        rows = sorted((load, *solved.bounds) for load, solved in self._solved.items())
        enclosures = self._enclosures if self.convex else {}
        between = tuple(enclosures.get(pair) for pair in pairwise(row[0] for row in rows))
        at, lower, upper = map(np.array, zip(*rows, strict=True))
        return ConductivityTable(at, lower, upper, between)

    def enclose(self) -> ConductivityTable:
        """Table with enclosures of all intervals between neighbouring loads.

        An interval has none if a flow is not kept any more, if the gap is not linear on a grid, if
        its gaps are not in order, or its bounds cross, as where the gap is not convex in the load.
        """
        for pair in pairwise(sorted(self._solved)):
            if pair not in self._enclosures:
                self._enclosures[pair] = self._enclosure(*pair)
        return self.table()

    def enclosed(self) -> np.ndarray:
        """Intervals of the table that `enclose` has seen; all if no enclosure holds."""
        pairs, none = pairwise(sorted(self._solved)), not self.convex
        return np.array([none or pair in self._enclosures for pair in pairs], dtype=bool)

    def film(self, load: float) -> GridFilm:
        """Film at a net load [Pa], a quarter of it where that will do; no flow is solved."""
        return self._film(self._gap(load))

    def settings(self, multiple: float = 1.0) -> FlowSettings:
        """Of flows to a multiple of `rtol` whose leak rate is K: under Lx/Ly as pressure drop."""
        scene, (length, width) = self.patch.scene, present(self.patch.surface, "surface").size
        return replace(
            scene.flow_settings,
            pressure_drop=length / width,
            slip=at_mean_pressure(scene.slip),
            rtol=multiple * self.rtol,
            decide=None,
            field=False,
        )

    def _enclosure(self, a: float, b: float) -> Enclosure | None:
        if a not in self._flows:
            return None
        below, gap_b = self._flows[a], self._gap(b)
        if (gap_b > self._gap(a)).any():
            return None  # by the tolerance of the contacts
        upper = self._per_square(below) * below.conductances_below(self._film(gap_b))
        lower = np.zeros(2)
        if b in self._flows:
            c = b + BEYOND * (b - a)
            line = gap_b + (b - a) / (c - b) * (gap_b - self._gap(c))
            if (line < gap_b).any():
                return None
            above = self._flows[b]
            resistances = above.resistances_above(self._film(line))
            lower = self._per_square(above) / resistances[::-1]
        if (lower > upper).any():
            return None
        slip, exponents, room = self.patch.scene.slip, CUBIC, 1.0
        if slip is not None:
            # K^m is concave and K^n convex for a smooth c, above which the chords of a table lie.
            exponents, room = SLIPPING, 1 + sag(slip.coefficient)
        return Enclosure(tuple((lower / room).tolist()), tuple((upper * room).tolist()), exponents)

    def critical_gap(self, load: float) -> float | None:
        """Gap [m] of the critical constriction at a net load [Pa]; None if sealed."""
        flow = self._flows.get(load)
        constriction = (flow.film if flow else self.film(load)).constriction
        return None if constriction is None else constriction.gap

    @cached_property
    def quartered(self) -> bool:
        """Whether a quarter of the patch has the conductivity of the whole."""
        heights = present(self.patch.surface, "surface").values
        even = partial(np.allclose, rtol=0.0, atol=HEIGHT_ROUNDING * np.ptp(heights))
        return (
            self.patch.scene.flow.representation == "linear"
            and not any(n % 2 for n in heights.shape)
            and even(heights[1:], heights[:0:-1])
            and even(heights[:, 1:], heights[:, :0:-1])
        )

    def _film(self, gap: np.ndarray) -> GridFilm:
        if self.quartered:
            nx, ny = gap.shape
            return GridFilm(GridField(gap[: nx // 2 + 1, : ny // 2 + 1], self._spacing))
        film = self.patch.film_of(GridField(gap, self._spacing, periodic=True))
        return narrowed(film, GridFilm, "film on a grid")

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

    def _state(self, load: float) -> ContactState:
        if load not in self._states:
            # All processes make the surface together: the first one must not make it alone.
            surface = present(self.patch.surface, "surface")
            pressed = partial(self._pressed, surface, load)
            self._states[load] = parallel.on_root(pressed, self.patch.comm)
        return self._states[load]

    def _pressed(self, surface: GridField, load: float) -> ContactState:
        nearest = sorted(self._states, key=lambda other: abs(other - load))[:2]
        start = extrapolated(load, [(other, self._states[other]) for other in reversed(nearest)])
        patch, target = self.patch, Load("pressure", load)
        return elastic_contact(patch.scene, surface, start, target, patch.report)

    def _solve(self, load: float, multiple: float) -> SolvedLoad:
        film, settings, reason = self.film(load), self.settings(multiple), ""
        if film.sealed:
            return SolvedLoad((0.0, 0.0), multiple)
        from fem_seal.flow import leak_rate

        def keep(flow: "MeshedFlow") -> None:
            self._flows.pop(load, None)  # A flow solved again is the newest.
            self._flows[load] = flow
            while len(self._flows) > max(1, KEPT // film.samples.size):
                del self._flows[next(iter(self._flows))]

        nearby = film.representation == "linear" and settings.method == "adaptive"
        leak = leak_rate(
            film,
            settings,
            progress=flow_progress(self.patch.report),
            comm=self.patch.comm,
            start=self._nearest(load) if nearby else None,
            keep=keep if nearby else None,
        )
        if not leak.converged:
            # The rest of the reason names the tolerance of this flow, which is not the seal's.
            cause, load_text = leak.reason.partition(";")[0], with_prefix(load, "Pa")
            reason = f"its flow at a net load of {load_text} ended early, since {cause}"
        return SolvedLoad(leak.bounds, multiple, reason)

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
    return replace(
        slip, inlet_pressure=(1 + SAME_PRESSURE) * mean, outlet_pressure=(1 - SAME_PRESSURE) * mean
    )
