"""Stages of the search for an equilibrium: finer networks, a smaller ε, and more samples.

The first flow of a stage gives the error of the fluid's pressure that the stage before has found.
The stages end when all further ones together would change ln Q by little, or when no further one is
possible.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from sys import float_info
from time import perf_counter

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.coupling.newton import Steps, equilibrium
from fem_seal.coupling.point import LiftPoint
from fem_seal.coupling.problem import LiftProblem
from fem_seal.digits import number_of
from fem_seal.leak_rate import log_ratio
from fem_seal.network.network import Network

MOST_STAGES = 10  # after the first one
# Where each of so many finer networks in a row changes ln Q by more than the network before it, the
# stages end: such changes do not say what all further networks would add up to. Of 500 random
# scenes and 24 next to closing one ends so, in 19 s in place of 55.
MOST_GROWN = 2
# Least error of ln Q that is claimed, over the allowed one: a tenth of rtol. Where half as much was
# claimed, the equilibrium for a tenth of rtol was outside in one of 250 random scenes (0.08 rtol).
LEAST_ERROR = 0.2
# Least ratio of the changes of ln Q by finer networks where pixels of unlike gaps meet in corners:
# networks that are halved everywhere have 0.57, after first ones with as little as 0.2.
CORNER_RATIO = 0.6
# ε over the rms height with which a film must be sealed: with a larger one on a coarse network the
# fluid may not reach a channel that it would open.
SEALED_EPSILON = 5e-4
# Part of the allowed error to which stages after difficult steps are solved: there the first order
# says too little of what is left, and the next stage may lose the equilibrium.
DIFFICULT_TOLERANCE = 0.1


def first_stage(
    problem: LiftProblem, pressure: np.ndarray, contact: ContactState | None = None
) -> Steps:
    """The equilibrium of a coarse network, and of few samples on large grids.

    It starts from a fluid pressure (nx, ny) [Pa] and the contact under it, if that is known.
    """
    thinned = problem.chain[0]
    # A gap of the rms height that ε makes wider has a larger ln g³, by what is allowed.
    epsilon = problem.allowed / 3 * problem.roughness
    stride = problem.stride_of(thinned.height.values)
    start = None if contact is None else contact.pressure.values[::stride, ::stride]
    pressure = pressure[::stride, ::stride]
    pressed = thinned.contact_under(pressure, start)
    point = LiftPoint(thinned, thinned.first_network, epsilon, pressure, pressed)
    return equilibrium(point, problem.allowed)


def further_stages(problem: LiftProblem, steps: Steps) -> Steps:
    """Go on from the equilibrium of the first stage.

    A stage begins with the fluid's pressure of the stage before. The flow of this first point tells
    the error of that stage. If it is small enough, the point is an equilibrium already, and on all
    samples the last one. Else Newton's steps lead to that of this stage.
    """
    search = _Search(problem, steps)
    for _ in range(MOST_STAGES):
        began = perf_counter()
        if search.none_needed:
            return search.ended()
        samples, network, epsilon = search.next_stage
        if len(network.free) > problem.most_nodes:
            most = number_of(problem.most_nodes, "node")
            return search.ended(f"a finer network would have more than {most}")
        start = search.steps.point.at_stage(samples, network, epsilon)
        search = search.estimated(start)
        if search.grown == MOST_GROWN and search.error > problem.allowed:
            return search.ended("each finer network changes the leak rate more than the one before")
        if search.accepts(start):
            accepted = Steps(start, (start.residual_size,), False, "")
            search = replace(search, steps=accepted.after(search.steps))
            if start.problem is problem:
                return search.ended()
            continue
        search = search.solved(start)
        if start.problem is problem:  # no state has fewer samples
            # The next network has four times the nodes. The contacts need most of the memory.
            time = 4 * (perf_counter() - began)
            exceeded = problem.settings.limits.why_exceeded(problem.began, 1.0, time, "stage")
            if exceeded:
                return search.ended(exceeded)
    return search.ended(
        f"the fluid's pressure still changes the leak rate after {MOST_STAGES} stages"
    )


@dataclass(frozen=True)
class _Search:
    """What the stages so far have left."""

    problem: LiftProblem  #: that of all samples
    steps: Steps  #: of all stages
    #: change of ln Q, to first order, by the flow at the beginning of the last stage
    change: float = inf
    by_network: float = inf  #: that of the last stage with as many samples as the one before
    grown: int = 0  #: finer networks in a row, each of which changed ln Q more than the one before
    error: float = inf  #: of ln Q in the stage before, as the last first point tells it
    moved: float = 0.0  #: change of ln Q by the steps of the last stage that took some
    #: last equilibrium with a small ε, if its film is sealed and no path has opened since
    last_sealed: LiftPoint | None = None

    @property
    def none_needed(self) -> bool:
        """Whether the leak rate is negligible, or the film is sealed and ε is small enough."""
        point, problem = self.steps.point, self.problem
        if self._negligible(point):
            return True
        if not self._sealed(point):
            return False
        small = self._small_epsilon(point) and not self.steps.failure
        surely = point.stays_sealed and (problem.never_opens or small)
        # A smaller ε³ is lost in the rounding of g³: rounding errors would make the pressure in
        # pockets.
        return surely or self.next_stage[-1] < np.cbrt(float_info.epsilon) * problem.roughness

    @cached_property
    def next_stage(self) -> tuple[LiftProblem, Network, float]:
        """Samples, network and ε of the next stage, if one is needed."""
        point, chain = self.steps.point, self.problem.chain
        following = chain[min(chain.index(point.problem) + 1, len(chain) - 1)]
        network, epsilon = point.finer(following)
        if self._sealed(point) and point.stays_sealed:
            epsilon = min(epsilon, SEALED_EPSILON * self.problem.roughness)
        return following, network, epsilon

    def estimated(self, start: LiftPoint) -> "_Search":
        """The search with the error of its last point, as the first one of the next stage tells it.

        Each stage to come is taken to change ln Q by a ratio of what the stage before it did: that
        of the last two changes by finer networks, at most 0.9, or 1/2 before there are two; for a
        gap that is constant on pixels at least `CORNER_RATIO`. After difficult steps ln Q changes
        by more than its first order: the error is then at least what the steps of the stage before
        have `moved` ln Q.
        """
        point, ratio, by_network, grown = self.steps.point, 0.5, self.by_network, self.grown
        change = point.log_rate_change_to(start)
        if start.problem is point.problem:
            if 0 < by_network < inf:
                ratio = min(change / by_network, 0.9)
            grown = grown + 1 if start.epsilon == point.epsilon and change > by_network else 0
            by_network = change
        if start.network.film.representation == "constant":
            ratio = max(ratio, CORNER_RATIO)
        error = point.log_rate_error(start) + ratio / (1 - ratio) * change
        error = max(error, self.moved if self.steps.difficult else 0.0) + start.by_epsilon
        return replace(self, change=change, by_network=by_network, grown=grown, error=error)

    def accepts(self, start: LiftPoint) -> bool:
        """Whether the first point of a stage is its equilibrium without a step."""
        little = self.error <= self.problem.allowed and start.keeps_load
        return little and not (self.steps.point.sealed or start.sealed or self.steps.failure)

    def solved(self, start: LiftPoint) -> "_Search":
        """The search after Newton's steps from the first point of a stage."""
        tolerance = (DIFFICULT_TOLERANCE if self.steps.difficult else 1.0) * self.problem.allowed
        steps = equilibrium(start, tolerance)
        point = steps.point
        last_sealed = self.last_sealed
        if self._small_epsilon(point) and not steps.failure:
            last_sealed = point
        return replace(
            self,
            steps=steps.after(self.steps),
            moved=log_ratio(point.flow.conductance, start.flow.conductance),
            last_sealed=last_sealed if self._sealed(point) else None,
        )

    def ended(self, reason: str = "") -> Steps:
        """The steps of all stages with the error that they leave, and why no further one follows.

        If the last stages have no equilibrium, but leave the film sealed, the point is
        `last_sealed`.
        """
        problem, steps, error = self.problem, self.steps, self.error
        if steps.failure and self.last_sealed is not None:
            steps = replace(steps, point=self.last_sealed, failure="")
        on_all_samples = steps.point.problem is problem
        unfinished = error > problem.allowed or not on_all_samples
        if self._negligible(steps.point) or not on_all_samples:
            error = inf  # the stages to come were not solved
        if steps.failure:
            error = max(error, steps.point.step.log_rate)
        error = max(error, LEAST_ERROR * problem.allowed)
        failure = steps.failure or (reason if unfinished else "")
        return replace(steps, change=self.change, error=error, failure=failure)

    def _negligible(self, point: LiftPoint) -> bool:
        """Whether the film leaks, on all samples, too little to go on; the lift has not settled."""
        return point.problem is self.problem and point.flow.conductance <= self.problem.negligible

    def _sealed(self, point: LiftPoint) -> bool:
        """Whether the film is sealed, on all samples."""
        return point.problem is self.problem and point.sealed

    def _small_epsilon(self, point: LiftPoint) -> bool:
        """Whether the fluid reaches with this ε a channel that it would open."""
        return point.epsilon <= SEALED_EPSILON * self.problem.roughness
