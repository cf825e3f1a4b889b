"""Conjugate gradients on the free set, preconditioned by the inverse of the half-space."""

import numpy as np

from fem_seal.contact.blocks import row_blocks
from fem_seal.contact.extension import Extension
from fem_seal.contact.problem import Iterate, Iterates, Problem

# Before the free set has settled the extended preconditioner may keep it from settling. It has
# below a certificate of 0.02, and in a start that is better than 0.2 it mostly has at once:
# measured from 256² to 1024², 5 to 60 % of contact, H = 0.4 and 0.8. From there on both have to
# fall with the number of samples along a side: 0.02 is too early at 2048², 0.01 is not.
SETTLED, SETTLED_AT_START = 0.02, 0.2
LARGE = 1024
# Looks without a new least error, or without a halved one, until the extension is left out again,
# and how far the error has to fall before it is tried once more.
RISES, PATIENCE, FALL = 2, 12, 5


def free_set_cg(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Minimise p·Sp/2 - p·h over p >= 0 in about 2.5 FFT pairs an iteration.

    Three things distinguish it from Polonsky and Keer's method (Wear 231, 206 (1999)): points that
    penetrate join the free set at once, so that the search direction is never reset; the residual
    is preconditioned by the half-space's stiffness restricted to the free set, once that has
    settled with an `Extension` beyond its edge; the curvature along the search direction comes from
    one forward transform.
    """
    search, settling = _Search(problem, pressure), _Settling(pressure.size)
    old_decrease, iteration = np.inf, 0
    while True:
        error = search.look()
        yield Iterate(iteration, pressure, error, search.gap)
        iteration += 1
        if settling.changes(iteration, error):
            search.extended = settling.settled
            old_decrease = np.inf
        search.free_residual()
        decrease, repeated = search.precondition()
        slope = search.turn(max(decrease - repeated, 0.0) / old_decrease)
        if slope <= 0:
            slope = search.turn(0.0)
        old_decrease = decrease
        search.advance(slope)


class _Settling:
    """Whether the free set of so many samples has settled, by how the certificate falls."""

    def __init__(self, samples: int):
        scale = min(1.0, LARGE / samples**0.5)
        self.settled, self.below = False, scale * SETTLED_AT_START
        self.later = scale * SETTLED
        self.least, self.least_at = np.inf, 0
        self.halved, self.halved_at = np.inf, 0

    def changes(self, iteration: int, error: float) -> bool:
        """Take note of an error; return whether the verdict has changed."""
        before = self.settled
        if not self.settled:
            self.settled = error < self.below
            # What counts is what the extension makes of it.
            self.least, self.least_at = error, iteration
            self.halved, self.halved_at = error, iteration
            self.below = min(self.below, self.later)
            return self.settled != before
        if error < self.least:
            self.least, self.least_at = error, iteration
        if error <= self.halved / 2:
            self.halved, self.halved_at = error, iteration
        if iteration - self.least_at >= RISES or iteration - self.halved_at > PATIENCE:
            self.settled, self.below = False, min(self.least, self.later) / FALL
        return self.settled != before


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
        # The first residual's predecessor is zero.
        self.residual, self.previous = np.zeros(shape, steering), np.empty(shape, steering)
        self.direction = np.zeros(shape, steering)
        self.free = np.empty(shape, steering)
        self.extension, self.extended = Extension(self.free), False
        given = problem.mean_gap
        self.wall = problem.heights if given is None else problem.heights - given
        self.number_free, self.offset = 0, 0.0
        self.total, self.rescale = float(pressure.sum()), 1.0
        self.uniform = np.ptp(pressure) == 0

    def look(self) -> float:
        """Restore the load, compute the gap S p - h; return the certificate."""
        for rows in row_blocks(self.gap.shape):
            self.pressure[rows] *= self.rescale
            self.gap[rows] = self.pressure[rows]
        if self.uniform:
            # A uniform pressure displaces uniformly: the cold start costs no transform.
            self.gap[...] = 0.0
        else:
            self.half_space.displace()
        self.uniform = False
        work, lowest = 0.0, np.inf
        for rows in row_blocks(self.gap.shape):
            gap = self.gap[rows]
            gap -= self.wall[rows]
            work += _product(self.pressure[rows], gap)
            lowest = min(lowest, float(gap.min()))
        prescribed = self.problem.mean_pressure is not None
        self.offset = work / self.total if prescribed else 0.0
        return self.problem.error_from(self.total, work, lowest)

    def free_residual(self) -> None:
        """Gap on the free points (pressed or penetrating), for the preconditioner."""
        self.residual, self.previous = self.previous, self.residual
        total, self.number_free = 0.0, 0
        for rows in row_blocks(self.gap.shape):
            free = (self.pressure[rows] > 0) | (self.gap[rows] < self.offset)
            self.number_free += np.count_nonzero(free)
            self.free[rows] = free
            residual = self.residual[rows]
            # Subtracted in double, so that the small residual of the pressed points keeps its
            # digits.
            np.subtract(self.gap[rows], self.offset, out=residual, casting="same_kind")
            residual *= self.free[rows]
            total += float(residual.sum())
        mean = self._mean(total)
        for rows in row_blocks(self.gap.shape):
            self.residual[rows] -= mean * self.free[rows]

    def precondition(self) -> tuple[float, float]:
        """Steepest descent in ``steer``; return its products with this residual and the last.

        The latter (Polak and Ribière's) only with the extension, else zero: samples that join or
        leave the free set then spoil a direction that is kept by Fletcher and Reeves's formula,
        while before the free set has settled that is the faster one, if by little.
        """
        if self.extended:
            self.extension.update()
            self.extension.extend(self.residual, self.steer)
        else:
            self.steer[...] = self.residual
        self.half_space.precondition()
        if self.extended:
            self.extension.gather(self.steer)
        total = decrease = 0.0
        for rows in row_blocks(self.gap.shape):
            steepest = self.steer[rows]
            steepest *= self.free[rows]
            total += float(steepest.sum())
            decrease += _product(self.residual[rows], steepest)
        mean, repeated = self._mean(total), 0.0
        for rows in row_blocks(self.gap.shape):
            steepest = self.steer[rows]
            steepest -= mean * self.free[rows]
            if self.extended:
                repeated += _product(self.previous[rows], steepest)
        return decrease, repeated

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
        """Step to the minimum along the direction and clip tension away."""
        self.steer[...] = self.direction
        curvature = self.half_space.curvature()
        step, self.total = slope / curvature if curvature > 0 else 0.0, 0.0
        for rows in row_blocks(self.gap.shape):
            pressure = self.pressure[rows]
            pressure -= step * self.direction[rows]
            np.maximum(pressure, 0, out=pressure)
            self.total += float(pressure.sum())
        if self.problem.mean_pressure is not None:
            wanted = self.problem.mean_pressure * self.pressure.size
            # Carried out with the next pass over the pressures.
            self.rescale, self.total = wanted / self.total, wanted

    def _mean(self, total: float) -> np.floating:
        """Mean over the free points to be taken out: zero where the mean pressure is free."""
        prescribed = self.problem.mean_pressure is not None
        return self.residual.dtype.type(total / self.number_free if prescribed else 0.0)


def _product(one: np.ndarray, other: np.ndarray) -> float:
    """Sum of the products of two blocks; unlike vdot, einsum takes padded rows as they are."""
    return float(np.einsum("ij,ij->", one, other))
