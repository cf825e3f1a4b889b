"""The constrained conjugate gradients of Polonsky and Keer, as published."""

import numpy as np

from fem_seal.contact.problem import Iterate, Iterates, Problem


def polonsky_keer(problem: Problem, pressure: np.ndarray) -> Iterates:
    """I. A. Polonsky, L. M. Keer, Wear 231, 206 (1999): two FFT pairs an iteration.

    The search direction is reset whenever a point without pressure penetrates ("overlap
    correction"). On rough surfaces this happens in most iterations.
    """
    half_space = problem.half_space
    direction = np.zeros_like(pressure)
    conjugate, old_norm, iteration = False, 1.0, 0
    while True:
        gap = problem.gap(pressure)
        yield Iterate(iteration, pressure, problem.certificate(pressure, gap), gap)
        iteration += 1
        contact = pressure > 0
        if problem.mean_pressure is not None:
            gap -= gap.mean(where=contact) if contact.any() else 0.0
        norm = float(np.sum(gap**2, where=contact))
        direction *= conjugate * norm / old_norm
        direction += gap
        direction *= contact
        old_norm = norm or 1.0
        response = half_space.displacement(direction)
        if problem.mean_pressure is not None:
            response = response - response.mean(where=contact)
        curvature = float(np.vdot(response, direction))
        # Before any sample is pressed there is no curvature: take a small step, that of the softest
        # mode.
        step = float(np.vdot(gap, direction)) / curvature if curvature > 0 else half_space.softest
        pressure -= step * direction
        np.maximum(pressure, 0, out=pressure)
        overlap = (pressure == 0) & (gap < 0)
        conjugate = not overlap.any()
        pressure -= step * gap * overlap
        problem.make_admissible(pressure)
