"""Newton's method from one point to an equilibrium, in contact or floating."""

from dataclasses import dataclass, replace

import numpy as np

from fem_seal.coupling.constants import MOST_STEPS
from fem_seal.coupling.point import FloatingPoint, LiftPoint
from fem_seal.errors import present
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
    left: bool = False  #: whether an unstable state was left

    def after(self, before: "Steps") -> "Steps":
        """These steps with those before them."""
        return replace(
            self,
            residuals=before.residuals + self.residuals,
            difficult=before.difficult or self.difficult,
            left=before.left or self.left,
        )


def newton(point: LiftPoint, tolerance: float, report: Report) -> Steps:
    """Take steps until the next one would change ln Q by at most a tolerance.

    A step is halved while |F| does not fall. Samples that open or close bend F, so that |F| may
    have to rise before it falls: of all tried parts the one with the least |F| is taken.

    Parameters
    ----------
    point
        Where to start.
    tolerance
        Change of ln Q, to first order, and of the solid's load, over it, at which the steps end.
    """
    residuals, difficult = [point.size], False
    for _ in range(MOST_STEPS):
        report("lift", f"{len(point.stage.grid.free)} nodes, residual {point.size:.1e}")
        step = point.step
        difficult |= step.iterations > MOST_STEPS / 2
        if step.log_rate <= tolerance and point.keeps_load(tolerance):
            return Steps(point, tuple(residuals), difficult, "")
        tried: list[LiftPoint] = []
        for part in (1, 1 / 2, 1 / 4, 1 / 8):
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
        f"Newton's steps have left {point.size:.1e} of the pressure drop, and the next one would "
        f"change the logarithm of the leak rate by {point.step.log_rate:.2g}"
    )
    return Steps(point, tuple(residuals), difficult, failure)


def equilibrium(point: LiftPoint, tolerance: float, report: Report, leaves: bool) -> Steps:
    """An equilibrium in contact or, if there is none, floating.

    The other arguments are those of `newton`.

    Parameters
    ----------
    leaves
        Whether an unstable state is left.
    """
    steps = newton(point, tolerance, report)
    point = steps.point
    if steps.failure and point.problem.may_float and point.contact.contact.any():
        floating = newton(_floating(point), tolerance, report)
        # A film that rises for ever carries less than the load: the solid is in contact.
        if not floating.failure:
            steps = floating.after(steps)
    if not leaves or steps.point.step.negative is None:
        return steps
    left = _left(steps.point)
    if left is None:
        failure = (
            f"the equilibrium is unstable, and {2 * MOST_STEPS} passes through contact and flow in "
            "turn have not led to another one"
        )
        return replace(steps, difficult=True, failure=failure)
    steps = newton(left, tolerance, report).after(steps)
    return replace(steps, difficult=True, left=True)


def _floating(point: LiftPoint) -> FloatingPoint:
    """The point at which the solid has just left the counter-face."""
    problem, height = point.problem, point.problem.height.values
    level = float((height - problem.displacement(point.pressure)).max()) + point.stage.epsilon
    return present(FloatingPoint.at(problem, point.stage, point.pressure, level), "level")


def _left(point: LiftPoint) -> LiftPoint | None:
    """The point to which plain passes lead from an equilibrium that they leave.

    Where R' G' has a real eigenvalue above 1, a pass through contact and flow grows every deviation
    along its eigenvector: no such state lasts. None if F still grows after many passes.
    """
    away = present(point.step.negative, "direction")
    away = away * (point.problem.drop / np.abs(away).max())
    step = replace(point.step, pressure=away if away.mean() >= 0 else -away, gap=None)
    for _ in range(2 * MOST_STEPS):
        other = point.after(step)
        if other is None or other.size <= point.size:
            return point
        point, step = other, replace(step, pressure=other.residual)
    return None
