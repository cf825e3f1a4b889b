"""Passes through contact and flow, each from the fluid pressure that the last ones suggest.

Several passes share a mesh, since a pass needs only the p_f of its flow. The first flow on a mesh
is solved with its bounds, the next flows for the pressure alone, until ln Q changes by less than a
part of the mesh's tolerance. Then a finer mesh follows, down to the tolerance of the result. The
change of the leak rate from film to film on one mesh is much more exact than the bounds.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf

import numpy as np
from scipy.ndimage import uniform_filter

from fem_seal.contact.state import ContactState
from fem_seal.coupling.anderson import Mixture
from fem_seal.coupling.problem import LiftProblem, left_of
from fem_seal.coupling.state import SETTLED, spread
from fem_seal.film import GridFilm
from fem_seal.leak_rate import LeakRate
from fem_seal.progress import Report

WINDOWS = 16  # windows along each side over which the local load is averaged


@dataclass(frozen=True)
class PassTuning:
    """Parameters that change the number and the cost of the passes, not the equilibrium.

    Attributes
    ----------
    depth : int
        Depth of Anderson's acceleration; four is no better.
    most_passes : int
        Passes after which a state that has not settled is returned.
    most_closings : int
        So often a film that leaks may close again in passes of smaller steps, before they are
        given up.
    fewest_passes : int
        From so many on they are given up as well if ln Q no longer calms down.
    watched : int
        It calms down if its spread over so many passes is less than `calmer` times that over as
        many before them. Samples that open and close are counted over as many passes.
    calmer : float
    restless : float
        They go on in any case if ln Q spreads by less than this.
    passes_of_one_step : int
        This many accelerated passes take the whole step, as many again half of it, and so on.
    least_step : float
        Least part of the step.
    first_tolerance : float
        Tolerance of the first mesh.
    coarse_tolerance : float
        Tolerance of the first mesh of a start on every second sample.
    tolerance_after_coarse : float
        Tolerance of the first mesh after such a start.
    coarse_change : float
        The start on every second sample ends when ln Q changes by less than this.
    coarse_passes : int
        Largest number of passes of that start.
    mesh_left : float
        A finer mesh follows when ln Q changes by less than this part of the mesh's tolerance.
    next_mesh : float
        Tolerance of the next mesh, as a part of that of the mesh before.
    change_for_new_mesh : float
        A new mesh is made if ln Q has changed by this much since the present one was made.
    passes_of_one_mesh : int
        A new mesh is made, too, after this many passes on one mesh that have not settled.
    change_for_cold_start : float
        If ln Q changes by more than this, the next contact does not start from the last one.
    change_for_rough_contact : float
        While ln Q changes by more than this, contacts are solved to `roughest_contact`.
    roughest_contact : float
        Certificate of such contacts, whose ln Q errs by about 0.03.
    rough_contact : float
        Certificate of later contacts, as a part of rtol. Near closing, 1e-3 kept passes from
        settling.
    settled_pressure : float
        A sealed film has no ln Q. Its passes have settled if they change p_f by less than this part
        of the pressure drop (rms).
    sealed_passes : int
        The passes of a sealed film have also settled if this many in a row leaked nothing.
    least_solid_share : float
        The solids separate if the flow's p_f carries the whole load, although the solid carried
        less than this share of it in the contact of the same pass.
    left_per_pass : float
        Least part of the solid's load in one pass that remains in the next.
    """

    depth: int = 2
    most_passes: int = 40
    most_closings: int = 3
    fewest_passes: int = 28
    watched: int = 6
    calmer: float = 0.5
    restless: float = 0.2
    passes_of_one_step: int = 12
    least_step: float = 0.25
    first_tolerance: float = 0.3
    coarse_tolerance: float = 0.6
    tolerance_after_coarse: float = 0.05
    coarse_change: float = 0.1
    coarse_passes: int = 8
    mesh_left: float = 1 / 3
    next_mesh: float = 1 / 6
    change_for_new_mesh: float = 0.7
    passes_of_one_mesh: int = 10
    change_for_cold_start: float = 0.5
    change_for_rough_contact: float = 0.1
    roughest_contact: float = 1e-2
    rough_contact: float = 2e-4
    settled_pressure: float = 1e-3
    sealed_passes: int = 15
    least_solid_share: float = 1e-3
    left_per_pass: float = 0.1


TUNING = PassTuning()


@dataclass(eq=False)
class Passes:
    """A series of passes from a fluid pressure and a contact.

    One pass is `solve_contact`, then `solve_flow`; `go_on` turns to the fluid pressure of the next.

    Attributes
    ----------
    problem : LiftProblem
    rtol : float
        Tolerance of the flow of the result.
    pressure : (nx, ny) float
        p_f of the present pass [Pa].
    contact : ContactState, array or None
        Contact of the last pass; at first the contact, or its pressure, to start from.
    known : bool
        Whether `contact` is at first the contact under `pressure`; the first pass then does not
        solve it.
    tuning : PassTuning
    next_tolerance : float
        Tolerance of the next mesh.
    count : int
        Passes so far.
    rates : list of float
        Leak rates of all passes [m³/s].
    mesh_rates : list of float
        Leak rates on the present mesh; they are comparable with each other only.
    change : float
        Last change of ln Q from pass to pass on one mesh.
    mesh_tolerance : float
        Tolerance to which the present mesh was made; infinite without a mesh.
    flow_of_mesh : LeakRate or None
        Flow for which the present mesh was made.
    plain : bool
        Whether `pressure` is the p_f of the last flow itself, not a mixture.
    response : (nx, ny) float
        p_f of the last flow [Pa]; empty before the first.
    """

    problem: LiftProblem
    rtol: float
    pressure: np.ndarray
    contact: ContactState | np.ndarray | None = None
    known: bool = False
    tuning: PassTuning = TUNING
    next_tolerance: float = field(init=False)
    count: int = 0
    rates: list[float] = field(default_factory=list)
    mesh_rates: list[float] = field(default_factory=list)
    change: float = inf
    mesh_tolerance: float = inf
    flow_of_mesh: LeakRate | None = None
    plain: bool = False
    response: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        self.next_tolerance = self.tuning.first_tolerance
        self._mixture = Mixture(self.tuning.depth)
        self._pressure_of_contact: np.ndarray | None = None
        self._open: deque[np.ndarray] = deque(maxlen=self.tuning.watched)

    def solve_contact(self) -> ContactState:
        """Contact under the present fluid pressure: the first half of a pass."""
        self.count += 1
        if not (self.known and self.count == 1 and isinstance(self.contact, ContactState)):
            tuning = self.tuning
            moved = spread(self.rates[-2:]) if self.count > 2 else inf
            warm = self.count <= 2 or moved < tuning.change_for_cold_start
            start = self._start() if warm else None
            rough = moved >= tuning.change_for_rough_contact
            tolerance = tuning.roughest_contact if rough else tuning.rough_contact * self.rtol
            self.contact = self.problem.contact_under(self.pressure, start, tolerance)
        self._pressure_of_contact = self.pressure
        return self.contact

    def _start(self) -> ContactState | np.ndarray | None:
        """Pressure to start from: that of the last contact, scaled with the local load."""
        last, before = self.contact, self._pressure_of_contact
        if before is None or not isinstance(last, ContactState):
            return last
        return last.pressure.values * scale_of_local_load(
            last.pressure.values, self.pressure - before
        )

    def solve_flow(self, contact: ContactState, report: Report) -> LeakRate:
        """Flow through the gap of a contact: the second half of a pass."""
        film = self.problem.film(contact.gap)
        self._open.append(contact.gap.values > 0)
        leak = self._flow(film)
        self.response = self.problem.pressure_of_flow(film, leak)
        self._mixture.add(self.pressure, self.response)
        self.rates.append(self._rate)
        report("lift", f"pass {self.count}, leak rate {self._rate:.3g} m^3/s")
        if len(self.mesh_rates) > 1:
            self.change = spread(self.mesh_rates[-2:])
        if self.change < self.tuning.mesh_left * self.mesh_tolerance < inf:
            self.next_tolerance = max(self.rtol, self.tuning.next_mesh * self.mesh_tolerance)
        return leak

    def _flow(self, film: GridFilm) -> LeakRate:
        """Flow on the present mesh, or on a new one."""
        problem, far, leak = self.problem, self.tuning.change_for_new_mesh, None
        too_long = len(self.mesh_rates) >= self.tuning.passes_of_one_mesh
        new_mesh = too_long or self.mesh_tolerance > self.next_tolerance
        if film.sealed:
            leak = problem.flow(film, self.next_tolerance, False)
        elif problem.flow_on_kept_mesh and not new_mesh and spread(self.rates[-2:]) < far:
            leak = problem.flow_on_kept_mesh(film)
            if spread([leak.inflow, *self.mesh_rates[:1]]) > far:
                leak = None
        if leak is None:
            # A finer mesh of a similar film begins with the last mesh.
            finer = new_mesh and self.next_tolerance < self.mesh_tolerance < inf
            leak = problem.flow(film, self.next_tolerance, not finer)
            if problem.flow_on_kept_mesh is None:
                self.mesh_tolerance, self.flow_of_mesh = self.next_tolerance, leak
            else:
                self._begin_mesh(leak, self.next_tolerance)
        self.mesh_rates.append(leak.inflow)
        return leak

    def _begin_mesh(self, leak: LeakRate, tolerance: float) -> None:
        """Forget rates and residuals of the last mesh: those of two meshes are not comparable."""
        self.mesh_tolerance, self.flow_of_mesh, self.mesh_rates = tolerance, leak, []
        self._mixture = Mixture(self.tuning.depth)

    @property
    def _rate(self) -> float:
        """Leak rate of the last pass [m³/s], from the change since the mesh was made."""
        made, last = self.flow_of_mesh, self.mesh_rates[-1]
        return made.value * last / made.inflow if made and last else 0.0

    def next_pressure(self) -> np.ndarray:
        """p_f of the next pass [Pa]: that of the last flow near the end, else a mixture."""
        problem, tuning, target = self.problem, self.tuning, self.response
        if not self._nearly_settled:
            step = max(0.5 ** (self.count // tuning.passes_of_one_step), tuning.least_step)
            target = np.clip(self._mixture.step(step), problem.outlet, problem.inlet)
        return problem.carriable(self.pressure, target, tuning.left_per_pass)

    def go_on(self) -> None:
        """Turn to the fluid pressure of the next pass."""
        self.pressure, self.plain = self.next_pressure(), self._nearly_settled

    def go_on_from(self, leak: LeakRate) -> None:
        """Go on with the mesh of a flow to the tolerance of the result."""
        self._begin_mesh(leak, inf if leak.state == "sealed" else self.rtol)

    @property
    def _nearly_settled(self) -> bool:
        return self.change < SETTLED * self.rtol

    @property
    def settled(self) -> bool:
        """Whether the leak rate has settled on the last mesh, in a pass that was plain."""
        exact = self.mesh_tolerance <= self.rtol if self.mesh_rates[-1] > 0 else self.stays_sealed
        still = len(self.mesh_rates) >= 3 and spread(self.last_rates) < SETTLED * self.rtol
        return exact and still and self.plain and not self.fluid_carries_all

    @property
    def given_up(self) -> bool:
        """Whether more passes are not worth their cost.

        They are not if leaking films keep closing in spite of smaller steps, or if ln Q moves
        within one range. Then a few samples open and close, and each changes the fluid pressure
        by a jump.
        """
        tuning, rates, part = self.tuning, self.rates, self.tuning.watched
        if self.count >= tuning.most_passes:
            return True
        damped = rates[tuning.passes_of_one_step :]
        if sum(now == 0 < before for before, now in pairwise(damped)) >= tuning.most_closings:
            return True
        before, now = spread(rates[-2 * part : -part]), spread(rates[-part:])
        moves = now > max(tuning.restless, tuning.calmer * before)
        return self.count >= tuning.fewest_passes and moves

    @property
    def flipping(self) -> int:
        """Number of samples that were open in one of the last passes and in contact in another."""
        opened = np.stack(self._open)
        return int(np.count_nonzero(opened.any(axis=0) & ~opened.all(axis=0)))

    @property
    def last_rates(self) -> Sequence[float]:
        """Leak rates of the last three passes on the present mesh."""
        return self.mesh_rates[-3:]

    @property
    def stays_sealed(self) -> bool:
        """Whether p_f has settled in a film that does not leak."""
        drop = self.problem.inlet - self.problem.outlet
        change = float(np.sqrt(np.mean((self.response - self.pressure) ** 2)))
        most = self.tuning.sealed_passes
        last = self.rates[-most:]
        settled = change < self.tuning.settled_pressure * drop
        return settled or (len(last) == most and max(last) == 0)

    @property
    def fluid_carries_all(self) -> bool:
        """Whether the fluid pressure of the last flow carries the whole load."""
        load = self.problem.load
        return load is not None and left_of(load, self.response) <= 0

    @property
    def solids_separate(self) -> bool:
        """Whether the fluid carries all of the load, and carried nearly all before."""
        load = self.problem.load
        if load is None or not self.fluid_carries_all:
            return False
        return left_of(load, self.pressure) < self.tuning.least_solid_share * load


def scale_of_local_load(pressure: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Factor by which contact pressures change if the fluid pressure changes.

    On average over a window, solid and fluid together carry the same load as before: the solid
    loses what the fluid gains. A start scaled by this factor saves a quarter of the transforms.

    Parameters
    ----------
    pressure : (nx, ny) float
        Contact pressure p_c [Pa].
    change : (nx, ny) float
        Change of the fluid pressure p_f [Pa].

    Returns
    -------
    (nx, ny) float, from 0.1 to 10
    """
    size = [max(n // WINDOWS, 1) for n in pressure.shape]
    solid, fluid = (
        uniform_filter(values, size, mode=("nearest", "wrap")) for values in (pressure, change)
    )
    return np.clip(1 - fluid / np.maximum(solid, 1e-3 * solid.max()), 0.1, 10)
