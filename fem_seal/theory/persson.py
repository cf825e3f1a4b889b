"""Persson's contact mechanics: area, mean gap, gaps and leak rate from the power spectrum.

At magnification ζ only roughness of wavenumbers between q0, the smallest, and ζ q0 is resolved; q1
is the largest wavenumber. C(q) is the isotropic spectrum, <h²> = 2π ∫ q C dq; E* the contact
modulus; P₀ the nominal pressure; A0 the nominal area. With

    w(q, ζ) = (π ∫_{ζq0}^q q'³ C(q') dq')^(-1/2)    and    p(ζ) = P₀ A0/A(ζ)

the contact area, the mean gap over the area in contact at ζ, the mean gap of the area that leaves
contact between ζ and ζ + dζ, and the distribution of the gap are

    A(ζ)/A0 = erf(w(ζ q0, 1) P₀/E*),
    ū(ζ) = √π ∫_{ζq0}^{q1} dq q² C w ∫_{p(ζ)}^∞ dp'/p' [γ + 3(1-γ) erf²(wp'/E*)] exp(-(wp'/E*)²),
    u1(ζ) = ū + ū' A/A' = d(A ū)/dA,
    P(u) = ∫ (-dA/A0) (2π s²)^(-1/2) {exp(-(u - u1)²/2s²) + exp(-(u + u1)²/2s²)}.

This area follows if the solid stores the energy of full contact at every magnification, w⁻² = V,
V(ζ) = π ∫ q³ C dq. Where contact is partial it stores less. In the area law "wang-mueser" V grows
by

    dV = S(A/A0) π q³ C dq,    S(a) = 5/9 - 2/9 a² + 2/3 a⁴,    A/A0 = erf(P₀/(E* √V)),

so that A E* h'rms/(P₀ A0) tends to √(8/π)/√(5/9) = 2.14 at light load, √(8/π) = 1.60 with S = 1.

Sources: contact area, B. N. J. Persson, J. Chem. Phys. 115, 3840 (2001), and A. Wang and M. H.
Müser, Tribol. Lett. 65, 103 (2017); mean gap, C. Yang and B. N. J. Persson, J. Phys.: Condens.
Matter 20, 215214 (2008); gap distribution, A. Almqvist, C. Campañá, N. Prodanov and B. N. J.
Persson, J. Mech. Phys. Solids 59, 2355 (2011).

The leak rate is that of the modified Bruggeman medium, Q = K Δp Ly/Lx: K solves the equation of
`bruggeman` with the local conductivities u³/(12 η) of gaps u, which are scattered normally with the
width s about the gap u1 of the area that opens at each magnification, and folded at u = 0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.special import erf, erfc, exp1

from fem_seal.arguments import choose, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.surface import IsotropicSpectrum, Spectrum
from fem_seal.theory.bruggeman import (
    ELASTIC_THRESHOLD,
    effective_conductivity,
    effective_dimension,
)

# γ: reduction of the elastic energy where contact is partial, fitted by Yang and Persson.
GAMMA = 0.45
# A step of magnification in which less than this part of A0 opens gets u1 = 0: Δ(A ū)/ΔA is 0/0
# there, to rounding. (Towards ζ = 1, u1 diverges, but the area that opens vanishes faster.)
SMALLEST_AREA = 1e-12
# Steps of magnification between a wavenumber and its double, and cells of the integrals over q in
# each step. A cell is 0.4 % wide; that 1/q has one value in it leaves an error of 10⁻⁵ at most in
# the mean gap.
PER_OCTAVE, STEP_CELLS = 12, 16
# Values of w p/E* from 0 to the last one, beyond which the integrals of the mean gap vanish.
LARGEST_T, TABLE_SIZE = 7.0, 40_000


@dataclass(frozen=True, eq=False)
class PerssonState:
    """Contact at one pressure on a ladder of n + 1 magnifications, in Persson's theory."""

    #: (n + 1,), largest wavenumber ζ q0 resolved [1/m]; the last one is q1, full resolution
    q: np.ndarray
    area: np.ndarray  #: (n + 1,), A(ζ)/A0, falling from 1
    #: (n + 1,) float ū(ζ), mean gap over the area in contact at ζ [m]; 0 at full resolution
    mean_gap: np.ndarray
    #: (n,), part of A0 that leaves contact between neighbouring magnifications
    opened_area: np.ndarray
    opened_gap: np.ndarray  #: (n,) float u1, mean gap of that area [m]
    #: (n,), rms height of the roughness not resolved there: wavenumbers from ζ q0 to q1 [m]
    unseen_rms: np.ndarray


def _reduced_energy(half_slope: np.ndarray, strain: float) -> np.ndarray:
    """V with dV = S(A/A0) d(π ∫ q³ C dq).

    In units of (P₀/E*)² the area is erf(V^(-1/2)) for every spectrum, and ∫ dV/S is the same
    function of V for all. That function is tabulated here and inverted. Below V = 0.01 contact is
    complete and S is 1; above 10⁶, S is S(0) to 10⁻⁶. Steps of 0.2 % are accurate to about 10⁻⁶.
    """
    V = np.append(0.0, np.geomspace(1e-2, 1e6, 8000))
    area = np.append(1.0, erf(V[1:] ** -0.5))
    inverse = 1 / (5 / 9 - 2 / 9 * area**2 + 2 / 3 * area**4)
    full = cumulative_trapezoid(inverse, V, initial=0.0)
    scaled = half_slope / strain**2
    beyond = np.maximum(scaled - full[-1], 0.0) / inverse[-1]
    return strain**2 * (np.interp(scaled, full, V) + beyond)


# Functions from π ∫ q³ C dq and P₀/E* to V, the elastic energy that determines the contact area.
AREA_LAWS: dict[str, Callable[[np.ndarray, float], np.ndarray]] = {
    "persson": lambda half_slope, strain: half_slope,
    "wang-mueser": _reduced_energy,
}


def persson_state(
    spectrum: Spectrum | IsotropicSpectrum,
    *,
    pressure: float,
    contact_modulus: float,
    area: str = "persson",
) -> PerssonState:
    """Contact area, mean gap and gap of the opened area at all magnifications.

    The derivative u1 = d(A ū)/dA is the quotient of the differences between neighbouring
    magnifications.

    Parameters
    ----------
    pressure, contact_modulus
        P₀ and E* [Pa].
    area
        "persson" or "wang-mueser": law of the contact area, see `AREA_LAWS`. The mean gap is that
        of Yang and Persson with the pressure P₀ A0/A of this law.
    """
    require_positive(pressure=pressure, contact_modulus=contact_modulus)
    edges = ladder(spectrum.wavenumbers, PER_OCTAVE * STEP_CELLS)
    # w⁻², half the mean square slope, and the mean square height up to each edge.
    half_slope = cumulative(lambda q: np.pi * q**3 * spectrum.density(q), edges)
    heights = cumulative(lambda q: 2 * np.pi * q * spectrum.density(q), edges)
    # The ladder of magnifications is every STEP_CELLS-th edge.
    at, strain = slice(None, None, STEP_CELLS), pressure / contact_modulus
    # At ζ = 1 no roughness is resolved and contact is complete.
    energy = choose(AREA_LAWS, area, "area law")(half_slope[at][1:], strain)
    scaled_pressure = strain / np.sqrt(energy)
    in_contact = np.concatenate([[1.0], erf(scaled_pressure)])
    opened_area = np.diff(erfc(scaled_pressure), prepend=0.0)
    mean_gap = _mean_gap(edges, half_slope, strain / in_contact)
    opens = opened_area > SMALLEST_AREA
    opened_gap = np.zeros_like(opened_area)
    np.divide(-np.diff(in_contact * mean_gap), opened_area, out=opened_gap, where=opens)
    heights = heights[at]
    unseen = heights[-1] - 0.5 * (heights[1:] + heights[:-1])
    return PerssonState(edges[at], in_contact, mean_gap, opened_area, opened_gap, np.sqrt(unseen))


def ladder(wavenumbers: tuple[float, ...], per_octave: int) -> np.ndarray:
    """Divide a range of wavenumbers [1/m] into steps, a multiple of STEP_CELLS between kinks."""
    marks = np.array(wavenumbers, dtype=float)
    if not (marks.size >= 2 and marks[0] > 0 and (np.diff(marks) >= 0).all()):
        raise InvalidInput(f"wavenumbers must be positive and ascending, got {wavenumbers}")
    if marks[0] == marks[-1]:
        raise InvalidInput(f"the spectrum spans no range of wavenumbers: {wavenumbers}")
    pieces = []
    for a, b in pairwise(np.unique(marks)):
        steps = int(np.ceil(np.log2(b / a) * per_octave / STEP_CELLS)) * STEP_CELLS
        pieces.append(np.geomspace(a, b, steps + 1)[:-1])
    return np.concatenate([*pieces, marks[-1:]])


def cumulative(integrand: Callable[[np.ndarray], np.ndarray], edges: np.ndarray) -> np.ndarray:
    """∫ f(q) dq from the first edge up to each one, by two Gauss points in ln q in each cell."""
    centre, half = np.log(edges[1:] * edges[:-1]) / 2, np.diff(np.log(edges)) / 2
    q = np.exp(centre + half * np.array([[-1], [1]]) / np.sqrt(3))
    return np.append(0.0, np.cumsum((half * q * integrand(q)).sum(axis=0)))


def _mean_gap(edges: np.ndarray, half_slope: np.ndarray, strain: np.ndarray) -> np.ndarray:
    """Mean gap ū(ζ) at each magnification; `strain` is p(ζ)/E*.

    With s = 1/w, 2 s ds = π q³ C dq and the integral becomes ū = 2/√π ∫ I(p/(E* s)) ds/q, where I
    is the inner integral. It has no singularity, and ∫ I ds is a function of s E*/p alone.
    """
    gap, ratio = np.zeros(strain.size), edges[1:] / edges[:-1]
    for k in range(strain.size - 1):
        cells = slice(k * STEP_CELLS, None)
        s = np.sqrt(half_slope[cells] - half_slope[k * STEP_CELLS])
        # Mean over s of ln q in a cell, where s² grows in proportion to q.
        place = (s[1:] + 2 * s[:-1]) / (3 * (s[1:] + s[:-1]))
        q = edges[:-1][cells] * ratio[cells] ** place
        gap[k] = strain[k] * np.sum(np.diff(inner_integral(s / strain[k])) / q)
    return 2 / np.sqrt(np.pi) * gap


def inner_integral(y: np.ndarray) -> np.ndarray:
    """∫_0^y dz ∫_(1/z)^∞ dt/t [γ + 3(1-γ) erf²(t)] exp(-t²), for y >= 0.

    The order of integration is changed: the range of z is y - 1/t for t > x = 1/y. The part with γ
    is then y E1(x²)/2 - exp(-x²)/x + √π erfc(x), the other one ∫_x^∞ (y/t - 1/t²) erf² exp(-t²) dt
    of two tabulated integrals.
    """
    y = np.asarray(y, dtype=float)
    # Above LARGEST_T all terms are below exp(-49).
    x = np.minimum(1 / np.maximum(y, 1 / LARGEST_T), LARGEST_T)
    t, first, second = _tables()
    even = y * exp1(x**2) / 2 - (np.exp(-(x**2)) / x - np.sqrt(np.pi) * erfc(x))
    rest: np.ndarray = y * np.interp(x, t, first) - np.interp(x, t, second)
    return np.where(y > 1 / LARGEST_T, GAMMA * even + 3 * (1 - GAMMA) * rest, 0.0)


@cache
def _tables() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values t from 0 to LARGEST_T, and ∫_t^∞ of erf²(v) exp(-v²)/v and of erf²(v) exp(-v²)/v²."""
    t = np.linspace(0.0, LARGEST_T, TABLE_SIZE)
    # erf(v)/v tends to 2/√π.
    quotient = np.append(2 / np.sqrt(np.pi), erf(t[1:]) / t[1:])
    square = quotient**2 * np.exp(-(t**2))
    upwards = (cumulative_trapezoid(f, t, initial=0.0) for f in (square * t, square))
    first, second = (f[-1] - f for f in upwards)
    return t, first, second


# Bruggeman's integral over a normal distribution: its extent in widths s, and its points
# z = z0 ± FINEST sinh v, with STEPS equal steps of v on either side of the gap u = 0. The narrowest
# gaps decide next to closing: of points at equal distances 65 erred by a factor of 3, 257 by a
# tenth.
SPREAD = 8.0
FINEST = 1e-6
STEPS = 100


def effective_film_conductivity(
    state: PerssonState,
    *,
    viscosity: float,
    threshold: float = ELASTIC_THRESHOLD,
) -> float:
    """Film conductivity K [m³/(Pa s)] of the letter's modified Bruggeman medium for Persson's gaps.

    Exactly 0 where the contact area reaches the threshold A*/A0; 1/2 gives Bruggeman's own medium.
    The leak rate is K Δp Ly/Lx.
    """
    contact = float(state.area[-1])
    dimension = effective_dimension(contact, threshold)
    s = state.unseen_rms
    # With z standard normal, |u1 + s z| has the density of the two bells of P(u) together.
    z, normal = _normal(-state.opened_gap / np.maximum(s, np.finfo(float).tiny))
    u = np.abs(state.opened_gap[:, None] + s[:, None] * z)
    weights = state.opened_area[:, None] * normal
    if contact >= threshold or not (weights > 0).any():
        return 0.0
    K = effective_conductivity(
        u.ravel() ** 3 / (12 * viscosity),
        weights=weights.ravel(),
        contact=contact,
        dimension=dimension,
        rtol=1e-9,
    )
    return float(K)


def _normal(centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points z and weights of the standard normal distribution, graded towards a centre each."""
    z0 = np.clip(centre, -SPREAD, SPREAD)[:, None]
    v = np.linspace(-1, 1, 2 * STEPS + 1) * np.arcsinh(2 * SPREAD / FINEST)
    z = z0 + FINEST * np.sinh(v)
    weights = np.exp(-0.5 * z**2) * np.cosh(v)
    return z, weights / weights.sum(axis=1, keepdims=True)
