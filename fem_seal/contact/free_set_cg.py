"""Conjugate gradients on the free set, preconditioned by the inverse of the half-space."""

import numpy as np

from fem_seal.contact.blocks import row_blocks
from fem_seal.contact.problem import Iterate, Iterates, Problem


def free_set_cg(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Minimise p·Sp/2 - p·h over p >= 0 in about 2.5 FFT pairs an iteration.

    Three things distinguish it from Polonsky and Keer's method (Wear 231, 206 (1999)): points that
    penetrate join the free set at once, so that the search direction is never reset; the residual
    is preconditioned by the half-space's stiffness restricted to the free set; the curvature
    along the search direction comes from one forward transform.
    """
    search = _Search(problem, pressure)
    old_decrease, iteration = np.inf, 0
    while True:
        yield Iterate(iteration, pressure, search.look())
        iteration += 1
        search.free_residual()
        decrease = search.precondition()
        slope = search.turn(decrease / old_decrease)
        if slope <= 0:
            slope = search.turn(0.0)
        old_decrease = decrease
        search.advance(slope)


class _Search:
    """The arrays of the iteration, and its passes over them, block by block.

    The gap lives in the half-space's exact work array, the preconditioned residual in its
    steering one. Under pressure control every vector on the free set has zero mean there.
    """

    def __init__(self, problem: Problem, pressure: np.ndarray):
        half_space = problem.half_space
        shape, steering = half_space.shape, half_space.steering
        self.problem, self.half_space, self.pressure = problem, half_space, pressure
        self.gap, self.steer = half_space.exact.values, half_space.steer.values
        self.residual = np.empty(shape, steering)
        self.direction = np.zeros(shape, steering)
        self.free = np.empty(shape, steering)
        self.number_free = self.offset = 0.0
        self.uniform = np.ptp(pressure) == 0

    def look(self) -> float:
        """Compute the gap S p - h; return the certificate."""
        if self.uniform:
            # A uniform pressure displaces uniformly: the cold start costs no transform.
            self.gap[...] = 0.0
        else:
            self.gap[...] = self.pressure
            self.half_space.displace()
        self.uniform = False
        given = self.problem.mean_gap or 0.0
        total, work, lowest = 0.0, 0.0, np.inf
        for rows in row_blocks(self.gap.shape):
            gap, pressure = self.gap[rows], self.pressure[rows]
            gap -= self.problem.heights[rows]
            gap += given
            total += float(pressure.sum())
            work += _product(pressure, gap)
            lowest = min(lowest, float(gap.min()))
        prescribed = self.problem.mean_pressure is not None
        self.offset = work / total if prescribed else 0.0
        return self.problem.error_from(total, work, lowest)

    def free_residual(self) -> None:
        """Gap on the free points (pressed or penetrating), for the preconditioner."""
        total = self.number_free = 0.0
        for rows in row_blocks(self.gap.shape):
            # In double, so that the small residual of the pressed points keeps its digits below.
            gap = self.gap[rows] - self.offset
            self.free[rows] = (self.pressure[rows] > 0) | (gap < 0)
            self.residual[rows] = gap
            self.residual[rows] *= self.free[rows]
            total += float(self.residual[rows].sum())
            self.number_free += float(self.free[rows].sum())
        mean = self._mean(total)
        for rows in row_blocks(self.gap.shape):
            self.residual[rows] -= mean * self.free[rows]
            self.steer[rows] = self.residual[rows]

    def precondition(self) -> float:
        """Steepest descent in ``steer``; return its product with the residual."""
        self.half_space.precondition()
        total = decrease = 0.0
        for rows in row_blocks(self.gap.shape):
            steepest = self.steer[rows]
            steepest *= self.free[rows]
            total += float(steepest.sum())
            decrease += _product(self.residual[rows], steepest)
        mean = self._mean(total)
        for rows in row_blocks(self.gap.shape):
            self.steer[rows] -= mean * self.free[rows]
        return decrease

    def turn(self, conjugation: float) -> float:
        """Make the direction steepest + conjugation × direction; return the slope along it."""
        beta = self.steer.dtype.type(conjugation)
        total = 0.0
        for rows in row_blocks(self.gap.shape):
            direction = self.direction[rows]
            direction *= beta
            direction *= self.free[rows]
            direction += self.steer[rows]
            total += float(direction.sum())
        mean, slope = self._mean(total), 0.0
        for rows in row_blocks(self.gap.shape):
            direction = self.direction[rows]
            direction -= mean * self.free[rows]
            slope += _product(self.residual[rows], direction)
        return slope

    def advance(self, slope: float) -> None:
        """Step to the minimum along the direction, clip tension away, restore the load."""
        self.steer[...] = self.direction
        curvature = self.half_space.curvature()
        step, total = slope / curvature if curvature > 0 else 0.0, 0.0
        for rows in row_blocks(self.gap.shape):
            pressure = self.pressure[rows]
            pressure -= step * self.direction[rows]
            np.maximum(pressure, 0, out=pressure)
            total += float(pressure.sum())
        if self.problem.mean_pressure is not None:
            self.pressure *= self.problem.mean_pressure * self.pressure.size / total

    def _mean(self, total: float) -> np.floating:
        """Mean over the free points to be taken out: zero where the mean pressure is free."""
        prescribed = self.problem.mean_pressure is not None
        return self.residual.dtype.type(total / self.number_free if prescribed else 0.0)


def _product(one: np.ndarray, other: np.ndarray) -> float:
    """Sum of the products of two blocks; unlike vdot, einsum takes padded rows as they are."""
    return float(np.einsum("ij,ij->", one, other))
