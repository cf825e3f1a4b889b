"""Conjugate gradients on the free set, preconditioned by the inverse of the half-space.

Find p >= 0 with g = S p - h - δ >= 0 and p g = 0, at a prescribed load Σp or a prescribed offset δ.
With F the free set, M the stiffness (the inverse of S but for the mean), E the `Extension` from F
to the whole grid, 1_F the mean over F taken out (only at a prescribed load):

    1   g = S p - h,  δ = <p, g> / <p, 1>
    2   F = {p > 0 or g < δ}
    3   r = 1_F (g - δ)  on F, else 0
    4   z = 1_F (Eᵀ M E r)  on F; without E before F is steady
    5   β = max(<r, z> - <r_old, z>, 0) / <r_old, z_old>; without <r_old, z> before F is steady
    6   t = 1_F (z + β t)  on F; β = 0 if <r, t> <= 0
    7   α = <r, t> / <t, S t>
    8   p = max(p - α t, 0), scaled to the load

On a large grid p and g are in the steering precision, single if `precision` is "mixed", until the
certificate comes near the tolerance or their rounding.
"""

from math import inf

import numpy as np

from fem_seal.contact.blocks import RowPasses, product
from fem_seal.contact.extension import Extension
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.problem import Iterate, Iterates, Problem

# Fewest samples of a grid on which pressure and gap begin in single precision. Smaller arrays stay
# in the cache, where precision costs little.
SINGLE_FROM = 512**2
# Certificate down to which they may stay so, if it is also this many times their rounding.
SINGLE_ABOVE, ROUNDINGS = 1e-4, 10

# If used too early, the extension may keep the free set from becoming steady. It is steady below a
# certificate of 0.02, and in a start below 0.2 mostly at once (measured from 256² to 1024², 5 to
# 60 % of contact, H = 0.4 and 0.8). With more than `LARGE` samples along a side both limits must
# fall inversely to their number: at 2048² 0.02 is too early, 0.01 is not.
STEADY, STEADY_AT_START, LARGE = 0.02, 0.2, 1024
# Iterations without a new smallest certificate, and without a halved one, after which the extension
# is left out again; and the factor by which the certificate must fall before it is tried once more.
MOST_RISES, MOST_SLOW, FALL_TO_RETRY = 2, 12, 5


def free_set_cg(problem: Problem, pressure: np.ndarray) -> Iterates:
    """Minimise p·Sp/2 - p·h over p >= 0 in about 2.5 FFT pairs per iteration.

    It differs from Polonsky and Keer's method (Wear 231, 206 (1999)) in three points. Samples that
    overlap join the free set at once, so that the search direction is never reset. The residual is
    preconditioned by the half-space's stiffness on the free set, with an `Extension` beyond its
    edge once the free set is steady. The curvature along the search direction takes a single
    forward transform.

    Numbers in comments are the steps of the module's docstring. The gap is stored in the
    half-space's exact work array, z and a gap in single precision in its steering array. Passes
    over the arrays go block by block, in the half-space's threads, and steps that read the same
    arrays are merged.
    """
    half_space, passes = problem.half_space, problem.half_space.passes
    state, z = _Pressed(problem, pressure), half_space.steer.values
    r, r_old, t, free = (np.zeros(z.shape, z.dtype) for _ in range(4))
    extension, steadiness = Extension(free, passes=passes), _Steadiness(pressure.size)
    rz_old, iteration, steady = inf, 0, False
    while True:
        certificate = state.displace()  # 1
        if state.needs_double(certificate):
            # The same pressure once more, in double precision. The next direction is that of the
            # residual alone: rounding has spoilt the conjugacy of those before.
            state.to_double()
            rz_old = inf
            continue
        yield Iterate(iteration, state.p, certificate, state.g)
        iteration += 1
        before, steady = steady, steadiness.record(iteration, certificate)
        if steady != before:
            rz_old = inf
        r, r_old = r_old, r
        number, sum_r = _restrict_gap(passes, state, free, r)  # 2, 3
        if state.load is None:
            number = inf  # At an offset no mean is taken out.
        _centre(passes, r, sum_r / number, free)
        _precondition(half_space, r, z, extension if steady else None)  # 4
        sum_z, rz = _restrict(passes, z, free, r)
        # 5: with the extension, the formula of Polak and Ribière: samples that join or leave the
        # free set would spoil the directions of Fletcher and Reeves. Without it, the formula of
        # Fletcher and Reeves is a little faster.
        r_old_z = _centre(passes, z, sum_z / number, free, r_old if steady else None)
        beta = max(rz - r_old_z, 0.0) / rz_old
        rz_old = rz
        slope = _centre(passes, t, _turn(passes, t, beta, free, z) / number, free, r)  # 6
        if slope <= 0:
            slope = _centre(passes, t, _turn(passes, t, 0.0, free, z) / number, free, r)
        z[...] = t  # 7
        curvature = half_space.curvature()
        state.advance(slope / curvature if curvature > 0 else 0.0, t)  # 8


class _Pressed:
    """The pressure p and the gap g that it causes: steps 1 and 8.

    Without units, as the `Problem`. On large grids both are in single precision until the
    certificate comes near the tolerance or their rounding.
    After a step p is still to be scaled to the load, which the next pass over it does.
    """

    def __init__(self, problem: Problem, pressure: np.ndarray):
        half_space, mean = problem.half_space, problem.mean_pressure
        self._problem, self._half_space = problem, half_space
        self._exact = pressure
        self._exact_wall = (
            problem.heights if mean is not None else problem.heights - problem.mean_gap
        )
        self.load = None if mean is None else mean * pressure.size  #: Σp; None at an offset
        dtype = half_space.steer.values.dtype
        self._single = dtype != pressure.dtype and pressure.size >= SINGLE_FROM
        self.p, self._wall = pressure, self._exact_wall
        if self._single:
            self.p, self._wall = pressure.astype(dtype), self._exact_wall.astype(dtype)
        self.offset = 0.0  #: δ
        self._scale, self._total = 1.0, float(self.p.sum())
        self._uniform = bool(np.ptp(self.p) == 0)

    @property
    def g(self) -> np.ndarray:
        """Displacement, and after `displace` the gap, in the half-space's work array."""
        return self._half_space.steer.values if self._single else self._half_space.exact.values

    def displace(self) -> float:
        """Scale p to the load, and compute gap and offset; return the certificate."""
        half_space, passes = self._half_space, self._half_space.passes
        _scale(passes, self.p, self._scale, out=self.g)
        if self._uniform:
            self.g[...] = 0.0  # It displaces uniformly: no transform for a cold start.
        elif self._single:
            half_space.displace_in_steer()
        else:
            half_space.displace()
        self._uniform = False
        work, lowest = _subtract(passes, self._wall, self.g, self.p)
        self.offset = 0.0 if self.load is None else work / self._total
        return self._problem.certificate_from(self._total, work, lowest)

    def needs_double(self, certificate: float) -> bool:
        """Whether p and g are single, and the certificate is near to the tolerance or rounding."""
        if not self._single:
            return False
        rounding = ROUNDINGS * self._problem.rounding(self.p, self.p.dtype)
        return certificate <= max(SINGLE_ABOVE, self._problem.tolerance, rounding)

    def to_double(self) -> None:
        """Go on in double precision."""
        self._exact[...] = self.p
        self.p, self._wall, self._single = self._exact, self._exact_wall, False
        self._sum_up(float(self.p.sum()))

    def advance(self, alpha: float, t: np.ndarray) -> None:
        """Step by -α t to a pressure of at least zero."""
        self._sum_up(_advance(self._half_space.passes, self.p, alpha, t))

    def _sum_up(self, total: float) -> None:
        """Take the sum of p, and the scale that makes it the load."""
        self._scale, self._total = (
            (1.0, total) if self.load is None else (self.load / total, self.load)
        )


class _Steadiness:
    """Whether the free set is steady, judged by the fall of the certificate."""

    def __init__(self, samples: int):
        scale = min(1.0, LARGE / samples**0.5)
        #: certificate below which the free set next counts as steady
        self.below = scale * STEADY_AT_START
        #: largest value of `below` once the free set has been steady for the first time
        self.later = scale * STEADY
        self.steady = False  #: whether it is steady; then the extension is in use
        #: since it is steady: smallest certificate, and the certificate when it last had halved
        self.least = self.halved = inf
        self.least_at = self.halved_at = 0  #: iterations of both

    def record(self, iteration: int, certificate: float) -> bool:
        """Judge by one more certificate whether the free set counts as steady."""
        if not self.steady:
            self.steady = certificate < self.below
            # Watch the progress from here on, with the extension.
            self.least, self.least_at = certificate, iteration
            self.halved, self.halved_at = certificate, iteration
            self.below = min(self.below, self.later)
            return self.steady
        if certificate < self.least:
            self.least, self.least_at = certificate, iteration
        if certificate <= self.halved / 2:
            self.halved, self.halved_at = certificate, iteration
        rises, slow = iteration - self.least_at, iteration - self.halved_at
        if rises >= MOST_RISES or slow > MOST_SLOW:
            self.steady, self.below = False, min(self.least, self.later) / FALL_TO_RETRY
        return self.steady


def _centre(
    passes: RowPasses,
    values: np.ndarray,
    mean: float,
    free: np.ndarray,
    other: np.ndarray | None = None,
) -> float:
    """Subtract the mean of values on the free set, in place; return <other, values>."""
    one = values.dtype.type(mean)

    def subtract(rows: slice) -> float:
        block = values[rows]
        block -= one * free[rows]
        return product(other[rows], block) if other is not None else 0.0

    return sum(passes.over(values.shape, subtract))


def _scale(passes: RowPasses, p: np.ndarray, scale: float, out: np.ndarray) -> None:
    """Multiply p by the scale, in place, and copy it."""

    def multiply(rows: slice) -> None:
        p[rows] *= scale
        out[rows] = p[rows]

    passes.over(p.shape, multiply)


def _subtract(
    passes: RowPasses, wall: np.ndarray, g: np.ndarray, p: np.ndarray
) -> tuple[float, float]:
    """Subtract the wall from the displacement g, in place; return <p, g> and min g."""

    def subtract(rows: slice) -> tuple[float, float]:
        gap = g[rows]
        gap -= wall[rows]
        return product(p[rows], gap), float(gap.min())

    works, lowest = zip(*passes.over(g.shape, subtract), strict=True)
    return sum(works), min(lowest)


def _restrict_gap(
    passes: RowPasses, state: _Pressed, free: np.ndarray, r: np.ndarray
) -> tuple[float, float]:
    """Write the free set into `free`, and g - δ on it into r; return its size and Σ r."""
    p, g, offset = state.p, state.g, state.offset

    def restrict(rows: slice) -> tuple[int, float]:
        """Free samples of some rows, and the sum of their residual."""
        # Subtract in the precision of g, before that of r: once g is in double precision, the small
        # residuals of pressed samples keep their digits.
        above, residual = g[rows] - offset, r[rows]
        mask = above < 0
        mask |= p[rows] > 0
        free[rows] = mask
        residual[...] = above
        residual *= free[rows]
        return np.count_nonzero(mask), float(residual.sum())

    numbers, totals = zip(*passes.over(g.shape, restrict), strict=True)
    return sum(numbers), sum(totals)


def _precondition(
    half_space: HalfSpace, r: np.ndarray, z: np.ndarray, extension: Extension | None
) -> None:
    """Write Eᵀ M E r into z, the half-space's steering array; M r without an extension."""
    if extension is None:
        z[...] = r
        half_space.precondition()
        return
    extension.update()
    extension.extend(r, z)
    half_space.precondition()
    extension.gather(z)


def _restrict(
    passes: RowPasses, z: np.ndarray, free: np.ndarray, r: np.ndarray
) -> tuple[float, float]:
    """Set z to zero outside the free set, in place; return Σ z and <r, z>."""

    def restrict(rows: slice) -> tuple[float, float]:
        block = z[rows]
        block *= free[rows]
        return float(block.sum()), product(r[rows], block)

    totals, products = zip(*passes.over(z.shape, restrict), strict=True)
    return sum(totals), sum(products)


def _turn(passes: RowPasses, t: np.ndarray, beta: float, free: np.ndarray, z: np.ndarray) -> float:
    """Write z + β t on the free set into t; return its sum."""
    factor = t.dtype.type(beta)

    def turn(rows: slice) -> float:
        block = t[rows]
        block *= factor
        block *= free[rows]
        block += z[rows]
        return float(block.sum())

    return sum(passes.over(t.shape, turn))


def _advance(passes: RowPasses, p: np.ndarray, alpha: float, t: np.ndarray) -> float:
    """Write max(p - α t, 0) into p; return its sum."""

    def advance(rows: slice) -> float:
        block = p[rows]
        block -= alpha * t[rows]
        np.maximum(block, 0, out=block)
        return float(block.sum())

    return sum(passes.over(p.shape, advance))
