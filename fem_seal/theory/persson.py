"""Persson's contact mechanics: area, mean gap and gap distribution from the power spectrum alone.

Magnification ζ = q/q_l: at ζ only roughness of wavenumbers up to ζ q_l is seen. C(q) is the
isotropic spectrum, <h²> = 2π ∫ q C dq; E* the contact modulus; p0 the nominal pressure.
Sources: contact area, B. N. J. Persson, J. Chem. Phys. 115, 3840 (2001); mean gap, C. Yang and
B. N. J. Persson, J. Phys.: Condens. Matter 20, 215214 (2008); gap distribution, A. Almqvist,
C. Campañá, N. Prodanov and B. N. J. Persson, J. Mech. Phys. Solids 59, 2355 (2011).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.registry import choose
from fem_seal.theory.quadrature import Cumulative, LogGrid, graded_cell, log_grid

# Part of the elastic energy that survives where contact is partial; fitted by Yang and Persson.
GAMMA = 0.45
# Where less than this part of A0 opens, its mean gap is 0/0 to rounding and left at zero. (Towards
# ζ = 1 the theory's u1 grows without limit while the area that opens vanishes faster.)
SMALLEST_AREA = 1e-12


class IsotropicSpectrum(Protocol):
    """What is asked of a spectrum; `fem_seal.surface.spectrum.Spectrum` is one."""

    @property
    def wavenumbers(self) -> tuple[float, ...]:
        """Where C(q) begins, has kinks, and ends, in order [1/m]."""

    def density(self, q: np.ndarray) -> np.ndarray:
        """C(q) [m^4]."""


@dataclass(frozen=True, eq=False)
class Interface:
    """Persson's picture of one interface under one pressure, magnification by magnification.

    q : (n + 1,) largest wavenumber seen [1/m]; the last is the full resolution
    area : (n + 1,) A(ζ)/A0, from 1 downwards
    mean_gap : (n + 1,) mean gap over the contact seen at ζ [m]; zero at full resolution
    opened_area : (n,) part of A0 that opens between neighbouring magnifications
    opened_gap : (n,) mean gap of what opens there [m]
    unseen_rms : (n,) rms height of the roughness not yet seen there [m]
    """

    q: np.ndarray
    area: np.ndarray
    mean_gap: np.ndarray
    opened_area: np.ndarray
    opened_gap: np.ndarray
    unseen_rms: np.ndarray


def contact_area(pressure: float, contact_modulus: float, mean_square_slope: float) -> float:
    """A/A0 = erf(√2 p0 / (E* h'rms)).

    Parameters
    ----------
    pressure, contact_modulus : [Pa]
    mean_square_slope : h'rms² of the roughness that is seen, 2π ∫ q³ C dq

    Returns
    -------
    float in [0, 1]
    """
    from scipy.special import erf

    return float(erf(np.sqrt(2 / mean_square_slope) * pressure / contact_modulus))


def interface(
    spectrum: IsotropicSpectrum,
    *,
    pressure: float,
    contact_modulus: float,
    gamma: float = GAMMA,
    cells_per_octave: int = 12,
) -> Interface:
    """Contact area, mean gap and opened gap at all magnifications.

    Parameters
    ----------
    spectrum : C(q) with its range
    pressure : p0 [Pa], > 0
    contact_modulus : E* [Pa], > 0
    gamma : γ of the mean gap
    cells_per_octave : resolution in ln ζ

    Returns
    -------
    Interface

    Raises
    ------
    InvalidInput
        If a pressure is not positive.

    Notes
    -----
    ū(ζ) = √π ∫_{ζq0}^{q1} dq q² C w ∫_{p(ζ)}^∞ dp'/p' [γ + 3(1-γ) erf²(w p'/E*)] exp(-(w p'/E*)²),
    w(q, ζ) = (π ∫_{ζq0}^q q'³ C dq')^(-1/2), p(ζ) = p0 A0/A(ζ). The inner integral depends on
    w p(ζ)/E* alone. What opens between ζ and ζ + dζ has the mean gap u1 = ū + ū' A/A', that is
    d(A ū)/dA, taken here from the volumes A ū at both ends.
    """
    from scipy.special import erf, erfc

    for name, value in (("pressure", pressure), ("contact_modulus", contact_modulus)):
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(f"{name} must be a positive number of Pa, got {value}")
    grid = log_grid(spectrum.wavenumbers, cells_per_octave)
    slopes = grid.cumulative(lambda q: _half_slope_density(spectrum, q))
    heights = grid.cumulative(lambda q: 2 * np.pi * q * spectrum.density(q))
    strain = pressure / contact_modulus
    # At ζ = 1 no slope is seen and contact is complete.
    scaled_pressure = strain / np.sqrt(slopes.at_edges[1:])
    area = np.concatenate([[1.0], erf(scaled_pressure)])
    opened_area = np.diff(erfc(scaled_pressure), prepend=0.0)
    mean_gap = _mean_gap(spectrum, grid, slopes, strain / area, gamma)
    something = opened_area > SMALLEST_AREA
    opened_gap = np.zeros_like(opened_area)
    np.divide(-np.diff(area * mean_gap), opened_area, out=opened_gap, where=something)
    unseen = heights.at_edges[-1] - 0.5 * (heights.at_edges[1:] + heights.at_edges[:-1])
    return Interface(grid.edges, area, mean_gap, opened_area, opened_gap, np.sqrt(unseen))


def _half_slope_density(spectrum: IsotropicSpectrum, q: np.ndarray) -> np.ndarray:
    """π q³ C, whose integral is half the mean square slope and w^-2."""
    return np.pi * q**3 * spectrum.density(q)


def _mean_gap(
    spectrum: IsotropicSpectrum,
    grid: LogGrid,
    slopes: Cumulative,
    strain: np.ndarray,
    gamma: float,
) -> np.ndarray:
    """ū at every edge of the grid, from p(ζ)/E* = strain there.

    w(q, ζ) has a root singularity at the lower end, where the cell is graded.
    """

    def summed(q: np.ndarray, weights: np.ndarray, slope: np.ndarray, k: int) -> float:
        w = 1 / np.sqrt(slope)
        return np.sum(
            weights * q**2 * spectrum.density(q) * w * inner_integral(w * strain[k], gamma)
        )

    gap = np.zeros(grid.edges.size)
    for k, (low, high) in enumerate(pairwise(grid.edges)):
        q, weights, inner = graded_cell(low, high)
        slope = (_half_slope_density(spectrum, inner[..., 0]) * inner[..., 1]).sum(axis=-1)
        rest = slice(k + 1, None)
        beyond = slopes.at_nodes[rest] - slopes.at_edges[k]
        gap[k] = summed(q, weights, slope, k)
        gap[k] += summed(grid.nodes[rest], grid.weights[rest], beyond, k)
    return np.sqrt(np.pi) * gap


def inner_integral(x: np.ndarray, gamma: float = GAMMA) -> np.ndarray:
    """∫_x^∞ dt/t [γ + 3(1-γ) erf²(t)] exp(-t²), the inner integral of the mean gap.

    The first part is γ E1(x²)/2; the second is smooth down to x = 0 and taken by Gauss-Legendre.

    Parameters
    ----------
    x : float array, > 0
    gamma : γ

    Returns
    -------
    float array of the shape of x
    """
    from scipy.special import erf, exp1

    far = 7.0  # exp(-49) is beyond rounding
    t, weights = np.polynomial.legendre.leggauss(40)
    near = np.minimum(x, far)[..., None]
    t = near + 0.5 * (t + 1) * (far - near)
    smooth = erf(t) ** 2 * np.exp(-(t**2)) / t * (0.5 * (far - near))
    return 0.5 * gamma * exp1(x**2) + 3 * (1 - gamma) * (smooth @ weights)


def _almqvist(opened_gap: np.ndarray, unseen_rms: np.ndarray) -> np.ndarray:
    return unseen_rms


def _afferrante(opened_gap: np.ndarray, unseen_rms: np.ndarray) -> np.ndarray:
    return unseen_rms * opened_gap / np.hypot(unseen_rms, opened_gap)


# Width s of the gap's scatter about u1. "almqvist": s = h_rms(ζ); "afferrante": 1/s² = 1/h_rms² +
# 1/u1² (L. Afferrante, F. Bottiglione, C. Putignano, B. N. J. Persson, G. Carbone, Tribol. Lett.
# 66, 75 (2018)).
SCATTERS = {"almqvist": _almqvist, "afferrante": _afferrante}


def gap_distribution(state: Interface, gap: np.ndarray, *, scatter: str = "almqvist") -> np.ndarray:
    """Probability density P(u) of the gap u > 0; contact adds a delta function of weight A/A0.

    P(u) = Σ ΔA/A0 (2π s²)^(-1/2) {exp(-(u - u1)²/2s²) + exp(-(u + u1)²/2s²)}.

    Parameters
    ----------
    state : from `interface`
    gap : (m,) gaps u >= 0 [m]
    scatter : one of SCATTERS

    Returns
    -------
    (m,) float [1/m], with ∫ P du = 1 - A/A0

    Raises
    ------
    InvalidInput
        For an unknown scatter.
    """
    s = scatter_width(state, scatter)
    counts = (state.opened_area > 0) & (s > 0)
    u1, s, part = (v[counts] for v in (state.opened_gap, s, state.opened_area))
    u = np.asarray(gap, dtype=float)[..., None]
    bells = np.exp(-0.5 * ((u - u1) / s) ** 2) + np.exp(-0.5 * ((u + u1) / s) ** 2)
    return bells @ (part / (np.sqrt(2 * np.pi) * s))


def scatter_width(state: Interface, scatter: str) -> np.ndarray:
    """Width s of the gap's scatter about u1, (n,) [m]; see SCATTERS."""
    return choose(SCATTERS, scatter, "scatter")(state.opened_gap, state.unseen_rms)
