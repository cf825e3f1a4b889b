"""`Tuning` may change the cost of the bounds; none of its numbers may make them wrong."""

import numpy as np
import pytest
from gaps import assert_enclosed, bracketed, represented
from sample_gaps import rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.grid import GridField
from fem_seal.mesh.nested import uniform_mesh
from fem_seal.theory.closed_forms import piecewise_linear_channel
from fem_seal.verification.exact_cases import vertex_gap

SIDES = ["wall", "periodic"]
REPRESENTATIONS = ["linear", "constant"]
# Each side and each representation once.
BOTH = pytest.mark.parametrize(
    ("representation", "sides"), [("linear", "periodic"), ("constant", "wall")]
)


# --- squares of several pixels -------------------------------------------------------------------


def dotted(n: int, every: int) -> np.ndarray:
    """A gap of 1 with single contact points `every` pixels apart, on the corners of squares."""
    samples = np.ones((n + 1, n + 1))
    samples[::every, ::every] = 0
    return samples


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("every", [2, 4])
def test_contact_at_the_corners_of_squares_of_several_pixels(sides, every):
    """The gap is zero at all corners of the first mesh and open everywhere else: what a coarse
    cell has at its corners says nothing of its sides, so that no pressure may jump across them and
    no stream function be the same along them."""
    gap = GridField(dotted(16, every), (1.0, 1.0))
    fine = bracketed(GridFilm(gap, sides=sides), tuning=Tuning(coarsest=16))
    coarse = bracketed(GridFilm(gap, sides=sides), tuning=Tuning(coarsest=16 // every))
    assert coarse.levels[0].unknowns < fine.levels[0].unknowns
    assert_enclosed(coarse, fine.lower, fine.upper)


# --- cut, floor, ceiling -------------------------------------------------------------------------


def ditch(low: float) -> GridField:
    """A gap of 1 with lines of `low` along and across the flow, one sample wide, as in contact."""
    samples = np.ones((13, 13))
    samples[2:11, 4] = samples[2:11, 9] = samples[6, 4:7] = low
    return GridField(samples, (1.0, 1.0))


@BOTH
@pytest.mark.parametrize("low", [0.3, 0.1])
def test_the_cut_is_the_dual_s_and_the_floor_the_primal_s(representation, sides, low):
    """Gaps below the cut are contact to the stream function alone: the pressure is as continuous
    across them as before, and the upper bound the same. Nor does the floor change the lower one.
    Same systems, solved to 1e-12; the correction sees the root of what CG left."""
    film = GridFilm(ditch(low), sides, representation)
    plain = Tuning(cut=0.0, floor=0.0, tolerance=1e-12)
    clipped = Tuning(cut=2 * low, floor=0.0, tolerance=1e-12)
    raised = Tuning(cut=0.0, floor=2 * low, tolerance=1e-12)
    exact, cut, floor = (
        bracketed(film, unknowns=1, method="uniform", tuning=tuning)
        for tuning in (plain, clipped, raised)
    )
    assert cut.upper == pytest.approx(exact.upper, rel=3e-6, abs=0)
    assert floor.lower == pytest.approx(exact.lower, rel=3e-6, abs=0)
    # Both do act where they should. (A steep line may gain more by power traces than by its gap.)
    assert cut.lower != pytest.approx(exact.lower, rel=1e-5, abs=0)
    assert floor.upper > exact.upper * (1 + 1e-5)


@BOTH
@pytest.mark.parametrize("ceiling", [0.3, 1.1, 3.0])
def test_a_low_ceiling_only_widens_the_bracket(representation, sides, ceiling):
    """With a ceiling at the constriction itself most cells are taken to be of one pressure, some of
    them from inlet to outlet: in a gap of 1 all, and still the leak rate is enclosed."""
    even = GridFilm(GridField(np.ones((6, 6)), (1.0, 1.0), periodic=True), sides, representation)
    assert_enclosed(bracketed(even, tuning=Tuning(ceiling=ceiling)), 1.0)
    film = GridFilm(rough_gap((16, 16), 0.2, 5), sides, representation)
    wide, tight = bracketed(film, tuning=Tuning(ceiling=ceiling)), bracketed(film)
    assert_enclosed(wide, tight.lower, tight.upper)


@pytest.mark.parametrize("ceiling", [0.1, 0.5, 2.0])
def test_no_open_cell_resists_less_than_the_ceiling(ceiling):
    """Beside contact as well, where the resistivity is that of a power trace: what is next to
    nothing there spoils the contrast that double precision can solve."""
    gap = represented(rough_gap((16, 16), 0.3, 5), ceiling=ceiling)
    mesh = uniform_mesh(gap.squares, 1, False)
    data = gap.cell_data(mesh, gap.vertex_values(mesh))
    beside = data.contact_vertex.any(axis=1) & ~data.blocked
    assert np.count_nonzero(beside) > 50
    xx, xy, yy = data.resistivity[~data.blocked].T
    least = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)  # the smaller eigenvalue
    assert least.min() >= ceiling**-3 * (1 - 1e-12)


@pytest.mark.parametrize("method", ["uniform", "adaptive"])
@pytest.mark.parametrize(("coarsest", "ceiling"), [(1, 5.0), (4, 7.0)])
def test_bubbles_do_not_gain_by_the_ceiling(method, coarsest, ceiling):
    """g(x): the stream function is y, and without a ceiling the lower bound is exact on every mesh.
    A cell may be below the ceiling while some of its quarters are above it: were their resistivity
    raised, bubbles would seem to lower an energy that is the least there is."""
    gap = vertex_gap(lambda x, y: np.exp(1.2 * np.cos(6 * np.pi * x)) + 0 * y, (32, 32))
    tuning = Tuning(coarsest=coarsest, ceiling=ceiling)
    flow = bracketed(GridFilm(gap), unknowns=2500, method=method, tuning=tuning)
    # Of a linear gap g(x) over a square.
    assert_enclosed(flow, piecewise_linear_channel(gap.values[:, 0]))


# --- tolerance -----------------------------------------------------------------------------------


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("method", ["uniform", "adaptive"])
def test_bounds_improve_even_if_nothing_is_solved(representation, method):
    """With a tolerance of 10 CG stops before it begins, and a mesh may do no better than the
    bubbles on the one before it: what was proved there holds, and is reported still."""
    film = GridFilm(rough_gap((16, 16), 0.2, 6), representation=representation)
    lazy = Tuning(tolerance=10.0, coarsest=4)
    flow = bracketed(film, unknowns=2000, method=method, tuning=lazy)
    lower, upper = np.transpose([[level.lower, level.upper] for level in flow.levels])
    assert (np.diff(lower) >= 0).all()
    assert (np.diff(upper) <= 0).all()
    solved = bracketed(film)
    assert_enclosed(flow, solved.lower, solved.upper)
