"""Stages of the search for an equilibrium: finer networks, a smaller ε, and more samples.

The flow at the beginning of a stage tells by how much the fluid's pressure of the stage before is
wrong. The stages end when all that further ones would change is little, or when there is none.
"""

from dataclasses import replace
from math import inf
from sys import float_info
from time import perf_counter

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.coupling.constants import INNER, MOST_STEPS
from fem_seal.coupling.newton import Steps, equilibrium
from fem_seal.coupling.point import LiftPoint
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import log_ratio
from fem_seal.digits import number_of

# After so many stages without an equilibrium no finer one is tried. In one scene six had none,
# and the seventh had.
MOST_FAILED = 8
# Where each of so many finer networks in a row changes ln Q by more than the network before it, the
# stages end: such changes do not say what all further networks would add up to.
MOST_GROWN = 2
# ε over the rms height with which a film must be sealed: with a larger one on a coarse network the
# fluid may not reach a channel that it would open.
SEALED = 5e-4
MOST_NODES = 2_000_000  # of the last network, at about 1 kB each


def first_stage(
    problem: LiftProblem,
    allowed: float,
    pressure: np.ndarray,
    contact: ContactState | None = None,
) -> Steps:
    """The equilibrium of a coarse network, and of few samples on large grids.

    It starts from a fluid pressure (nx, ny) [Pa] and the contact under it, if that is known.
    """
    thinned = problem.chain[0]
    # A gap of the rms height that ε makes wider has a larger ln g³, by what is allowed.
    epsilon = allowed / 3 * problem.roughness
    stride = problem.stride(thinned.height.values)
    start = None if contact is None else contact.pressure.values[::stride, ::stride]
    pressure = pressure[::stride, ::stride]
    pressed = thinned.contact_under(pressure, start)
    point = LiftPoint(thinned, thinned.first_network, epsilon, pressure, pressed)
    return equilibrium(point, allowed)


def further_stages(problem: LiftProblem, allowed: float, steps: Steps) -> Steps:
    """Go on from the equilibrium of the first stage."""
    stages = _Stages(problem, allowed, steps)
    for _ in range(MOST_STEPS // 2):
        start = stages.next_start()
        if start is None:
            break
        stages.estimate(start)
        if stages.suffices(start):
            stages.accept(start)
        elif not stages.ended:
            stages.solve(start)
        if stages.ended:
            break
    else:
        stages.end(f"it has not in {MOST_STEPS // 2} stages")
    return stages.result()


class _Stages:
    """Where the stages are, and by how much ln Q may still be wrong.

    Parameters
    ----------
    problem
        On all samples.
    allowed
        Error of ln Q at which the stages end.
    steps
        Those that have led to the equilibrium of the last stage.
    """

    def __init__(self, problem: LiftProblem, allowed: float, steps: Steps):
        self._problem, self._allowed, self._steps = problem, allowed, steps
        self._change = inf  # of ln Q, by the flow of the last stage
        self._by_network = inf  # the same, of the last stage that had no more samples
        self._moved = 0.0  # ln Q, by Newton's steps of the last stage
        self._error = inf  # of ln Q, by all stages to come
        self._grown = 0  # finer networks in a row that changed ln Q by more than the one before
        self._began = perf_counter()  # time at which the present one began [s]
        self._over = ""  # why the stages have ended though there is another one
        self.ended = False  #: whether the last stage is over

    @property
    def _on_all_samples(self) -> bool:
        return self._steps.point.problem is self._problem

    @property
    def _leaks_nothing(self) -> bool:
        """Whether the film leaks, on all samples, so little that it counts as sealed."""
        conductance, most = self._steps.point.flow.conductance, self._problem.negligible
        return self._on_all_samples and conductance <= most

    def next_start(self) -> LiftPoint | None:
        """The first point of the next stage, None if it has none.

        It has none where the film stays sealed with a small ε or leaks next to nothing, and where
        its network would be too large.
        """
        if self._leaks_nothing:
            return None
        problem, chain, point = self._problem, self._problem.chain, self._steps.point
        least = SEALED * problem.roughness
        sealed = self._on_all_samples and point.sealed
        stays_sealed = sealed and point.stays_sealed
        if stays_sealed and problem.never_opens:
            return None
        if stays_sealed and point.epsilon <= least and not self._steps.failure:
            return None
        # All samples are taken at once where fewer leave hardly any error.
        more = len(chain) if self._error <= INNER * self._allowed else 1
        following = chain[min(chain.index(point.problem) + more, len(chain) - 1)]
        network, epsilon = point.finer(self._allowed, following)
        if stays_sealed:
            epsilon = min(epsilon, least)
        # ε³ below this is lost in the rounding of g³, and so are the changes by a sealed film's
        # steps.
        lost = epsilon**3 < float_info.epsilon * problem.roughness**3
        if sealed and lost:
            return None
        if len(network.free) > MOST_NODES:
            self.end(f"a finer network would have more than {number_of(MOST_NODES, 'node')}")
            return None
        if following is point.problem:
            return replace(point, network=network, epsilon=epsilon)
        pressure = following.interpolated(point.pressure)
        pressed = following.contact_under(pressure)
        return LiftPoint(following, network, epsilon, pressure, pressed)

    def end(self, reason: str) -> None:
        """End the stages for a reason, which counts unless the error is small already."""
        if self._error > self._allowed:
            self._over, self.ended = reason, True

    def estimate(self, start: LiftPoint) -> None:
        """Estimate the error of ln Q by the flow of the next stage's first point.

        The changes by finer networks fall by a ratio r: those after this one sum up to r/(1 - r)
        times it. After difficult steps a stage moves ln Q by more than its first order.
        """
        point, ratio = self._steps.point, 0.5
        self._change = point.log_rate_change_to(start)
        if start.problem is point.problem:
            if 0 < self._by_network < inf:
                ratio = min(self._change / self._by_network, 0.9)
            grows = start.epsilon == point.epsilon and self._change > self._by_network
            self._grown = self._grown + 1 if grows else 0
            self._by_network = self._change
        least = self._moved if self._steps.difficult else 0.0
        error = point.log_rate_error(start) + ratio / (1 - ratio) * self._change
        self._error = max(error, least) + start.by_epsilon
        if self._grown == MOST_GROWN:
            self.end("each finer network changes the leak rate more than the one before")

    def suffices(self, start: LiftPoint) -> bool:
        """Whether the first point of a stage is an equilibrium without a step."""
        point, little = self._steps.point, self._error <= self._allowed
        if not (little and start.keeps_load(self._allowed)):
            return False
        return not (point.sealed or start.sealed or self._steps.failure)

    def accept(self, start: LiftPoint) -> None:
        """Take the first point of a stage as its equilibrium."""
        self._steps = Steps(start, (start.size,), False, "").after(self._steps)
        self.ended = self._on_all_samples

    def solve(self, start: LiftPoint) -> None:
        """Take Newton's steps from the first point of a stage."""
        problem = self._problem
        closely = self._steps.difficult or start.problem is not problem
        steps = equilibrium(start, (INNER if closely else 1.0) * self._allowed)
        self._steps = steps.after(self._steps)
        self._moved = log_ratio(self._steps.point.flow.conductance, start.flow.conductance)
        if self._on_all_samples:  # no state has fewer
            # The next network has four times the nodes.
            time = 4 * (perf_counter() - self._began)
            self._over = problem.settings.limits.exceeded(problem.began, 1.0, time)
            self.ended = bool(self._over) or self._steps.lost >= MOST_FAILED
        self._began = perf_counter()

    def result(self) -> Steps:
        """The steps of all stages, with the error that they leave."""
        steps, error = self._steps, self._error
        if self._leaks_nothing:
            error = inf  # the stages to come were not solved
        if steps.failure:
            error = max(error, steps.point.step.log_rate)
        error = max(error, INNER * self._allowed)  # the contacts are no more exact
        failure = steps.failure or self._over
        return replace(steps, change=self._change, error=error, failure=failure)
