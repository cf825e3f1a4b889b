"""Bruggeman's effective medium in n dimensions, and the letter's modification for elastic contact.

Let the local conductivity of a medium be k_i on a part w_i of its area, and 0 on the part c in
contact. The effective conductivity K solves

    Σ_i w_i (k_i - K) / (k_i + (n - 1) K) - c / (n - 1) = 0,    Σ_i w_i + c = 1.

The left side falls monotonically with K. At K = 0 it is (1 - c) - c/(n - 1): a medium with
c >= (n - 1)/n does not conduct, and (n - 1)/n is its percolation threshold.

D. A. G. Bruggeman, Ann. Phys. (Leipzig) 416, 636 (1935); for seals B. Lorenz and B. N. J. Persson,
Eur. Phys. J. E 31, 159 (2010); the effective dimension is that of W. B. Dapp, A. Lücke, B. N. J.
Persson and M. H. Müser, Phys. Rev. Lett. 108, 244301 (2012).
"""

import numpy as np

from fem_seal.errors import InvalidInput

# Relative contact area A*/A0 at which elastic contact percolates, from the 2012 letter.
ELASTIC_THRESHOLD = 0.42


def effective_conductivity(
    conductivity: np.ndarray,
    *,
    dimension: float = 2.0,
    weights: np.ndarray | None = None,
    contact: float = 0.0,
    rtol: float = 1e-13,
) -> np.ndarray:
    """Effective conductivity K of one medium or many, by bisection of ln K.

    Dimension n = 1 gives the series (harmonic) mean, n to infinity the parallel (arithmetic) mean.
    K is exactly 0 where the medium does not percolate.

    Parameters
    ----------
    conductivity : (..., m)
        Local conductivities k >= 0 of each medium, or the values of a histogram, along the last
        axis, in any unit.
    weights
        (m,) or (..., m), part of the area with each value; equal if left out. Normalised here to 1
        less `contact`.
    contact
        Part c of the whole area in contact, in [0, 1], besides the values k = 0.
    """
    k = np.asarray(conductivity, dtype=float)
    w = np.ones(k.shape[-1]) if weights is None else np.asarray(weights, dtype=float)
    _check(k, w, dimension, contact)
    w = (1 - contact) * w / w.sum(axis=-1, keepdims=True)
    largest = k.max(axis=-1)
    scaled = k / np.where(largest > 0, largest, 1.0)[..., None]
    return largest * _root(scaled, w, contact, dimension, rtol)


def _check(k: np.ndarray, w: np.ndarray, dimension: float, contact: float) -> None:
    if k.ndim == 0 or k.shape[-1] == 0 or not np.isfinite(k).all() or (k < 0).any():
        raise InvalidInput("conductivities must be finite and >= 0, at least one")
    if (w < 0).any() or not (w.sum(axis=-1) > 0).all():
        raise InvalidInput("weights must be >= 0 and not all zero")
    if not dimension >= 1:
        raise InvalidInput(f"the dimension of Bruggeman's medium must be >= 1, got {dimension}")
    if not 0 <= contact <= 1:
        raise InvalidInput(f"the part in contact must lie in [0, 1], got {contact}")


def _root(k: np.ndarray, w: np.ndarray, contact: float, n: float, rtol: float) -> np.ndarray:
    """Root K in [0, 1] of Bruggeman's equation for conductivities scaled to a maximum of 1."""
    open_ = k > 0
    w_open = np.where(open_, w, 0.0)
    c = contact + np.where(open_, 0.0, w).sum(axis=-1)
    # The part with k = 0 contributes -c/(n - 1) to the left side, whatever K is.
    contact_term = c / (n - 1) if n > 1 else np.where(c > 0, np.inf, 0.0)
    conducts = w_open.sum(axis=-1) > contact_term  # the left side is positive at K = 0
    widest = -np.log(np.finfo(float).tiny)  # ln K is bisected from that of the least double to 0
    low, high = np.full(conducts.shape, -widest), np.zeros(conducts.shape)
    k_open = np.where(open_ & conducts[..., None], k, 1.0)
    for _ in range(int(np.ceil(np.log2(widest / rtol)))):
        middle = 0.5 * (low + high)
        K = np.exp(middle)[..., None]
        too_low = (w_open * (k_open - K) / (k_open + (n - 1) * K)).sum(axis=-1) > contact_term
        low, high = np.where(too_low, middle, low), np.where(too_low, high, middle)
    return np.where(conducts, np.exp(0.5 * (low + high)), 0.0)


def effective_dimension(contact_area: float, threshold: float = ELASTIC_THRESHOLD) -> float:
    """Effective dimension n_eff of the letter, for which the medium percolates at A*.

    It falls linearly in the contact area A/A0, from 2 at A = 0 to 1/(1 - A*/A0) at A = A*. A
    threshold of 1/2 gives 2, Bruggeman's own medium, for every contact area.
    """
    if not (0 <= contact_area <= 1 and 0 < threshold < 1):
        raise InvalidInput(
            f"need 0 <= A/A0 <= 1 and 0 < A*/A0 < 1, got A/A0 = {contact_area}, A*/A0 = {threshold}"
        )
    at_threshold = 1 / (1 - threshold)
    return max(1.0, 2 + (at_threshold - 2) * contact_area / threshold)
