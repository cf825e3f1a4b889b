"""Methods that move the surface: the letter's damped dynamics, and its accelerated descendant."""

import numpy as np

from fem_seal.contact.problem import Iterate, Iterates, Problem

# A certificate costs an FFT pair, as much as a step.
STEPS_PER_CHECK = 20


def damped(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Green's function molecular dynamics as in Dapp et al., Phys. Rev. Lett. 108, 244301 (2012).

    Newton's equations of the modes, ü = -k(q) ũ - p̃ - γ ů with unit masses (Verlet), pressed by
    the mean pressure (q = 0 only) or held at the mean gap; after each step the hard wall puts
    points that penetrate back onto the counter-face. The slowest mode is critically damped,
    γ = 2 min √k, so that the relaxation time grows as √L. The time step is half of the fastest
    mode's stability limit, 2 / max √k. One FFT pair a step.
    """
    half_space = problem.half_space
    step = 1 / half_space.stiffest**0.5
    drag = half_space.softest**0.5 * step
    here = before = _start(problem, pressure)
    iteration = 0
    while True:
        yield _check(problem, here, iteration)
        for _ in range(STEPS_PER_CHECK):
            force = -(problem.mean_pressure or 0.0) - half_space.pressure(here)
            ahead = (2 * here - (1 - drag) * before + step**2 * force) / (1 + drag)
            before, here = here, problem.rested(ahead)
        iteration += STEPS_PER_CHECK


def fista(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Nesterov's acceleration of the projected gradient, in the displacement.

    A. Beck, M. Teboulle, SIAM J. Imaging Sci. 2, 183 (2009), with the gradient restart of
    B. O'Donoghue, E. Candès, Found. Comput. Math. 15, 715 (2015): the damped dynamics with a
    friction that adapts itself. One FFT pair a step.
    """
    half_space = problem.half_space
    here = ahead = _start(problem, pressure)
    momentum, iteration = 1.0, 0
    while True:
        yield _check(problem, here, iteration)
        for _ in range(STEPS_PER_CHECK):
            force = -(problem.mean_pressure or 0.0) - half_space.pressure(ahead)
            reached = problem.rested(ahead + force / half_space.stiffest)
            if np.vdot(ahead - reached, reached - here) > 0:
                momentum = 1.0
            grown = (1 + (1 + 4 * momentum**2) ** 0.5) / 2
            ahead = reached + (momentum - 1) / grown * (reached - here)
            here, momentum = reached, grown
        iteration += STEPS_PER_CHECK


def _start(problem: Problem, pressure: np.ndarray) -> np.ndarray:
    """Displacement caused by the pressure, moved until it touches."""
    gap = problem.gap(pressure)
    return problem.rested(gap - gap.min() + problem.heights)


def _check(problem: Problem, displacement: np.ndarray, iteration: int) -> Iterate:
    """Pressure on the touching points and its certificate."""
    touching = displacement == problem.heights
    pressure = problem.half_space.pressure(displacement) + (problem.mean_pressure or 0.0)
    if problem.mean_gap is not None:
        # At a prescribed mean gap the mean pressure follows from the points without contact.
        pressure -= pressure.mean(where=~touching) if not touching.all() else pressure.min()
    pressure = np.maximum(pressure, 0) * touching
    if not pressure.any():
        return Iterate(iteration, pressure, np.inf)
    problem.admissible(pressure)
    gap = problem.gap(pressure)
    return Iterate(iteration, pressure, problem.error(pressure, gap), gap)
