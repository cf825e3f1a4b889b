"""Newton's method from one point to an equilibrium, in contact or floating."""

from dataclasses import dataclass, replace
from itertools import islice
from math import inf

from fem_seal.coupling.point import STEP_TOLERANCE, FloatingPoint, LiftPoint

MOST_STEPS = 20  # in a stage; most scenes need two to five
# The fractions of a step that are tried until |F| falls; and those that the first, second, ... step
# away from unstable states takes.
STEP_FRACTIONS = 1.0, 1 / 2, 1 / 4, 1 / 8
AWAY_FRACTIONS = *STEP_FRACTIONS, 1 / 16, 1 / 32


@dataclass(frozen=True, eq=False)
class Steps:
    """Where Newton's steps have led, and what they have met on their way."""

    point: LiftPoint  #: the last one
    #: `LiftPoint.residual_size` at the start of each step, and at the end
    residuals: tuple[float, ...]
    #: whether a step was halved, or an unstable state was left; steps then change ln Q by more than
    #: their first order says
    difficult: bool
    failure: str  #: why the last point is no equilibrium, else ""
    lost: bool = False  #: whether one of their stages has come to no equilibrium
    change: float = inf  #: of ln Q by the flow of the last stage
    error: float = inf  #: of ln Q, estimated

    def after(self, before: "Steps") -> "Steps":
        """These steps with those before them, which have led to where these begin."""
        return replace(
            self,
            residuals=before.residuals[:-1] + self.residuals,
            difficult=before.difficult or self.difficult,
            lost=before.lost or self.lost,
        )


def newton(point: LiftPoint, tolerance: float) -> Steps:
    """Take steps until a further one would change ln Q by at most a tolerance.

    A step is halved while |F| does not fall. F has kinks where samples open or close, so that |F|
    may have to rise before it falls: of all tried fractions the one with the least |F| is taken. On
    the way from an unstable state |F| rises: at most six steps lead away from such states, the
    first whole, each later one half as long, lest they lead back and forth.
    """
    residuals, difficult, left = [point.residual_size], False, inf
    away = iter(AWAY_FRACTIONS)
    while True:
        nodes = len(point.network.free)
        point.problem.report("lift", f"{nodes} nodes, residual {residuals[-1]:.1e}")
        # GMRES may leave this part of what a step was to change to first order.
        if left <= tolerance and point.in_equilibrium(tolerance):
            return Steps(point, tuple(residuals), difficult, "")
        if len(residuals) > MOST_STEPS:
            break
        step = point.step
        left = STEP_TOLERANCE * step.log_rate
        fractions = list(islice(away, 1)) if step.unstable else STEP_FRACTIONS
        tried: list[LiftPoint] = []
        for fraction in fractions:
            other = point.after(step, fraction)
            if other is not None:
                tried.append(other)
                if other.residual_size < point.residual_size:
                    break
        difficult = difficult or step.unstable or fraction < 1
        if not tried:
            break
        point = min(tried, key=lambda other: other.residual_size)
        residuals.append(point.residual_size)
    allowed = point.problem.allowed
    if left <= allowed and point.in_equilibrium(allowed):  # though not to a smaller tolerance
        return Steps(point, tuple(residuals), True, "")
    failure = (
        f"Newton's steps have left {residuals[-1]:.1e} of the pressure drop, and the last one was "
        f"to change the logarithm of the leak rate by {step.log_rate:.2g}"
    )
    return Steps(point, tuple(residuals), difficult, failure, lost=True)


def equilibrium(point: LiftPoint, tolerance: float) -> Steps:
    """An equilibrium in contact or, if there is none, floating; tolerance as of `newton`."""
    steps = newton(point, tolerance)
    point = steps.point
    if steps.failure and point.problem.may_float and point.contact.contact.any():
        floating = newton(FloatingPoint.leaving(point), tolerance)
        # A film that rises for ever carries less than the load: the solid is in contact.
        if not floating.failure:
            return replace(floating.after(steps), lost=False)
    return steps
