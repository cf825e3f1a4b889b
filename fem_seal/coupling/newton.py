"""Newton's method from one point to an equilibrium, in contact or floating."""

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from fem_seal.coupling.constants import FAR, INNER, MOST_STEPS
from fem_seal.coupling.point import FloatingPoint, LiftPoint
from fem_seal.progress import Report


@dataclass(frozen=True, eq=False)
class Steps:
    """Where Newton's steps have led, and what they have met on their way."""

    point: LiftPoint  #: the last one, whose step has not been taken
    residuals: tuple[float, ...]  #: `LiftPoint.size` at the start of each step
    #: whether a step was halved, GMRES took many iterations, or an unstable state was left. What a
    #: step changes to first order is then no measure of what it changes
    difficult: bool
    failure: str  #: why the last point is no equilibrium, else ""
    further: bool = False  #: whether its step has been solved: the next stage begins with it
    lost: bool = False  #: whether that of a stage before was none

    def after(self, before: "Steps") -> "Steps":
        """These steps with those before them, which have led to where these begin."""
        taken = before.further or before.failure
        return replace(
            self,
            residuals=(before.residuals if taken else before.residuals[:-1]) + self.residuals,
            difficult=before.difficult or self.difficult,
            lost=before.lost or self.lost,
        )


def newton(point: LiftPoint, tolerance: float, report: Report) -> Steps:
    """Take steps until the next one would change ln Q by at most a tolerance.

    A step is halved while |F| does not fall. F has kinks where samples open or close, so that |F|
    may have to rise before it falls: of all tried parts the one with the least |F| is taken. On the
    way from an unstable state |F| rises: the first step away is taken whole, each later one half as
    long, since steps of one length may lead back and forth for ever.

    Parameters
    ----------
    point
        Where to start.
    tolerance
        The steps end when the next one would change ln Q, to first order, and the solid's load,
        relative to itself, by at most this.
    """
    residuals, difficult, away, left = [point.size], False, 1.0, inf
    for _ in range(MOST_STEPS):
        report("lift", f"{len(point.grid.free)} nodes, residual {point.size:.1e}")
        # GMRES may leave a tenth of what a step was to change to first order.
        if left <= tolerance and point.settled(tolerance):
            return Steps(point, tuple(residuals), difficult, "")
        step = point.step
        difficult |= step.unstable or step.iterations > MOST_STEPS / 2
        little = step.log_rate <= tolerance and point.keeps_load(tolerance)
        if little and step.solved and not step.unstable:
            return Steps(point, tuple(residuals), difficult, "", further=True)
        left = INNER * step.log_rate
        parts = [1.0, 1 / 2, 1 / 4, 1 / 8]
        if step.unstable:
            # At the unstable equilibrium itself F is nearly zero, and so is the step. It is made
            # longer there, or it would not lead away.
            longer = FAR * point.problem.drop / np.abs(step.pressure).max()
            parts, away = [max(away, longer) if little else away], away / 2
        tried: list[LiftPoint] = []
        for part in parts:
            other = point.after(step, part)
            tried += [] if other is None else [other]
            if other is not None and other.size < point.size:
                break
            difficult = True
        if not tried:
            break
        point = min(tried, key=lambda other: other.size)
        residuals.append(point.size)
    failure = (
        f"Newton's steps have left {point.size:.1e} of the pressure drop, and the last one was to "
        f"change the logarithm of the leak rate by {step.log_rate:.2g}"
    )
    return Steps(point, tuple(residuals), difficult, failure)


def equilibrium(point: LiftPoint, tolerance: float, report: Report) -> Steps:
    """An equilibrium in contact or, if there is none, floating; arguments as of `newton`."""
    steps = newton(point, tolerance, report)
    point = steps.point
    if steps.failure and point.problem.may_float and point.contact.contact.any():
        floating = newton(FloatingPoint.leaving(point), tolerance, report)
        # A film that rises for ever carries less than the load: the solid is in contact.
        if not floating.failure:
            return floating.after(steps)
    return steps
