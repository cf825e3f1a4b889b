"""Leak rates known exactly: every level of every method must enclose them.

Two finite tolerances occur. Bounds are widened by 1e-12 against rounding. CG stops when its
estimate of the relative energy error, right within a factor of two, is `tolerance` (1e-8 unless
stated). Enclosure must hold for any value of the latter, and is tested without any tolerance.
"""

import numpy as np
import pytest
from gaps import level_problem, plain_bounds, represented
from sample_gaps import FLUID, rough_gap, striped_gap

from fem_seal.film import GridFilm
from fem_seal.flow import Limits, Tuning, leak_rate
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

TIGHT = Tuning(tolerance=1e-12)
# Energies err by 2e-12. Sharpening subtracts δ, the squared norm of a projection: an error e of
# the solution changes it by 2 √(δ E(e)) at most, relative 2 √(0.3 · 2e-12), and two bounds meet.
DUALITY = 4 * np.sqrt(0.3 * 2e-12)


def constant(gap, spacing) -> GridFilm:
    """Square pixels of constant gap between side walls."""
    return GridFilm(GridField(gap, (spacing, spacing)), representation="constant")


@pytest.mark.parametrize("deviation", [1.0, 4.0])
@pytest.mark.parametrize("seed", range(3))
def test_keller_duality_of_the_discrete_problems(deviation, seed):
    """Q_x[K] Q_y[1/K] = 1 on a square with side walls, for any K (Keller 1964; Dykhne 1971).

    Transposed meshes of the family coincide, so the dual problem of a log-normal K is the primal
    problem of 1/K turned by a right angle: lower · upper = 1 to the solver tolerance.
    """
    log_K = deviation * np.random.default_rng(seed).normal(size=(10, 10))
    flow = solve(constant(np.exp(log_K / 3), 0.1), 2000, 1e-9, tuning=TIGHT)
    dual = solve(constant(np.exp(-log_K / 3).T, 0.1), 2000, 1e-9, tuning=TIGHT)
    assert len(flow.levels) == 3
    for one, other in zip(flow.levels, dual.levels, strict=True):
        assert one.lower * other.upper == pytest.approx(1, rel=DUALITY)
        assert one.upper * other.lower == pytest.approx(1, rel=DUALITY)


@pytest.mark.parametrize("deviation", [1.0, 4.0])
def test_keller_duality_of_adaptive_brackets(deviation):
    log_K = deviation * np.random.default_rng(7).normal(size=(16, 16))
    options = {"method": "adaptive", "unknowns": 1500}
    flow = solve(constant(np.exp(log_K / 3), 1.0), **options)
    dual = solve(constant(np.exp(-log_K / 3).T, 1.0), **options)
    for one in flow.levels:
        for other in dual.levels:
            assert one.lower * other.lower <= 1 <= one.upper * other.upper


def test_lognormal_mean():
    """Log-normal K whose law is that of 1/K: exp<ln K> = 1 is the median of Q (Matheron 1967).

    By duality Q_x[K] Q_y[1/K] = 1, so over pairs (K, 1/K turned) ln Q averages to zero exactly:
    the brackets' logarithmic means must enclose it.
    """
    sums = np.zeros(2)
    for seed in range(4):
        log_K = 2 * np.random.default_rng(100 + seed).normal(size=(8, 8))
        for field in (log_K, -log_K.T):
            gap = GridField(np.exp(field / 3), (1.0, 1.0))
            flow = solve(GridFilm(gap, representation="constant"), 400, 0.02, "adaptive")
            sums += np.log([flow.lower, flow.upper])
    assert sums[0] <= 0 <= sums[1]
    assert sums[1] - sums[0] < 8 * 0.5


# --- smooth checkerboard -----------------------------------------------------------------------


def cosines(A: float):
    """g with g³ = exp(A cos 2πx cos 2πy).

    K(x + ½, y) = 1/K and K(x, y) = K(y, x): by duality the effective conductivity is 1 for any A.
    x = 0, ½, 1 and y = 0, ½, 1 are mirrors, so that pressure given on x = 0, 1 and walls or
    periodic sides on y = 0, 1 change nothing; nor does taking a quarter of the cell.
    """
    return lambda x, y: np.exp(A / 3 * np.cos(2 * np.pi * x) * np.cos(2 * np.pi * y))


@pytest.mark.parametrize("contrast", [1e2, 1e6, 1e10])
@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("size", [1.0, 0.5])
def test_smooth_checkerboard_on_pixels(contrast, sides, size):
    """Samples at pixel centres keep every symmetry: Q = 1 exactly for the pixels as they are."""
    if size == 0.5 and sides == "periodic":
        sides = "wall"  # a quarter of the cell has no period
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


@pytest.mark.parametrize(("contrast", "n"), [(1e2, 32), (1e6, 64), (1e10, 128)])
@pytest.mark.parametrize("sides", SIDES)
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


@pytest.mark.parametrize("ratio", [2.0, 10.0, 1e3, 1e6, 1e12])
@pytest.mark.parametrize("method", METHODS)
def test_two_phase_checkerboard(ratio, method):
    """√(K1 K2) (Keller, Dykhne), here for the square around one corner, whose sides are mirrors.

    The 2 × 2 pixels turned by a right angle are the inverse K times K1 K2, mesh included, so
    that on uniform meshes √(lower upper) is exact although each bound is far away.
    """
    K = np.array([[1, 1 / ratio], [1 / ratio, 1]])
    gap = GridField(np.cbrt(K), (0.5, 0.5))
    exact = ratio**-0.5
    flow = solve(GridFilm(gap, representation="constant"), 300, 0.01, method, tuning=TIGHT)
    assert encloses(flow, exact)
    if method == "uniform":
        assert flow.value == pytest.approx(exact, rel=DUALITY)
    if ratio == 2:
        assert flow.converged


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("method", METHODS)
def test_checkerboard_cell(sides, method):
    """The whole period, cut through the middle of the fields: walls and period are the same."""
    i, j = np.indices((8, 8))
    dark = ((i + 1) // 2 + (j + 1) // 2) % 2 == 1
    gap = GridField(np.where(dark, np.cbrt(0.1), 1.0), (1.0, 1.0))
    flow = solve(
        GridFilm(gap, representation="constant", sides=sides),
        800,
        0.05,
        method,
    )
    assert encloses(flow, np.sqrt(0.1))


@pytest.mark.parametrize("phases", [(1, 1.5, 2, 1.2), (1, 5, 0.2, 3), (1, 1, 4, 4), (1, 4, 4, 1)])
@pytest.mark.parametrize("method", METHODS)
def test_four_phase_checkerboard(phases, method):
    """The square around one corner, 2 × 2 pixels; the last two are laminates."""
    k1, k2, k3, k4 = phases
    gap = GridField(np.cbrt(np.array([[k1, k4], [k2, k3]])), (0.5, 0.5))
    flow = solve(GridFilm(gap, representation="constant"), 1500, 5e-3, method)
    assert encloses(flow, closed_forms.four_phase_checkerboard(*phases)[0])
    if method == "adaptive":
        assert flow.converged


@pytest.mark.parametrize("radius", [0.2, 0.35])
@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", SIDES)
def test_disc_array(radius, representation, sides):
    """Round contacts in a gap of 1. The gap as represented is 1 outside the disc enlarged by the
    diagonal of a pixel and contact inside the disc diminished by it: monotone, so Q is between."""
    n = 64

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


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("axis", [0, 1])
def test_mirrors(representation, sides, axis):
    """Grids with even numbers of pixels are mirror images of themselves: the same bounds, to the
    solver tolerance. Turning the flow round (axis 0) changes nothing either."""
    samples = rough_gap((12, 10), 0.3, 4)
    values = samples.vertices() if representation == "linear" else samples.values
    gap, mirrored = (GridField(v, (1.0, 1.0)) for v in (values, np.flip(values, axis)))
    films = [GridFilm(g, sides, representation) for g in (gap, mirrored)]
    one, other = (solve(film, 600, 1e-9, tuning=TIGHT) for film in films)
    for level, image in zip(one.levels, other.levels, strict=True):
        assert [level.lower, level.upper] == pytest.approx([image.lower, image.upper], rel=DUALITY)
    adaptive = [solve(film, 2000, 0.05, "adaptive") for film in films]
    assert encloses(adaptive[0], adaptive[1].lower, adaptive[1].upper)


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_shift_along_periodic_sides(sides, representation):
    """Shifting the gap along periodic sides (by two pixels, for the diagonals' sake) changes
    nothing; with walls it does."""
    gap = rough_gap((12, 12), 0.35, 11)
    shifted = GridField(np.roll(gap.values, 2, axis=1), gap.spacing, periodic=True)
    films = [GridFilm(g, sides, representation) for g in (gap, shifted)]
    one, other = (solve(film, 600, 1e-9, tuning=TIGHT) for film in films)
    same = one.upper == pytest.approx(other.upper, rel=DUALITY)
    assert same == (sides == "periodic")
    if same:
        assert one.lower == pytest.approx(other.lower, rel=DUALITY)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("power", [-12, -6, 6])
def test_unit_neutrality(method, power):
    """Gap, lengths, viscosity and pressure in other units, powers of ten apart: the same meshes,
    and bounds that scale as Δp g³ / η to rounding. Nothing is compared with an absolute number.

    Rounding of the units changes the input by 1e-16 and CG's iterates by about 1e-16 times the
    contrast of what is left of it (floor and cut bound it): 1e-10 leaves room.
    """
    gap, unit = rough_gap((16, 16), 0.3, 2), 10.0**power
    options = {"method": method, "rtol": 0.1, "limits": Limits(unknowns=3000)}
    reference = leak_rate(GridFilm(gap), **FLUID, **options)
    other = leak_rate(
        GridFilm(GridField(gap.values * unit, (unit, unit), periodic=True)),
        viscosity=1 / 12 / unit**2,
        pressure_drop=unit**0.5,
        **options,
    )
    scale = unit**3 * unit**2 * unit**0.5
    assert [level.unknowns for level in other.levels] == [
        level.unknowns for level in reference.levels
    ]
    for name in ("lower", "upper", "value", "inflow", "outflow"):
        assert getattr(other, name) == pytest.approx(scale * getattr(reference, name), rel=1e-10)


@pytest.mark.parametrize("factor", [2.0, 1 / 64])
def test_cube_of_the_gap(factor):
    """g → s g gives s³.

    Powers of two lose no digit, but two solves of one problem may differ in the
    last digits of their sums, whose order depends on how the arrays lie in memory."""
    gap = rough_gap((16, 16), 0.3, 2)
    scaled = GridField(factor * gap.values, gap.spacing, periodic=True)
    one, other = (solve(GridFilm(g), 3000, 0.1, "adaptive") for g in (gap, scaled))
    expected = [factor**3 * one.lower, factor**3 * one.upper]
    assert [other.lower, other.upper] == pytest.approx(expected, rel=1e-12, abs=0)


@pytest.mark.parametrize("aspect", [0.01, 100.0])
def test_slender_pixels(aspect):
    """Pixels a hundred times longer than wide, or the reverse: the closed form of a series of
    channels stays enclosed and the lower bound exact."""
    gap = GridField(np.repeat(profile(9)[:, None], 9, axis=1), (aspect, 1.0))
    flow, exact = solve(GridFilm(gap), 3000, 0.05), series(gap)
    assert encloses(flow, exact)
    assert flow.levels[0].lower == pytest.approx(exact, rel=ROUNDING)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("seed", range(4))
def test_monotone_in_the_gap(representation, sides, seed):
    """More contact, or a lower gap anywhere, never lets more through."""
    rng = np.random.default_rng(seed)
    gap = rough_gap((10, 10), 0.2, seed)
    less = gap.values * np.where(rng.random((10, 10)) < 0.1, 0.0, 1.0)
    less *= np.where(rng.random((10, 10)) < 0.3, 0.7, 1.0)
    narrower = GridField(less, gap.spacing, periodic=True)
    wide, narrow = (
        solve(GridFilm(g, sides, representation), 600, 0.05, "adaptive") for g in (gap, narrower)
    )
    assert narrow.lower <= wide.upper


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("seed", range(3))
def test_walls_let_less_through_than_periodic_sides(seed, representation):
    """Periodic pressures are among those admitted between walls, and fluxes between walls among
    the periodic ones: on one mesh either bound of the walls is the lower. CG errs by 2e-8."""
    gap = represented(rough_gap((10, 10), 0.3, seed), representation)
    wall, periodic = (plain_bounds(level_problem(gap, periodic_sides=p)) for p in (False, True))
    assert (wall <= periodic * (1 + 4e-8)).all()


# --- shapes and extremes -----------------------------------------------------------------------


def test_sealed_without_a_solve():
    """A barrier across: exactly zero, no mesh."""
    values = np.ones((6, 5))
    values[3] = 0
    for representation in ("linear", "constant"):
        for sides in SIDES:
            gap = GridField(values, (1.0, 1.0), periodic=sides == "periodic")
            flow = leak_rate(GridFilm(gap, sides=sides, representation=representation), **FLUID)
            assert (flow.state, flow.value, flow.lower, flow.upper) == ("sealed", 0.0, 0.0, 0.0)
            assert flow.converged
            assert flow.levels == ()


@pytest.mark.parametrize("values", [np.zeros((5, 5)), np.zeros((1, 1)), np.zeros((1, 7))])
def test_all_contact(values):
    flow = leak_rate(GridFilm(GridField(values, (1.0, 1.0)), representation="constant"), **FLUID)
    assert (flow.state, flow.upper) == ("sealed", 0.0)


@pytest.mark.parametrize("shape", [(1, 9), (9, 1), (2, 2), (3, 3), (7, 5), (4, 11), (2, 13)])
@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("method", METHODS)
def test_shapes(shape, sides, method):
    """Small, odd and long grids of pixels: between the laminates' bounds, parallel and in series.

    Rows joined in series let less through than the medium, by Thomson's principle with a flux
    kept within each row of pixels; equal pressure in each column lets more through.
    """
    K = np.random.default_rng(sum(shape)).uniform(0.1, 1, shape)
    gap = GridField(np.cbrt(K), (1.0, 1.0))
    flow = solve(
        GridFilm(gap, sides=sides, representation="constant"),
        2000,
        0.03,
        method,
    )
    rows, columns = (1 / (1 / K).sum(axis=0)).sum(), 1 / (1 / K.sum(axis=1)).sum()
    assert encloses(flow, rows, columns)
    assert flow.converged
    if 1 in shape:  # the only error is that of CG
        assert [flow.lower, flow.upper] == pytest.approx([rows, columns], rel=4e-8)


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (9, 2), (3, 3), (4, 8)])
@pytest.mark.parametrize("periodic", [False, True])
def test_shapes_of_linear_gaps(shape, periodic):
    """The same for vertex samples: the P1 gap lies between its smallest and largest value."""
    values = np.random.default_rng(sum(shape)).uniform(0.5, 1, shape)
    gap = GridField(values, (1.0, 1.0), periodic)
    flow = solve(GridFilm(gap, sides="periodic" if periodic else "wall"), 2000, 0.03, "adaptive")
    ratio = gap.size[1] / gap.size[0]
    assert encloses(flow, ratio * values.min() ** 3, ratio * values.max() ** 3)
    assert flow.converged


CHANNELS = np.arange(8) % 4 < 2  # of conductivity 1; the others 1/contrast


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("contrast", [1e15, 1e30, 1e60])
def test_extreme_contrast_in_parallel(sides, contrast):
    """Channels of conductivity 1 and 1/contrast side by side."""
    gap = striped_gap(np.where(CHANNELS, 1.0, 1 / contrast), 6, along=True)
    flow = solve(
        GridFilm(gap, representation="constant", sides=sides),
        200,
        0.1,
        "adaptive",
    )
    assert encloses(flow, 4 * (1 + 1 / contrast) / 6)
    assert flow.converged


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("contrast", [1e6, 1e12, 1e15, 1e30, 1e60])
def test_high_contrast_in_series(sides, contrast):
    """The same across the flow: the pressure drop in the wide part gets below rounding."""
    gap = striped_gap(np.where(CHANNELS, 1.0, 1 / contrast), 6, along=False)
    flow = solve(
        GridFilm(gap, representation="constant", sides=sides),
        200,
        0.1,
        "adaptive",
    )
    assert encloses(flow, 6 / (4 * (1 + contrast)))
    assert flow.converged
