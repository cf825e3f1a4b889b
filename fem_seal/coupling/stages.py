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
from fem_seal.coupling.newton import Steps, equilibrium
from fem_seal.coupling.point import LiftPoint
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import log_ratio
from fem_seal.digits import number_of

MOST_STAGES = 10  # after the first one
# Where each of so many finer networks in a row changes ln Q by more than the network before it, the
# stages end: such changes do not say what all further networks would add up to.
MOST_GROWN = 2
# Part of the allowed error that is the least to be claimed. A tenth of the tolerance moved ln Q by
# up to 0.16 of it where less was estimated, in 250 random scenes.
LEAST_ERROR = 0.2
# Where fewer samples leave so little of the allowed error, the next stage takes all samples.
LITTLE = 0.1
# ε over the rms height with which a film must be sealed: with a larger one on a coarse network the
# fluid may not reach a channel that it would open.
SEALED = 5e-4
MOST_NODES = 2_000_000  # of the last network, at about 1 kB each


def first_stage(
    problem: LiftProblem, pressure: np.ndarray, contact: ContactState | None = None
) -> Steps:
    """The equilibrium of a coarse network, and of few samples on large grids.

    It starts from a fluid pressure (nx, ny) [Pa] and the contact under it, if that is known.
    """
    thinned = problem.chain[0]
    # A gap of the rms height that ε makes wider has a larger ln g³, by what is allowed.
    epsilon = problem.allowed / 3 * problem.roughness
    stride = problem.stride(thinned.height.values)
    start = None if contact is None else contact.pressure.values[::stride, ::stride]
    pressure = pressure[::stride, ::stride]
    pressed = thinned.contact_under(pressure, start)
    point = LiftPoint(thinned, thinned.first_network, epsilon, pressure, pressed)
    return equilibrium(point)


def further_stages(problem: LiftProblem, steps: Steps) -> Steps:
    """Go on from the equilibrium of the first stage.

    The changes of ln Q by finer networks fall by a ratio r: those after a stage sum up to r/(1 - r)
    times its own. After difficult steps a stage moves ln Q by more than its first order.
    """
    allowed, over = problem.allowed, ""
    # Of ln Q: by the flow of this stage, by that of the last one with as many samples as before,
    # and by all stages to come.
    change = by_network = error = inf
    moved, grown = 0.0, 0  # ln Q, by Newton's steps of the stage before; finer networks in a row
    for _ in range(MOST_STAGES):
        began, point = perf_counter(), steps.point
        start = _next_start(problem, steps, error)
        if isinstance(start, str):
            over = start
            break
        change, ratio = point.log_rate_change_to(start), 0.5
        if start.problem is point.problem:
            if 0 < by_network < inf:
                ratio = min(change / by_network, 0.9)
            grows = start.epsilon == point.epsilon and change > by_network
            by_network, grown = change, grown + 1 if grows else 0
        error = point.log_rate_error(start) + ratio / (1 - ratio) * change
        error = max(error, moved if steps.difficult else 0.0) + start.by_epsilon
        if grown == MOST_GROWN and error > allowed:
            over = "each finer network changes the leak rate more than the one before"
            break
        closed = point.sealed or start.sealed
        if error <= allowed and start.keeps_load and not (closed or steps.failure):
            # The first point of the stage is an equilibrium without a step.
            steps = Steps(start, (start.size,), False, "").after(steps)
            if start.problem is problem:
                break
            continue
        steps = equilibrium(start).after(steps)
        moved = log_ratio(steps.point.flow.conductance, start.flow.conductance)
        if start.problem is problem:  # no state has fewer samples
            # The next network has four times the nodes.
            time = 4 * (perf_counter() - began)
            exceeded = problem.settings.limits.exceeded(problem.began, 1.0, time)
            if exceeded:
                return _ended(problem, steps, change, error, exceeded)
    else:
        over = f"it has not in {MOST_STAGES} stages"
    unfinished = error > allowed or steps.point.problem is not problem
    return _ended(problem, steps, change, error, over if unfinished else "")


def _ended(problem: LiftProblem, steps: Steps, change: float, error: float, over: str) -> Steps:
    """The steps of all stages with the error that they leave, and why no further one follows."""
    if _leaks_nothing(problem, steps.point) or steps.point.problem is not problem:
        error = inf  # the stages to come were not solved
    if steps.failure:
        error = max(error, steps.point.step.log_rate)
    error = max(error, LEAST_ERROR * problem.allowed)
    return replace(steps, change=change, error=error, failure=steps.failure or over)


def _leaks_nothing(problem: LiftProblem, point: LiftPoint) -> bool:
    """Whether the film leaks, on all samples, so little that it counts as sealed."""
    return point.problem is problem and point.flow.conductance <= problem.negligible


def _next_start(problem: LiftProblem, steps: Steps, error: float) -> LiftPoint | str:
    """The first point of the next stage, or why it cannot be solved, "" if it needs not be.

    It needs not where the film stays sealed with a small ε or leaks next to nothing.

    Parameters
    ----------
    error
        Of ln Q in the stage before.
    """
    point, chain = steps.point, problem.chain
    if _leaks_nothing(problem, point):
        return ""
    least = SEALED * problem.roughness
    sealed = point.problem is problem and point.sealed
    stays_sealed = sealed and point.stays_sealed
    if stays_sealed and (problem.never_opens or (point.epsilon <= least and not steps.failure)):
        return ""
    more = len(chain) if error <= LITTLE * problem.allowed else 1
    following = chain[min(chain.index(point.problem) + more, len(chain) - 1)]
    network, epsilon = point.finer(following)
    if stays_sealed:
        epsilon = min(epsilon, least)
    # ε³ below this is lost in the rounding of g³, and so are the changes by a sealed film's steps.
    if sealed and epsilon**3 < float_info.epsilon * problem.roughness**3:
        return ""
    if len(network.free) > MOST_NODES:
        return f"a finer network would have more than {number_of(MOST_NODES, 'node')}"
    if following is point.problem:
        return replace(point, network=network, epsilon=epsilon)
    pressure = following.interpolated(point.pressure)
    pressed = following.contact_under(pressure)
    return LiftPoint(following, network, epsilon, pressure, pressed)
