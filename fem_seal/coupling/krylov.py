"""GMRES, whose Hessenberg matrix also shows eigenvalues of the operator."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

IMAGINARY_PART = 1e-9  # imaginary part of a real eigenvalue over its magnitude, by rounding


@dataclass(frozen=True, eq=False)
class LinearSolution:
    """Solution of a linear system A x = b by GMRES."""

    x: np.ndarray
    converged: bool  #: whether the residual is below the tolerance
    #: (iterations,), |A x - b| over |b| after each
    residuals: tuple[float, ...]
    #: (iterations,), of x along the vectors to which A was applied, in their order
    coefficients: np.ndarray
    unstable: bool = False  #: whether A has a negative real eigenvalue, as far as b shows it


def gmres(
    apply: Callable[[np.ndarray], np.ndarray],
    b: np.ndarray,
    tolerance: float,
    most: int,
    *,
    to_stable: bool = False,
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
    to_stable
        Whether the parts of the solution along eigenvectors with a negative real eigenvalue are
        reversed in x, which then does not solve the system: it leads where dx/dt = b would, and
        away from a state that this leaves. Residuals are those of the solution.
    """
    size = float(np.linalg.norm(b))
    if size == 0:
        return LinearSolution(np.zeros_like(b), True, (), np.empty(0))
    basis, hessenberg = [b / size], np.zeros((most + 1, most))
    residuals: list[float] = []
    for k in range(most):
        following = apply(basis[k]).copy()  # it may return its argument
        rounding = np.finfo(float).eps * np.linalg.norm(following)
        for i, vector in enumerate(basis):
            hessenberg[i, k] = np.vdot(vector, following)
            following -= hessenberg[i, k] * vector
        hessenberg[k + 1, k] = np.linalg.norm(following)
        whole, right_side = hessenberg[: k + 2, : k + 1], size * np.eye(k + 2)[0]
        y = np.linalg.lstsq(whole, right_side, rcond=None)[0]
        residuals.append(float(np.linalg.norm(whole @ y - right_side)) / size)
        converged = residuals[-1] <= tolerance
        # Nothing but rounding is new: x is exact or, where A is singular, no vector mends it.
        if converged or k + 1 == most or hessenberg[k + 1, k] <= rounding:
            break
        basis.append(following / hessenberg[k + 1, k])
    values, vectors = np.linalg.eig(whole[:-1])
    # Real Ritz values whose residual leaves no doubt about their sign.
    real = np.abs(values.imag) <= IMAGINARY_PART * np.abs(values)
    sure = real & (np.abs(whole[-1, -1] * vectors[-1]) < -values.real)
    if to_stable and sure.any():
        along = np.linalg.solve(vectors, y.astype(complex))
        y = (vectors @ np.where(sure, -along, along)).real
    x = sum((part * vector for part, vector in zip(y, basis, strict=True)), np.zeros_like(b))
    return LinearSolution(x, converged, tuple(residuals), y, bool(sure.any()))
