"""The methods by name, and the one loop that stops them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.contact.damped import damped, fista
from fem_seal.contact.free_set_cg import free_set_cg
from fem_seal.contact.polonsky_keer import polonsky_keer
from fem_seal.contact.problem import Iterate, Iterates, Problem
from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.registry import require_known

Progress = Callable[[int, float], None]


@dataclass(frozen=True)
class Method:
    """An endless iteration, when to give up by default, and whether coarser grids start it."""

    iterates: Callable[[Problem, np.ndarray], Iterates]
    max_iterations: int
    starts_coarse: bool = False


METHODS = {
    "free-set-cg": Method(free_set_cg, 2000, starts_coarse=True),
    "damped": Method(damped, 50000),
    "fista": Method(fista, 20000),
    "polonsky-keer": Method(polonsky_keer, 20000),
}

# An error that has not fallen by a tenth in so many looks is taken for the floor of the arithmetic.
PATIENCE = 300

# Float64 cannot tell a smaller certificate from zero.
SMALLEST_TOLERANCE = 1e-13


@dataclass(frozen=True)
class Stopping:
    """When to stop: method name, certificate wanted, limit of iterations, who is told."""

    solver: str = "free-set-cg"
    tolerance: float = 1e-6
    max_iterations: int | None = None
    progress: Progress | None = None

    def __post_init__(self):
        require_known(METHODS, self.solver, "solver")
        if not SMALLEST_TOLERANCE <= self.tolerance < 1:
            raise InvalidInput(
                f"tolerance must lie in [{SMALLEST_TOLERANCE}, 1), got {self.tolerance}"
            )
        if self.max_iterations is not None and self.max_iterations < 1:
            raise InvalidInput(f"max_iterations must be at least 1, got {self.max_iterations}")


@dataclass(frozen=True, eq=False)
class Converged:
    """The last iterate, and the certificate after each iteration looked at."""

    iterate: Iterate
    residuals: tuple[float, ...]


def converge(problem: Problem, pressure: np.ndarray, stopping: Stopping) -> Converged:
    """Iterate until the certificate is reached.

    Raises
    ------
    NotConverged
        At the limit of iterations, when the error stagnates, or when it is not a number.
    """
    method = METHODS[stopping.solver]
    limit = stopping.max_iterations or method.max_iterations
    residuals: list[float] = []
    best, best_at = np.inf, 0
    for iterate in method.iterates(problem, pressure):
        residuals.append(iterate.error)
        if stopping.progress is not None:
            stopping.progress(iterate.iteration, iterate.error)
        if iterate.error <= stopping.tolerance:
            return Converged(iterate, tuple(residuals))
        if iterate.error < 0.9 * best:
            best, best_at = iterate.error, len(residuals)
        stalled = len(residuals) - best_at > PATIENCE
        if iterate.iteration >= limit or stalled or np.isnan(iterate.error):
            break
    why = "its error no longer falls" if stalled else "that is the limit"
    raise NotConverged(
        f"contact by {stopping.solver}: certificate {iterate.error:.1e} after "
        f"{iterate.iteration} iterations ({why}), best {min(residuals):.1e}, wanted "
        f"{stopping.tolerance:.1e}; loosen the tolerance or raise max_iterations"
    )
