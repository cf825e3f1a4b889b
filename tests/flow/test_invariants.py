"""What holds for every gap: images, scales, order and duality, of bounds and finite differences.

The gaps are small and have all kinds of difficulties. Finite differences are a network of
conductances, to which Rayleigh's monotonicity law applies to rounding. Two brackets [l, u] and
[l', u'] of leak rates Q <= Q' obey l <= u' whatever the mesh.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from gaps import (
    DUALITY,
    TIGHT,
    channel,
    corners,
    level_problem,
    lines,
    meshed,
    plain_bounds,
    represented,
    rings,
    rows,
    scattered,
)
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from project import leak_rate
from sample_gaps import FLUID
from slow_reference import spans

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.finite_difference.links import LINKS
from fem_seal.flow import Limits
from fem_seal.flow.topology import dual_numbering, open_cells
from fem_seal.grid import GridField

ROUNDING = 1e-9  # of star-mesh elimination over contrasts up to 1e9
SEEDS = st.integers(0, 2**32 - 1)


STRUCTURES = [scattered, channel, lines, rings, rows, corners]


@dataclass(frozen=True)
class Case:
    """A gap, how it is read between its samples, what lies at its sides, and the mean along links
    of finite differences."""

    samples: np.ndarray
    representation: str
    sides: str
    spacing: tuple[float, float]
    link_rule: str = "harmonic"

    @property
    def field(self) -> GridField:
        return GridField(self.samples, self.spacing)

    @property
    def film(self) -> GridFilm:
        return GridFilm(self.field, sides=self.sides, representation=self.representation)

    def with_samples(self, samples: np.ndarray) -> "Case":
        """Other samples, of which the last column repeats the first where a linear gap must."""
        samples = samples.copy()
        if self.representation == "linear" and self.sides == "periodic":
            samples[:, -1] = samples[:, 0]
        return replace(self, samples=samples)

    def bounds(self, method="adaptive", **options):
        options = {"rtol": 0.1, "limits": Limits(unknowns=150), "every_dual": True} | options
        return leak_rate(self.film, method=method, **FLUID | options)

    def by_differences(self, **fluid) -> float:
        """Leak rate by finite differences."""
        return by_differences(self.film, link_rule=self.link_rule, **FLUID | fluid).value


@st.composite
def cases(draw) -> Case:
    """Open gaps spread over up to three decades."""
    representation = draw(st.sampled_from(["linear", "constant"]))
    smallest = 2 if representation == "linear" else 1
    shape = draw(st.tuples(*[st.integers(smallest, 7)] * 2))
    rng = np.random.default_rng(draw(SEEDS))
    is_open = np.ones(shape, dtype=bool)
    for structure in draw(st.lists(st.sampled_from(STRUCTURES), max_size=2)):
        is_open = structure(is_open, rng)
    decades = draw(st.sampled_from([0.0, 0.3, 1.0, 3.0]))
    samples = np.where(is_open, 10 ** rng.uniform(-decades, 0, shape), 0.0)
    sides = draw(st.sampled_from(["wall", "periodic"]))
    spacing = draw(st.sampled_from([(1.0, 1.0), (3.0, 1.0), (1.0, 3.0)]))
    link_rule = draw(st.sampled_from(list(LINKS)))
    return Case(samples, representation, sides, spacing, link_rule).with_samples(samples)


def leaks(case: Case) -> bool:
    """Whether open samples join inlet and outlet.

    Pixels are neighbours along their sides, vertices along the edges of the triangulation.
    """
    is_open, around = case.samples > 0, case.sides == "periodic"
    if case.representation == "constant":
        return spans(is_open, "4", around)
    return spans(is_open[:, :-1] if around else is_open, "triangulation", around)


def assert_overlap(one, other) -> None:
    """Both enclose the same number: every level of one meets every level of the other."""
    for level in one.levels:
        for image in other.levels:
            assert level.lower <= image.upper
            assert image.lower <= level.upper


# --- one gap -------------------------------------------------------------------------------------


@settings(max_examples=24)
@given(cases())
def test_sealed_exactly_when_no_path_is_open(case):
    """Joined samples, the labelled lattice, the cells of the mesh and the spots of the
    stream function: four answers to one question."""
    open_path = leaks(case)
    assert case.film.sealed == (not open_path)
    gap = represented(case.field, case.representation)
    mesh, values = meshed(gap, 1, case.sides == "periodic")
    data = gap.cell_data(mesh, values)
    kept, _ = open_cells(mesh, data)
    assert kept.any() == open_path
    assert (len(dual_numbering(mesh, data, kept, merge_blocked=True).basis) == 1) == open_path
    if not open_path:
        for flow in (case.bounds(), by_differences(case.film, **FLUID)):
            assert (flow.state, flow.value, flow.unknowns, flow.levels) == ("sealed", 0.0, 0, ())
            assert flow.bounds == (0.0, 0.0)
            assert flow.converged


@settings(max_examples=10)
@given(cases())
def test_brackets_enclose_one_number(case):
    """Uniform and adaptive meshes bracket the same leak rate ever closer."""
    assume(leaks(case))
    flows = [case.bounds(method) for method in ("uniform", "adaptive")]
    assert_overlap(*flows)
    for flow in flows:
        assert flow.state == "leaking"
        assert all(0 < level.lower <= level.upper for level in flow.levels)
        lower, upper = np.transpose([[level.lower, level.upper] for level in flow.levels])
        # A bound is a sum over cells that each mesh cuts anew. Summed in pairs it is known to the
        # rounding unit times log2 of their number, below 2^32.
        rounding = 32 * np.finfo(float).eps
        assert (np.diff(lower) >= -rounding * lower[1:]).all()
        assert (np.diff(upper) <= rounding * upper[1:]).all()
        assert flow.converged or "unknowns" in flow.reason
        assert len(flow.levels) == 1 or flow.unknowns <= 150


# --- two gaps ------------------------------------------------------------------------------------


def images(case: Case):
    """A gap and its image, turned round, mirrored, and shifted along periodic sides by two pixels;
    whether the mesh has the same image, by its diagonals."""
    nx, ny = np.array(case.samples.shape) - (case.representation == "linear")
    for axis, pixels in ((0, nx), (1, ny)):
        yield case, replace(case, samples=np.flip(case.samples, axis)), pixels % 2 == 0
    case = replace(case, sides="periodic").with_samples(case.samples)
    shifted = case.samples.copy()
    shifted[:, :ny] = np.roll(shifted[:, :ny], 2, axis=1)
    yield case, case.with_samples(shifted), ny % 2 == 0


@settings(max_examples=8)
@given(cases(), st.integers(0, 2))
def test_images(case, which):
    """As much flows through a gap as through its image, on the same mesh to the tolerance."""
    case, other, same_mesh = list(images(case))[which]
    assert other.by_differences() == pytest.approx(case.by_differences(), rel=ROUNDING)
    if same_mesh or case.representation == "constant":
        assert_overlap(case.bounds(), other.bounds())
    if same_mesh:
        flows = [each.bounds("uniform", tuning=TIGHT) for each in (case, other)]
        for one, two in zip(*(flow.levels for flow in flows), strict=True):
            assert (one.lower, one.upper) == pytest.approx((two.lower, two.upper), rel=DUALITY)


@settings(max_examples=8)
@given(cases(), st.tuples(*[st.integers(-40, 4)] * 4), st.sampled_from(["uniform", "adaptive"]))
def test_scales(case, powers, method):
    """Gap, lengths, viscosity and pressure in other units: the same meshes, and bounds that go as
    Δp g³/η. Powers of two lose no digit, but the sums of two solves may differ in their order."""
    gap, length, viscosity, drop = (2.0**power for power in powers)
    other = replace(
        case,
        samples=gap * case.samples,
        spacing=(length * case.spacing[0], length * case.spacing[1]),
    )
    fluid = {"viscosity": viscosity / 12, "pressure_drop": drop}
    scale = drop * gap**3 / viscosity
    one, two = case.bounds(method), other.bounds(method, **fluid)
    assert [level.unknowns for level in one.levels] == [level.unknowns for level in two.levels]
    for name in ("lower", "upper", "value", "inflow", "outflow"):
        expected = scale * (getattr(one, name) or 0)
        assert (getattr(two, name) or 0) == pytest.approx(expected, rel=1e-10)
    expected = scale * case.by_differences()
    assert other.by_differences(**fluid) == pytest.approx(expected, rel=ROUNDING)


@settings(max_examples=16)
@given(cases(), SEEDS, st.sampled_from([0.03, 0.3]), st.sampled_from([0.0, 0.7]))
def test_monotone_in_the_gap(case, seed, share, factor):
    """More contact, or a lower gap anywhere, at some places or at many, never lets more through."""
    most = case.by_differences() * (1 + ROUNDING)
    lowered = np.random.default_rng(seed).random(case.samples.shape) < share
    narrower = case.with_samples(np.where(lowered, factor, 1.0) * case.samples)
    assert narrower.by_differences() <= most
    if seed % 4 == 0:  # bounds take longer
        before, after = case.bounds(), narrower.bounds()
        assert after.lower <= before.upper
        assert before.state == "leaking" or after.state == "sealed"


@settings(max_examples=8)
@given(cases())
def test_walls_let_no_more_through_than_periodic_sides(case):
    """Periodic pressures are among those admitted between walls, and fluxes between walls among
    the periodic ones: on one mesh either bound of the walls is the lower. CG errs by 2e-8."""
    periodic = replace(case, sides="periodic").with_samples(case.samples)
    walls = replace(periodic, sides="wall")
    assert walls.by_differences() <= periodic.by_differences() * (1 + ROUNDING)
    if leaks(walls):
        gap = represented(walls.field, walls.representation)
        wall, repeated = (plain_bounds(level_problem(gap, periodic_sides=p)) for p in (False, True))
        assert (wall <= repeated * (1 + 4e-8)).all()


@settings(max_examples=8)
@given(
    st.tuples(*[st.integers(1, 7)] * 2),
    st.sampled_from([(1.0, 1.0), (3.0, 1.0)]),
    st.sampled_from([1.0, 4.0]),
    SEEDS,
)
def test_duality(shape, spacing, deviation, seed):
    """Q_x[K] Q_y[1/K] = 1 of pixels between walls, for any K (Keller 1964; Dykhne 1971).

    Transposed meshes of the family coincide, so the dual problem of a log-normal K is the primal
    problem of 1/K turned by a right angle: lower · upper = 1 to the solver tolerance.
    """
    log_g = deviation / 3 * np.random.default_rng(seed).normal(size=shape)
    one = Case(np.exp(log_g), "constant", "wall", spacing)
    other = Case(np.exp(-log_g.T), "constant", "wall", spacing[::-1])
    pair = [each.bounds("uniform", tuning=TIGHT) for each in (one, other)]
    # The limit of unknowns may end one of them a mesh before the other.
    for level, partner in zip(*(flow.levels for flow in pair), strict=False):
        assert level.lower * partner.upper == pytest.approx(1, rel=DUALITY)
        assert level.upper * partner.lower == pytest.approx(1, rel=DUALITY)
