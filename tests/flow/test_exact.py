"""Leak rates known exactly: every level of every method must enclose them.

Two finite tolerances occur. Bounds are widened by 1e-12 against rounding. CG stops when its
estimate of the relative energy error, right within a factor of two, is `tolerance` (1e-8 unless
stated). Enclosure must hold for any value of the latter, and is tested without any tolerance.
"""

import numpy as np
import pytest
from gaps import DUALITY, TIGHT
from sample_gaps import FLUID

from fem_seal.film import GridFilm
from fem_seal.flow import Limits, leak_rate
from fem_seal.grid import GridField
from fem_seal.theory import closed_forms
from fem_seal.theory.closed_forms import disc_array, piecewise_linear_channel
from fem_seal.verification.exact_cases import pixel_gap, vertex_gap

METHODS = ["uniform", "adaptive"]
SIDES = ["wall", "periodic"]
ROUNDING = 1e-11  # ten times what the bounds are widened by


def solve(film, unknowns=1000, rtol=1e-3, method="uniform", **options):
    """Bounds on every level until the tolerance or the number of unknowns is reached."""
    options = {"limits": Limits(unknowns=unknowns), "every_dual": True} | FLUID | options
    return leak_rate(film, method=method, rtol=rtol, **options)


def encloses(flow, low: float, high: float | None = None) -> bool:
    """Whether every level's bracket meets [low, high]."""
    high = low if high is None else high
    return all(level.lower <= high and low <= level.upper for level in flow.levels)


def orders(errors: list[float]) -> np.ndarray:
    """Observed order of convergence between meshes, each twice as fine as the one before."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


# --- one dimension ---------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_uniform_gap_is_exact_on_the_first_mesh(method, sides, representation):
    """Q = Ly g³ Δp / (12 η Lx) in SI units, pixels three times as long as wide."""
    gap = GridField(np.full((40, 36), 2e-6), (3e-6, 1e-6), periodic=True)
    flow = leak_rate(
        GridFilm(gap, sides=sides, representation=representation),
        viscosity=1e-3,
        pressure_drop=1e5,
        method=method,
        rtol=1e-10,
    )
    exact = (36e-6 / 120e-6) * (2e-6) ** 3 / (12 * 1e-3) * 1e5
    assert [flow.lower, flow.upper] == pytest.approx([exact, exact], rel=ROUNDING)
    assert [flow.inflow, flow.outflow, flow.value] == pytest.approx([exact] * 3, rel=ROUNDING)
    assert flow.state == "leaking"
    assert flow.converged
    assert len(flow.levels) == 1
    assert encloses(flow, exact)


def series(gap: GridField) -> float:
    """Closed form for a P1 gap g(x)."""
    return gap.size[1] / gap.size[0] * piecewise_linear_channel(gap.values[:, 0])


def parallel(gap: GridField) -> float:
    """Closed form for a P1 gap g(y): Σ dy (a³+a²b+ab²+b³)/4 / Lx."""
    a, b = gap.values[0, :-1], gap.values[0, 1:]
    return gap.spacing[1] * ((a**4 - b**4) / (a - b) / 4).sum() / gap.size[0]


def profile(n: int) -> np.ndarray:
    return 0.5 + np.random.default_rng(3).random(n)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sides", SIDES)
def test_series_channel(method, sides):
    """g(x): the stream function of the P1 gap is y, so the lower bound is exact at once; the
    upper one converges at second order on uniform meshes."""
    gap = GridField(np.repeat(profile(9)[:, None], 5, axis=1), (1 / 8, 1 / 10))
    flow, exact = solve(GridFilm(gap, sides=sides), 2500, 1e-3, method), series(gap)
    assert encloses(flow, exact)
    assert flow.levels[0].lower == pytest.approx(exact, rel=ROUNDING)
    if method == "uniform":
        assert min(orders([level.upper - exact for level in flow.levels])[1:]) > 1.9


@pytest.mark.parametrize("method", METHODS)
def test_parallel_channel(method):
    """g(y): the pressure is linear, so the upper bound is exact; the lower one is second order."""
    gap = GridField(np.repeat(profile(9)[None, :], 5, axis=0), (1 / 8, 1 / 10))
    flow, exact = solve(GridFilm(gap), 2500, 1e-3, method), parallel(gap)
    assert encloses(flow, exact)
    assert flow.levels[0].upper == pytest.approx(exact, rel=ROUNDING)
    if method == "uniform":
        assert min(orders([exact - level.lower for level in flow.levels])[1:]) > 1.9


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("aspect", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("across", [False, True])
def test_wedge_that_touches(method, aspect, across):
    """A channel whose gap falls to contact at its side, or in its middle: the pressure is linear,
    so the upper bound is exact, while the lower one rests on power traces alone at the contact.
    Pixels five times as long as wide, and the reverse."""
    profile = np.array([0.0, 0.4, 1.0, 0.7, 0.9] if not across else [0.8, 0.3, 0.0, 0.2, 1.0])
    gap = GridField(np.repeat(profile[None, :], 5, axis=0), (aspect, 1.0))
    flow, exact = solve(GridFilm(gap), 1200, 0.06, method), parallel(gap)
    assert encloses(flow, exact)
    assert flow.levels[0].upper == pytest.approx(exact, rel=4e-8)
    assert flow.converged


@pytest.mark.parametrize("sides", SIDES)
def test_cosine_channel(sides):
    """Mean of g^-3 of g = 1 + a cos kx: (1 + a²/2)/(1 - a²)^{5/2} (Sommerfeld); order 2 in the
    pixel size for each bound on the pixel mesh, because the P1 gap differs from g by O(h²)."""
    a = 0.6
    exact = (1 - a * a) ** 2.5 / (1 + a * a / 2)
    errors = []
    for n in (16, 32, 64, 128):
        gap = vertex_gap(lambda x, y: 1 + a * np.cos(2 * np.pi * x), (n, 4), (1.0, 1.0))
        flow = solve(GridFilm(gap, sides=sides), 1)
        errors.append([abs(flow.lower - exact), abs(flow.upper - exact)])
    assert np.array([orders(e)[-1] for e in np.transpose(errors)]) == pytest.approx(2, abs=0.1)


def test_both_bounds_meet_at_second_order():
    """A smooth gap of x and y: the bracket narrows as the square of the mesh size."""
    gap = vertex_gap(lambda x, y: 1 + 0.4 * np.sin(3 * x + 1) * np.cos(2 * y), (8, 8))
    flow = solve(GridFilm(gap), 4500, 1e-5)
    assert min(orders([level.half_width for level in flow.levels])[1:]) > 1.9


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("method", METHODS)
def test_separable_pixels_are_exact_on_the_first_mesh(sides, method):
    """K = f(x) h(y) on pixels: Q = Σ h dy / Σ dx/f; pressure and stream function are piecewise
    linear in x and in y alone. Contrast 1e8."""
    rng = np.random.default_rng(5)
    f, h = 10 ** rng.uniform(-4, 0, 7), 10 ** rng.uniform(-4, 0, 6)
    gap = GridField(np.cbrt(np.outer(f, h)), (0.5, 0.3))
    exact = 0.3 * h.sum() / (0.5 / f).sum()
    flow = solve(
        GridFilm(gap, representation="constant", sides=sides),
        1000,
        1e-6,
        method,
    )
    # CG error 2e-8; 1e-8 more for the correction, whose first order vanishes at the minimum.
    assert [flow.lower, flow.upper] == pytest.approx([exact] * 2, rel=4e-8)
    assert len(flow.levels) == 1
    assert encloses(flow, exact)


# --- duality ---------------------------------------------------------------------------------


# --- smooth checkerboard -----------------------------------------------------------------------


def cosines(A: float):
    """g with g³ = exp(A cos 2πx cos 2πy).

    K(x + ½, y) = 1/K and K(x, y) = K(y, x): by duality the effective conductivity is 1 for any A.
    x = 0, ½, 1 and y = 0, ½, 1 are mirrors, so that pressure given on x = 0, 1 and walls or
    periodic sides on y = 0, 1 change nothing; nor does taking a quarter of the cell.
    """
    return lambda x, y: np.exp(A / 3 * np.cos(2 * np.pi * x) * np.cos(2 * np.pi * y))


@pytest.mark.parametrize("contrast", [1e2, 1e10])
@pytest.mark.parametrize(("sides", "size"), [("wall", 1.0), ("periodic", 1.0), ("wall", 0.5)])
def test_smooth_checkerboard_on_pixels(contrast, sides, size):
    """Samples at pixel centres keep every symmetry: Q = 1 exactly for the pixels as they are.

    A quarter of the cell has no period."""
    gap = pixel_gap(cosines(np.log(contrast) / 2), (16, 16), (size, size))
    uniform = solve(GridFilm(gap, representation="constant", sides=sides), 5000, tuning=TIGHT)
    adaptive = solve(
        GridFilm(gap, representation="constant", sides=sides),
        5000,
        0.02,
        "adaptive",
    )
    assert encloses(uniform, 1.0)
    assert encloses(adaptive, 1.0)
    assert adaptive.upper - adaptive.lower < 0.1
    # The mesh is its own image under the shift and the transposition: lower · upper = 1.
    if size == 1.0:
        products = [level.lower * level.upper for level in uniform.levels]
        assert products == pytest.approx([1] * len(products), rel=DUALITY)


def interpolation_error(A: float, h: float) -> float:
    """Bound of the relative error of the P1 interpolant of exp(A/3 cos 2πx cos 2πy).

    |g - Ig| ≤ R²/2 max|g''| on a triangle, R = h/√2 the radius of its circumcircle (Waldron,
    SIAM J. Numer. Anal. 35, 1191 (1998)); |g''|/g ≤ (A 2π/3)² + A 4π²/3 at any one point, and g
    itself varies by exp(A 2π/3 · √2 h) at most within the triangle.
    """
    curvature = (2 * np.pi * A / 3) ** 2 + 4 * np.pi**2 * A / 3
    return h * h / 4 * curvature * np.exp(2 * np.pi * A / 3 * np.sqrt(2) * h)


@pytest.mark.parametrize(
    ("contrast", "n", "sides"), [(1e2, 32, "wall"), (1e2, 32, "periodic"), (1e6, 64, "wall")]
)
def test_smooth_checkerboard_interpolated(contrast, n, sides):
    """P1 gap: 1, within what the interpolant may change K by; Q is monotone in the gap."""
    A = np.log(contrast) / 2
    gap = vertex_gap(cosines(A), (n, n))
    flow = solve(GridFilm(gap, sides=sides), 20000, 0.05, "adaptive")
    error = interpolation_error(A, 1 / n)
    assert error < 0.06
    assert encloses(flow, (1 - error) ** 3, (1 + error) ** 3)
    assert flow.converged


# --- checkerboards -----------------------------------------------------------------------------


TWO_PHASES = [(1, 1 / ratio, 1, 1 / ratio) for ratio in (2.0, 1e3, 1e12)]
FOUR_PHASES = [(1, 1.5, 2, 1.2), (1, 5, 0.2, 3), (1, 1, 4, 4), (1, 4, 4, 1)]


@pytest.mark.parametrize("phases", TWO_PHASES + FOUR_PHASES)
@pytest.mark.parametrize("method", METHODS)
def test_four_phase_checkerboard(phases, method):
    """The square around one corner, 2 × 2 pixels, whose sides are mirrors; the last two are
    laminates. Of two phases it is √(K1 K2) (Keller, Dykhne): turned by a right angle the pixels are
    the inverse K times K1 K2, mesh included, so that on uniform meshes √(lower upper) is exact
    although each bound is far away."""
    k1, k2, k3, k4 = phases
    film = GridFilm(
        GridField(np.cbrt(np.array([[k1, k4], [k2, k3]])), (0.5, 0.5)), representation="constant"
    )
    exact = closed_forms.four_phase_checkerboard(*phases)[0]
    unknowns, rtol = (300, 0.01) if phases in TWO_PHASES else (1500, 5e-3)
    flow = solve(film, unknowns, rtol, method, tuning=TIGHT)
    assert encloses(flow, exact)
    if method == "uniform" and phases in TWO_PHASES:
        assert flow.value == pytest.approx(exact, rel=DUALITY)
    if method == "adaptive" and phases in FOUR_PHASES:
        assert flow.converged


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", SIDES)
def test_disc_array(representation, sides):
    """Round contacts in a gap of 1. The gap as represented is 1 outside the disc enlarged by the
    diagonal of a pixel and contact inside the disc diminished by it: monotone, so Q is between."""
    n, radius = 64, 0.35

    def gap(x, y):
        return np.where(np.hypot(x - 0.5, y - 0.5) < radius, 0.0, 1.0)

    make = vertex_gap if representation == "linear" else pixel_gap
    flow = solve(
        GridFilm(make(gap, (n, n)), sides=sides, representation=representation),
        6000,
        0.02,
        "adaptive",
    )
    blur = np.sqrt(2) / n if representation == "linear" else np.sqrt(0.5) / n
    assert encloses(flow, *(disc_array(np.pi * r**2) for r in (radius + blur, radius - blur)))
    assert flow.converged


def test_disc_array_in_the_limit_of_fine_pixels():
    """Whole pixels, area within O(1/n) of the disc: the bracket closes on the formula, order 1."""

    def gap(x, y):
        return np.where(np.hypot(x, y) < 0.3, 0.0, 1.0)  # a quarter of the cell

    errors = []
    for n in (16, 64):
        flow = solve(
            GridFilm(pixel_gap(gap, (n, n), (0.5, 0.5)), representation="constant"),
            4000,
            2e-3,
            "adaptive",
        )
        errors.append(abs(flow.value / disc_array(np.pi * 0.3**2) - 1))
    # The disc's radius is blurred by half a pixel diagonal; dQ/dr · r/Q is below 2 at r = 0.3.
    assert errors[0] < 2 * np.sqrt(0.5) / 32 / 0.3
    assert errors[1] < 2 * np.sqrt(0.5) / 128 / 0.3


# --- symmetries and scalings -------------------------------------------------------------------


# --- shapes and extremes -----------------------------------------------------------------------
