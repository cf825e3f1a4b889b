"""Methods that iterate the displacement: the letter's damped dynamics, and FISTA.

Both minimise the elastic energy over displacements u >= h of the surface, with the operator S⁻¹
from displacement to pressure (mode by mode the stiffness k(q)) and the mean pressure p̄:

    damped   ü = -S⁻¹ u - p̄ - γ u̇;  after each step u = max(u, h)
    FISTA    u_new = max(v - (S⁻¹ v + p̄)/k_max, h),  v = u_new + momentum (u_new - u)
"""

import numpy as np

from fem_seal.contact.problem import Iterate, Iterates, Problem

# A certificate costs an FFT pair, as much as a step: compute it only now and then.
STEPS_PER_CHECK = 20


def damped(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Green's function molecular dynamics as in Dapp et al., Phys. Rev. Lett. 108, 244301 (2012).

    Newton's equations of the modes with unit masses, by Verlet's method. The mean pressure acts on
    q = 0, or the mean gap is kept. After each step points that penetrate the counter-face are put
    back onto it. The slowest mode is critically damped, γ = 2 min √k, so that the relaxation time
    grows as √L. The time step is half of the stability limit of the fastest mode, 2 / max √k. Each
    step takes one FFT pair.
    """
    half_space = problem.half_space
    step = 1 / half_space.stiffest**0.5
    drag = half_space.softest**0.5 * step
    u = u_old = _start(problem, pressure)
    iteration = 0
    while True:
        yield _check(problem, u, iteration)
        for _ in range(STEPS_PER_CHECK):
            force = -(problem.mean_pressure or 0.0) - half_space.pressure(u)
            u_new = (2 * u - (1 - drag) * u_old + step**2 * force) / (1 + drag)
            u_old, u = u, problem.projected(u_new)
        iteration += STEPS_PER_CHECK


def fista(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Nesterov's acceleration of the projected gradient, in the displacement.

    A. Beck, M. Teboulle, SIAM J. Imaging Sci. 2, 183 (2009), with the gradient restart of
    B. O'Donoghue, E. Candès, Found. Comput. Math. 15, 715 (2015). It resembles the damped dynamics
    with an adaptive friction. Each step takes one FFT pair.
    """
    half_space = problem.half_space
    u = v = _start(problem, pressure)
    momentum, iteration = 1.0, 0
    while True:
        yield _check(problem, u, iteration)
        for _ in range(STEPS_PER_CHECK):
            force = -(problem.mean_pressure or 0.0) - half_space.pressure(v)
            u_new = problem.projected(v + force / half_space.stiffest)
            if np.vdot(v - u_new, u_new - u) > 0:
                momentum = 1.0
            next_momentum = (1 + (1 + 4 * momentum**2) ** 0.5) / 2
            v = u_new + (momentum - 1) / next_momentum * (u_new - u)
            u, momentum = u_new, next_momentum
        iteration += STEPS_PER_CHECK


def _start(problem: Problem, pressure: np.ndarray) -> np.ndarray:
    """Displacement caused by the pressure, moved as a whole until it touches the counter-face."""
    gap = problem.gap(pressure)
    return problem.projected(gap - gap.min() + problem.heights)


def _check(problem: Problem, displacement: np.ndarray, iteration: int) -> Iterate:
    """Pressure on the points that touch, with its certificate."""
    touching = displacement == problem.heights
    pressure = problem.half_space.pressure(displacement) + (problem.mean_pressure or 0.0)
    if problem.mean_gap is not None:
        # At a prescribed mean gap the mean pressure follows from the points without contact.
        pressure -= pressure.mean(where=~touching) if not touching.all() else pressure.min()
    pressure = np.maximum(pressure, 0) * touching
    if not pressure.any():
        return Iterate(iteration, pressure, np.inf)
    problem.make_admissible(pressure)
    gap = problem.gap(pressure)
    return Iterate(iteration, pressure, problem.certificate(pressure, gap), gap)
