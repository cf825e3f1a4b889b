"""GMRES, whose Hessenberg matrix also shows eigenvalues of the operator."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """Solution of a linear system A x = b by GMRES."""

    x: np.ndarray
    converged: bool  #: whether the residual is below the tolerance
    #: (iterations,), |A x - b| over |b| after each
    residuals: tuple[float, ...]
    #: (iterations,), parts of x along the vectors to which A was applied, in their order
    parts: np.ndarray
    #: eigenvector of A with a negative real eigenvalue, if one was found
    negative: np.ndarray | None = None

    @property
    def iterations(self) -> int:
        """How often A was applied."""
        return len(self.residuals)


def gmres(
    apply: Callable[[np.ndarray], np.ndarray], b: np.ndarray, tolerance: float, most: int
) -> LinearSolution:
    """Solve A x = b from x = 0 (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 856 (1986)).

    Parameters
    ----------
    apply
        The operator A.
    tolerance
        Relative residual at which it stops.
    most
        Largest number of iterations.
    """
    size = float(np.linalg.norm(b))
    if size == 0:
        return LinearSolution(np.zeros_like(b), True, (), np.empty(0))
    basis, hessenberg = [b / size], np.zeros((most + 1, most))
    residuals: list[float] = []
    for k in range(most):
        following = apply(basis[k])
        for i, vector in enumerate(basis):
            hessenberg[i, k] = np.vdot(vector, following)
            following -= hessenberg[i, k] * vector
        hessenberg[k + 1, k] = np.linalg.norm(following)
        whole, right_side = hessenberg[: k + 2, : k + 1], size * np.eye(k + 2)[0]
        y = np.linalg.lstsq(whole, right_side, rcond=None)[0]
        residuals.append(float(np.linalg.norm(whole @ y - right_side)) / size)
        converged = residuals[-1] <= tolerance
        if converged or k + 1 == most:
            break
        basis.append(following / hessenberg[k + 1, k])
    negative = _negative(whole)
    away = None if negative is None else weighted_sum(negative, basis)
    return LinearSolution(weighted_sum(y, basis), converged, tuple(residuals), y, away)


def _negative(hessenberg: np.ndarray) -> np.ndarray | None:
    """Coefficients of the Ritz vector of the least real value, if its residual is less."""
    values, vectors = np.linalg.eig(hessenberg[:-1])
    residuals = np.abs(hessenberg[-1, -1] * vectors[-1])
    sure = (np.abs(values.imag) < 1e-9) & (residuals < -values.real)
    if not sure.any():
        return None
    return vectors[:, np.argmin(np.where(sure, values.real, np.inf))].real


def weighted_sum(parts: np.ndarray, basis: list[np.ndarray]) -> np.ndarray:
    """Sum of the vectors of a basis, each times its part."""
    total = np.zeros_like(basis[0])
    for part, vector in zip(parts, basis, strict=True):
        total += part * vector
    return total
