"""Fluids, gaps and contrasts at the ends of what can be asked for."""

from functools import cache

import numpy as np
import pytest
from closed_forms import SERIES_DECADES, Case
from extreme_gaps import MOST_UNKNOWNS, ROUNDING, adaptive
from gaps import assert_enclosed
from nonlinear import in_series
from project import leak_rate
from sample_gaps import FLUID, rough_gap, striped_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.rarefied import LAWS
from fem_seal.verification.exact_cases import block_film

PART = "Flow"
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def power_of_ten(number):
    return f"1e{np.log10(number):.0f}"


# --- units ---------------------------------------------------------------------------------------

ROUGH = rough_gap((16, 16), 0.3, 4)


@pytest.fixture(scope="module")
def rough_leak():
    """Bounds of ROUGH at K = g³, Δp = 1."""
    return adaptive(GridFilm(ROUGH))


def assert_proportional(leak, reference, factor):
    """Both bounds are `factor` times those of the reference."""
    assert (leak.lower, leak.upper) == pytest.approx(
        (factor * reference.lower, factor * reference.upper), rel=ROUNDING, abs=0
    )


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6, 1e-9, 1e-12], ids=power_of_ten)
def test_gap_sizes(size, rough_leak, show):
    """Gaps from 1e-12 m to 1 m, all else equal."""
    leak = adaptive(GridFilm(GridField(ROUGH.values * size, (1e-6, 1e-6), periodic=True)))
    assert_proportional(leak, rough_leak, size**3)
    show("right", f"bounds in proportion to g³ within {ROUNDING:g}")


@pytest.mark.parametrize("viscosity", [1e-10, 1e-5, 1.0, 1e5, 1e10], ids=power_of_ten)
def test_viscosities(viscosity, rough_leak, show):
    """Viscosities from 1e-10 to 1e10 Pa s."""
    assert_proportional(
        adaptive(GridFilm(ROUGH), viscosity=viscosity), rough_leak, 1 / (12 * viscosity)
    )
    show("right", f"bounds in proportion to 1/η within {ROUNDING:g}")


@pytest.mark.parametrize("drop", [1e-10, 1e-5, 1.0, 1e5, 1e10], ids=power_of_ten)
def test_pressure_drops(drop, rough_leak, show):
    """Pressure drops from 1e-10 to 1e10 Pa."""
    assert_proportional(adaptive(GridFilm(ROUGH), pressure_drop=drop), rough_leak, drop)
    show("right", f"bounds in proportion to Δp within {ROUNDING:g}")


@pytest.mark.parametrize(
    "solver", [leak_rate, by_differences], ids=["finite elements", "differences"]
)
@pytest.mark.parametrize("size", [1e-310, 1e-120, 1e-70, 1e70, 1e120], ids=power_of_ten)
def test_gaps_beyond_double_precision(size, solver, show):
    """Gaps whose cube no number can hold, from 1e-310 m (denormal) to 1e120 m."""
    gap = GridField(np.full((4, 4), size), (1.0, 1.0))
    with pytest.raises(InvalidInput, match="beyond double precision; check the units") as error:
        solver(GridFilm(gap, sides="wall"), viscosity=1e-3, pressure_drop=1e5)
    show("refused", str(error.value))


# --- gases ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["first-order", "kinetic"])
@pytest.mark.parametrize("p_out", [0.0, 0.999], ids=["into vacuum", "p_out near p_in"])
@pytest.mark.parametrize("knudsen", [1e-6, 1e-3, 1.0, 1e3, 1e6], ids=lambda kn: f"Kn {kn:g}")
def test_knudsen_numbers(knudsen, p_out, law, show):
    """Knudsen numbers of the critical constriction from 1e-6 to 1e6, layers across the flow."""
    gap = striped_gap(np.where(WIDE, 1.0, 0.3**3), 8, along=False)
    mean = (1 + p_out) / 2
    slip = Slip(1.0, p_out, 6 * knudsen * 0.3 * mean, LAWS[law](1.0))
    per = (1 - p_out) * mean
    film = GridFilm(gap, "wall", "constant")
    leak = leak_rate(film, viscosity=1 / 12, pressure_drop=per, slip=slip)
    exact = in_series(slip, (1.0, 0.3), (0.5, 0.5))
    assert leak.lower * (1 - ROUNDING) <= exact <= leak.upper * (1 + ROUNDING)
    assert leak.converged
    assert leak.upper / leak.lower < 1.1
    show("right", "the closed form lies inside the bounds, at most ±5 % wide")


# --- contrast ------------------------------------------------------------------------------------

WIDE = np.arange(8) % 4 < 2  # stripes of K = 1; the others have 1/contrast
CONTRASTS = (1e3, 1e6, 1e9, 1e12, 1e15, 1e30, 1e60, 1e120, 1e180, 1e300)
# Of 1e-60 of the largest gap: the cube of a narrower one is beyond double precision.
HIGHEST_CONTRAST = 1e180


@pytest.mark.parametrize("contrast", CONTRASTS, ids=power_of_ten)
def test_contrast_side_by_side(contrast, show):
    """Conductivity contrast of stripes along the flow."""
    gap = striped_gap(np.where(WIDE, 1.0, 1 / contrast), 8, along=True)
    leak = adaptive(GridFilm(gap, representation="constant"))
    assert_enclosed(leak, (1 + 1 / contrast) / 2)
    assert leak.converged
    show("right", "the mean conductivity lies inside the bounds")


@pytest.mark.parametrize("contrast", CONTRASTS, ids=power_of_ten)
def test_contrast_in_series(contrast, show):
    """Conductivity contrast of stripes across the flow."""
    gap = striped_gap(np.where(WIDE, 1.0, 1 / contrast), 8, along=False)
    if contrast > HIGHEST_CONTRAST:
        with pytest.raises(InvalidInput, match="critical constriction is 1e-100") as error:
            adaptive(GridFilm(gap, representation="constant"))
        show("refused", str(error.value))
        return
    leak = adaptive(GridFilm(gap, representation="constant"))
    assert_enclosed(leak, 2 / (1 + contrast))
    assert leak.converged
    show("right", "the mean resistance lies inside the bounds")


@pytest.mark.parametrize("decades", SERIES_DECADES, ids="{:g} decades".format)
@pytest.mark.parametrize("on", ["linear", "constant"])
def test_layers_of_random_height(on, decades, show):
    """Layers across the flow of random gaps over many decades.

    The pressure is constant but for a few of them: rounding hides what is left of the residuals,
    and CG breaks down. What it has reached is the pressure of an upper bound all the same. That of
    constant layers is linear between the vertices, so that the bounds meet. A linear gap that rises
    1e12 times from a sample to the next needs cells of 1e-12 pixels, which no mesh has.
    """
    heights = 10 ** (-decades * np.random.default_rng(4).random(24))
    case = Case("across", heights, 5, (1.0, 1.0), "wall", on, "adaptive")
    leak = case.solve(1500)
    assert not case.faults(leak)
    assert leak.converged or on == "linear"
    if leak.converged:
        show("right", "the mean resistance lies inside the bounds")
    else:
        show(
            "limited",
            "the mean resistance lies inside the bounds; 1500 unknowns do not reach 5 %, as the "
            "answer says",
        )


@pytest.mark.parametrize("aspect", [1e-6, 1e-3, 1e3, 1e6], ids="dx/dy {:g}".format)
@pytest.mark.parametrize("kind", ["along", "across"])
def test_slender_pixels(kind, aspect, show):
    """Slender pixels, stripes of contact along the flow or layers across it."""
    heights = np.random.default_rng(5).uniform(0.1, 1, 16)
    if kind == "along":
        heights[[0, 3, 4, 9]] = 0
    leaks = []
    for on in ("linear", "constant", "mesh"):
        case = Case(kind, heights, 6, (aspect, 1.0), "wall", on, "adaptive")
        leaks.append(case.solve(MOST_UNKNOWNS))
        assert not case.faults(leaks[-1])
    if all(leak.converged for leak in leaks):
        show("right", "the closed form lies inside the bounds")
    else:
        show(
            "limited",
            f"the closed form lies inside the bounds; {MOST_UNKNOWNS} unknowns do not reach 5 %, "
            "as the answer says",
        )


@pytest.mark.parametrize("contrast", [1e2, 1e6, 1e12, 1e30], ids=power_of_ten)
def test_checkerboard_contrast(contrast, show):
    """Conductivity contrast of a checkerboard, where all the flow passes corners.

    √(K1 K2), by duality (Keller 1964, Dykhne 1971). The pressure at the corner goes like r^a with
    a = (4/π) atan(contrast^-½): what lies within r keeps the part r^2a of the energy, so that a
    bracket of 5 % takes r ~ 0.05^(1/2a), which is 1e-5 at a contrast of 1e2.
    """
    film = block_film(np.array([[1, 1 / contrast], [1 / contrast, 1]]), 2)
    leak = adaptive(film, unknowns=3000)
    assert_enclosed(leak, contrast**-0.5)
    if leak.converged:
        show("right", "√(K1 K2) lies inside the bounds")
    else:
        show(
            "limited",
            "√(K1 K2) lies inside the bounds; 3000 unknowns do not reach 5 %, as the answer says",
        )


@pytest.mark.parametrize("contrast", [1e3, 1e15, 1e60, 1e120, 1e250, 1e300], ids=power_of_ten)
def test_finite_difference_contrast(contrast, show):
    """Finite differences: conductivity contrast of stripes across the flow."""
    gap = striped_gap(np.where(WIDE, 1.0, 1 / contrast), 8, along=False)
    leak = by_differences(
        GridFilm(gap, sides="wall", representation="constant"), links="harmonic", **FLUID
    )
    error = abs(leak.value * (1 + contrast) / 2 - 1)
    # A product of two conductivities of 1e-300 is no number: elimination then loses digits.
    assert error < (1e-3 if contrast > 1e290 else ROUNDING)
    if error < ROUNDING:
        show("right", "the mean resistance to rounding")
    else:
        show("limited", f"double precision runs out of exponents, which costs {error:.0e}")


# --- contact -------------------------------------------------------------------------------------


def test_no_contact(show):
    """No contact at all: a uniform gap."""
    leak = adaptive(GridFilm(GridField(np.full((9, 5), 2.0), (0.5, 0.5))))
    assert leak.converged
    assert leak.value == pytest.approx(2.0**3 / 2, rel=ROUNDING)
    show("right", "g³ Ly/Lx on the first mesh")


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("open_samples", [0, 1], ids=["everywhere", "all but one sample"])
def test_nearly_all_contact(open_samples, representation, show):
    """Contact everywhere, and everywhere but in one sample."""
    values = np.zeros((9, 9))
    values[4, 4] = open_samples
    leak = adaptive(GridFilm(GridField(values, (1.0, 1.0)), representation=representation))
    assert (leak.state, leak.value, leak.unknowns) == ("sealed", 0.0, 0)
    show("right", "sealed, without a solve")


@cache
def narrowed(part):
    """Leak rate of a rough contact whose critical constriction keeps this part of its gap."""
    gap = rough_gap((24, 24), 0.3, 1)
    width = GridFilm(gap, "periodic").constriction.gap
    values = np.maximum(0.0, gap.values - width)
    values[gap.values == width] = part * width
    return adaptive(GridFilm(GridField(values, gap.spacing, periodic=True), sides="periodic"))


def show_narrow(leak, wider, show):
    """The leak rate falls with the gap (Dirichlet's principle), and is not zero."""
    assert leak.state == "leaking"
    assert leak.upper > 0
    assert leak.lower <= wider.upper
    if leak.converged:
        show("right", "leaking, less than the wider one, to 5 %")
    else:
        show("limited", f"leaking; {MOST_UNKNOWNS} unknowns do not reach 5 %, as the answer says")


PARTS = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-12)


@pytest.mark.parametrize("number", range(1, len(PARTS)), ids=lambda number: f"{PARTS[number]:g}")
def test_percolation(number, show):
    """Just below percolation: the part of its gap that is left to the critical constriction."""
    show_narrow(narrowed(PARTS[number]), narrowed(PARTS[number - 1]), show)


def test_beyond_percolation(show):
    """Just beyond percolation: the critical constriction shut."""
    assert narrowed(0.0).state == "sealed"
    show("right", "sealed")


def test_one_pixel_channel(show):
    """A straight channel one pixel wide through contact, and one that turns twice.

    A corner of a channel counts 0.5590 of a square (conformal map, as in sheet resistance:
    F. W. Grover's corner square; four digits). Its bounds hold that rounded number to 1e-3.
    """
    channel = np.zeros((9, 9))
    channel[:, 4] = 0.3
    straight = adaptive(GridFilm(GridField(channel, (1.0, 1.0)), representation="constant"))
    assert_enclosed(straight, 0.3**3 / 9)
    assert straight.converged
    bent = np.zeros((9, 9))
    bent[:5, 2] = bent[4, 2:7] = bent[4:, 6] = 0.3
    leak = adaptive(GridFilm(GridField(bent, (1.0, 1.0)), representation="constant"))
    exact = 0.3**3 / (11 + 2 * 0.5590)
    assert leak.lower * 0.999 <= exact <= leak.upper * 1.001
    assert leak.converged
    show("right", "w g³/L, and 0.559 squares for each corner, inside the bounds")


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_one_pixel_wall(representation, show):
    """A wall of contact one sample thick."""
    values = np.ones((9, 9))
    values[4] = 0.0
    assert (
        adaptive(GridFilm(GridField(values, (1.0, 1.0)), representation=representation)).state
        == "sealed"
    )
    show("right", "sealed, without a solve")


@cache
def through_hole(hole):
    """Leak rate of a linear gap of 1 with a wall of contact, of which one sample is open."""
    values = np.ones((9, 9))
    values[4] = 0.0
    values[4, 3] = hole
    return adaptive(GridFilm(GridField(values, (1.0, 1.0))))


HOLES = (1.0, 0.3, 0.1, 0.03, 0.01, 1e-3)


@pytest.mark.parametrize("number", range(1, len(HOLES)), ids=lambda number: f"{HOLES[number]:g}")
def test_hole_in_a_wall(number, show):
    """The same wall with a hole of one sample, in parts of the gap around."""
    show_narrow(through_hole(HOLES[number]), through_hole(HOLES[number - 1]), show)


@pytest.mark.parametrize("parity", [0, 1], ids=["diagonal joins them", "diagonal parts them"])
@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_corner_contacts(representation, parity, show):
    """Open only through a corner: two open blocks that share one point.

    Pixel (i, j) of a linear gap has the rising diagonal if i + j is even, which joins the blocks in
    one of the two cases; pixels of constant gap share a point, through which nothing flows.
    """
    values = np.zeros((6, 6))
    values[:3, : 3 - parity] = values[3:, 3 - parity :] = 1.0
    leak = adaptive(GridFilm(GridField(values, (1.0, 1.0)), representation=representation))
    joined = representation == "linear" and parity == 0
    assert leak.state == ("leaking" if joined else "sealed")
    assert leak.converged
    show("right", "leaking, to 5 %" if joined else "sealed")


def test_pockets(show):
    """A thousand pockets of trapped fluid beside a channel."""
    values = np.zeros((128, 64))
    values[:, 40:] = rough_gap((128, 24), 0.0, 4).values + 0.1
    without = adaptive(GridFilm(GridField(values, (1.0, 1.0))), rtol=0.2)
    values[1:-1:2, 1:38:2] = 1.0
    pockets = adaptive(GridFilm(GridField(values, (1.0, 1.0))), rtol=0.2)
    assert pockets.unknowns == without.unknowns
    assert_proportional(pockets, without, 1.0)
    count = np.count_nonzero(values[:, :39])
    show("right", f"{count} pockets: same unknowns, same bounds; they are not solved")


# --- shapes of grids -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "spacing"),
    [((1000, 2), (1.0, 1.0)), ((2, 1000), (1.0, 1.0)), ((8, 8), (1000.0, 1.0))],
    ids=["1000 x 2 pixels", "2 x 1000 pixels", "pixels of 1000 x 1"],
)
def test_slender(shape, spacing, show):
    """Slender cells, of many pixels and of slender ones."""
    f = 1 + np.random.default_rng(2).random(shape[0])
    gap = GridField(np.repeat(f[:, None], shape[1], 1), spacing)
    leak = adaptive(GridFilm(gap, representation="constant"))
    assert leak.converged
    exact = gap.spacing[1] * shape[1] / np.sum(gap.spacing[0] / f**3)
    # Linear pressure in each layer: the root of CG's 1e-8 of the energy is spare.
    assert leak.value == pytest.approx(exact, rel=1e-6)
    show("right", "Ly / ∫dx/K on the first mesh")


@pytest.mark.parametrize(
    "shape", [(1, 7), (7, 1), (2, 2), (3, 3), (31, 37)], ids=lambda shape: "{} x {}".format(*shape)
)
def test_small_grids(shape, show):
    """Grids of few pixels, and of primes."""
    gap = GridField(0.5 + np.random.default_rng(3).random(shape), (1.0, 1.0))
    K = gap.values**3
    # More flows if layers across the flow lose no pressure within, less if nothing flows across
    # lanes along it.
    layers, lanes = 1 / np.sum(1 / K.sum(axis=1)), np.sum(1 / np.sum(1 / K, axis=0))
    for sides in ("wall", "periodic"):
        leak = adaptive(GridFilm(gap, sides=sides, representation="constant"), rtol=0.2)
        assert leak.converged
        assert leak.lower <= layers * (1 + ROUNDING)
        assert lanes <= leak.upper * (1 + ROUNDING)
        if 1 in shape:  # the only error is that of CG
            assert leak.bounds == pytest.approx((lanes, layers), rel=4e-8)
    show("right", "between layers in series and lanes side by side")


def test_a_linear_gap_of_one_row(show):
    """A linear gap of one row of samples."""
    with pytest.raises(InvalidInput, match="samples") as error:
        adaptive(GridFilm(GridField(np.ones((1, 7)), (1.0, 1.0))))
    show("refused", str(error.value))
