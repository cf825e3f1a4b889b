"""The iterative methods by name, and the loop that stops them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fem_seal.arguments import require_count, require_known
from fem_seal.contact.damped import damped, fista
from fem_seal.contact.free_set_cg import free_set_cg
from fem_seal.contact.polonsky_keer import polonsky_keer
from fem_seal.contact.problem import Iterate, Iterates, Measures, Problem
from fem_seal.digits import number_of
from fem_seal.errors import InvalidInput, NotConverged, present

Progress = Callable[[int, float], None]


class ContactMethod(NamedTuple):
    """An iterative method, and its own limit of the iterations."""

    iterates: Callable[[Problem, np.ndarray], Iterates]  #: never end by themselves
    max_iterations: int


CONTACT_METHODS = {
    "free-set-cg": ContactMethod(free_set_cg, 2000),
    "damped": ContactMethod(damped, 50000),
    "fista": ContactMethod(fista, 20000),
    "polonsky-keer": ContactMethod(polonsky_keer, 20000),
}

# Give up if no measure has fallen by a tenth in this many iterates: rounding has been reached.
MOST_STALLED = 300

# Limits that hold at every tolerance: of the gap of pressed samples and the overlap [rms height],
# and of the mean gap's relative error. The certificate weights the gap with the pressure, so that
# without them samples of tiny pressure could be far from contact and still count as touching.
GAP_TOLERANCE = 1e-4
MEAN_GAP_TOLERANCE = 1e-4

# Smallest certificate that float64 resolves.
SMALLEST_TOLERANCE = 1e-13


@dataclass(frozen=True)
class ContactStopping:
    """When to stop an iterative method."""

    #: "free-set-cg" (fastest), "polonsky-keer", "fista", or "damped": the letter's dynamics
    solver: str = "free-set-cg"
    tolerance: float = 1e-6  #: tolerance of the certificate, see `ContactState`
    #: largest number of iterations; None for the method's own limit
    max_iterations: int | None = None
    #: called with iteration and residual after each iteration (damped, fista: every 20)
    progress: Progress | None = None

    def __post_init__(self) -> None:
        require_known(CONTACT_METHODS, self.solver, "solver")
        if not SMALLEST_TOLERANCE <= self.tolerance < 1:
            raise InvalidInput(
                f"tolerance must lie in [{SMALLEST_TOLERANCE}, 1), got {self.tolerance}"
            )
        if self.max_iterations is not None:
            require_count(max_iterations=self.max_iterations)

    def shortfalls(self, measures: Measures, rounding: float) -> dict[str, tuple[float, float]]:
        """Value and limit of each measure that misses its limit.

        The limit of the gap is at least the `rounding` error of the displacement. That matters only
        at a loose tolerance: at a tight one the certificate, which contains the overlap, misses its
        limit first.
        """
        gap_limit = max(GAP_TOLERANCE, rounding)
        limits = {
            "certificate": (measures.certificate, self.tolerance),
            "largest gap under pressure / rms height": (measures.pressed_gap, gap_limit),
            "deepest overlap / rms height": (measures.penetration, gap_limit),
            "relative error of the mean gap": (measures.mean_gap_error, MEAN_GAP_TOLERANCE),
        }
        # "not <=" so that NaN counts as missed.
        return {name: pair for name, pair in limits.items() if not pair[0] <= pair[1]}


USUAL_STOPPING = ContactStopping()


def iterates(problem: Problem, pressure: np.ndarray, stopping: ContactStopping) -> Iterates:
    """Iterates up to the limit of iterations, or to a certificate that is not a number."""
    method = CONTACT_METHODS[stopping.solver]
    limit = stopping.max_iterations or method.max_iterations
    for iterate in method.iterates(problem, pressure):
        if stopping.progress is not None:
            stopping.progress(iterate.iteration, iterate.certificate)
        yield iterate
        if iterate.iteration >= limit or np.isnan(iterate.certificate):
            return


def converge(
    problem: Problem, pressure: np.ndarray, stopping: ContactStopping
) -> tuple[Iterate, Measures, tuple[float, ...]]:
    """Iterate until the certificate, the contact set and the mean gap meet their limits.

    Returns the accepted iterate, its measures, and the certificate after each iterate. The other
    measures are computed only once the certificate has met its limit, to save time.
    """
    residuals: list[float] = []
    best, best_excess, best_at = np.inf, np.inf, 0
    problem = replace(problem, tolerance=stopping.tolerance)
    for iterate in iterates(problem, pressure, stopping):
        residuals.append(iterate.certificate)
        missed = {"certificate": (iterate.certificate, stopping.tolerance)}
        if iterate.certificate <= stopping.tolerance:
            gap = present(iterate.gap, "gap of an iterate")
            measures = problem.measures(iterate.pressure, gap)
            missed = stopping.shortfalls(measures, problem.rounding(iterate.pressure))
            if not missed:
                return iterate, measures, tuple(residuals)
            excess = max(value / allowed for value, allowed in missed.values())
            if excess < 0.9 * best_excess:
                best_excess, best_at = excess, len(residuals)
        if iterate.certificate < 0.9 * best:
            best, best_at = iterate.certificate, len(residuals)
        stalled = len(residuals) - best_at > MOST_STALLED
        if stalled:
            break
    steps = number_of(iterate.iteration, "iteration")
    if np.isnan(iterate.certificate):
        raise NotConverged(
            f"contact by {stopping.solver}: the certificate is not a number after {steps}, since "
            "numbers overflowed; check the units of load, modulus and heights, or take another "
            "solver"
        )
    why = "its error no longer falls" if stalled else "that is the limit"
    measured = ", ".join(
        f"{name} {value:.1e} (wanted {allowed:.1e})" for name, (value, allowed) in missed.items()
    )
    remedy = "loosen the tolerance" if "certificate" in missed else "take another solver"
    if stalled and problem.rounding(iterate.pressure) > stopping.tolerance:
        remedy = (
            "rounding errors of so high a pressure hide the heights: check the units of pressure "
            "(contact.pressure), modulus and heights, or press less"
        )
    remedy += "" if stalled else " or raise max_iterations"
    raise NotConverged(
        f"contact by {stopping.solver}: {measured} after {steps} ({why}), "
        f"best certificate {min(residuals):.1e}; {remedy}"
    )
