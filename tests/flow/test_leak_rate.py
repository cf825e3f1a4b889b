"""leak_rate as its callers see it: limits, refusals, progress and the flow field."""

import numpy as np
import pytest
from gaps import bracketed
from project import leak_rate
from sample_gaps import FLUID, rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.flow import FlowSettings, Limits
from fem_seal.flow import leak_rate as flow_leak_rate
from fem_seal.flow.stopping import GROWTH_FOR_ORDER, MOST_UNKNOWNS
from fem_seal.grid import GridField

METHODS = ["uniform", "adaptive"]
GAP = rough_gap((16, 16), 0.3, 6)


@pytest.fixture(scope="module")
def tight():
    """The leak rate of GAP to two per cent."""
    return leak_rate(GridFilm(GAP), rtol=0.02, **FLUID)


# --- limits ------------------------------------------------------------------------------------

LIMITS = {
    "unknowns": (Limits(unknowns=1500), "more than 1500 unknowns"),
    "seconds": (Limits(seconds=0.0), "0 s is used up"),
    "memory": (Limits(memory_bytes=1), "GB"),
}


@pytest.mark.parametrize("name", LIMITS)
@pytest.mark.parametrize(("method", "field"), [("uniform", True), ("adaptive", False)])
def test_limits(name, method, field, tight):
    """The bounds reached by then are valid, and the reason is given in one line."""
    limits, words = LIMITS[name]
    flow = leak_rate(GridFilm(GAP), method=method, rtol=1e-6, limits=limits, field=field, **FLUID)
    assert not flow.converged
    assert words in flow.reason
    assert "\n" not in flow.reason
    assert flow.state == "leaking"
    assert flow.lower <= tight.upper
    assert tight.lower <= flow.upper
    assert flow.lower <= flow.value <= flow.upper
    if name == "unknowns":
        assert len(flow.levels) > 1
        assert flow.levels[-1].unknowns <= 1500
    else:
        assert len(flow.levels) == 1
    assert (flow.field is not None) == field


def test_the_memory_of_the_machine_is_a_limit(monkeypatch):
    """Where the next mesh cannot be expected to fit, what is known so far is the result."""
    monkeypatch.setattr("fem_seal.limits.available_memory", lambda: 1000)
    flow = leak_rate(GridFilm(GAP), rtol=1e-6, **FLUID)
    assert len(flow.levels) == 1
    assert "more than there is" in flow.reason
    assert 0 < flow.lower < flow.upper


def crossed_by_a_line(least):
    """Open gaps, and a row of small ones across the flow."""
    values = 0.5 + 0.5 * np.random.default_rng(0).random((17, 17))
    values[8] = least
    return GridField(values, (1.0, 1.0))


@pytest.mark.parametrize("method", METHODS)
def test_a_line_of_tiny_gaps_ends(method):
    """To resolve a gap of 1e-30 all along a line takes 1e30 triangles: the bounds say how far."""
    flow = leak_rate(GridFilm(crossed_by_a_line(1e-30)), method=method, **FLUID)
    assert not flow.converged
    assert f"needs more than {MOST_UNKNOWNS} unknowns" in flow.reason
    assert "the critical constriction is 1e-30 of the largest gap" in flow.reason
    assert 0 < flow.lower < flow.upper
    # Judged as soon as the mesh has grown by that much, and no mesh is more than 4 times the last.
    assert flow.levels[-1].cells < 4 * GROWTH_FOR_ORDER * flow.levels[0].cells


def test_a_tight_spot_does_not_end():
    """Its cost grows as a logarithm, however small its gap is: h = |x² - y²| + least, cut at 0."""
    x = np.linspace(-1, 1, 33)
    gap = GridField(np.maximum(0, x[:, None] ** 2 - x**2 + 1e-9), (1.0, 1.0))
    flow = leak_rate(GridFilm(gap), **FLUID)
    assert flow.converged
    assert flow.unknowns < 2000


def test_a_line_of_tiny_gaps_may_decide():
    """No mesh brings the bounds together, but their first ones lie on one side of a limit."""
    gap = crossed_by_a_line(1e-30)
    wide = leak_rate(GridFilm(gap), **FLUID)
    above = leak_rate(GridFilm(gap), decide=2 * wide.upper, **FLUID)
    below = leak_rate(GridFilm(gap), decide=wide.lower / 2, **FLUID)
    assert above.converged
    assert above.upper <= 2 * wide.upper
    assert below.converged
    assert below.lower > wide.lower / 2
    # Nothing is said of a limit between them before it is decided.
    limits = Limits(unknowns=5 * wide.unknowns)
    between = leak_rate(
        GridFilm(gap), decide=(wide.lower * wide.upper) ** 0.5, limits=limits, **FLUID
    )
    assert between.unknowns > wide.unknowns
    assert "times the limit" in between.reason


@pytest.mark.parametrize(("method", "rtol"), [("uniform", 0.5), ("adaptive", 0.1)])
def test_tolerance_is_met_and_no_level_before_met_it(rtol, method):
    flow = bracketed(GridFilm(GAP), rtol, unknowns=None, method=method)
    widths = [(v.upper - v.lower) / np.sqrt(v.lower * v.upper) for v in flow.levels]
    assert flow.converged
    assert flow.reason == ""
    assert widths[-1] <= rtol
    assert all(width > rtol for width in widths[:-1])
    assert flow.value == pytest.approx(np.sqrt(flow.lower * flow.upper), rel=1e-12, abs=0)


# --- refusals ----------------------------------------------------------------------------------

ONES = GridField(np.ones((4, 4)), (1.0, 1.0))
BAD_OPTIONS = [
    {"viscosity": "1 mPa s"},
    {"decide": 0.0},
    {"decide": np.nan},
    {"method": "finite elements"},
]  # what is no positive number: tests/extremes


@pytest.mark.parametrize("options", BAD_OPTIONS)
def test_bad_options(options):
    """One sentence with the value; for a choice it lists the names to choose from."""
    ((name, value),) = options.items()
    with pytest.raises(InvalidInput, match=name) as error:
        leak_rate(GridFilm(ONES), **FLUID | options)
    message = str(error.value)
    assert "\n" not in message
    assert str(value) in message
    assert ("choose from" in message) == (name == "method")


@pytest.mark.parametrize("solver", [flow_leak_rate, by_differences])
@pytest.mark.parametrize("bare", [np.ones((4, 4)), ONES])
def test_a_bare_gap_is_no_film(solver, bare):
    """It does not say what lies at its sides, nor how to read it between its samples."""
    with pytest.raises(InvalidInput, match=f"{type(bare).__name__}; make it a GridFilm"):
        solver(bare, FlowSettings(**FLUID))


# --- progress ----------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_progress_is_told_every_level(method):
    """In order, in m³/s, and the same that the result keeps."""
    seen = []
    flow = leak_rate(GridFilm(GAP), method=method, rtol=0.1, progress=seen.append, **FLUID)
    assert tuple(seen) == flow.levels
    assert seen[-1].upper == flow.upper
    assert [v.unknowns for v in seen] == sorted(v.unknowns for v in seen)
    for level in seen:
        assert {k: len(errors) for k, errors in level.residuals.items()} == level.iterations
        # CG ends where the energy is known to Tuning.tolerance, or far below it.
        assert all(errors[-1] <= 1e-6 for errors in level.residuals.values() if errors)
    assert [v.cells for v in seen] == sorted(v.cells for v in seen)


@pytest.mark.parametrize("every_dual", [False, True])
def test_lower_bound_is_zero_until_a_dual_is_solved(every_dual):
    """A level without a true dual has no lower bound of its own; one is there at the end."""
    flow = leak_rate(GridFilm(GAP), rtol=0.05, every_dual=every_dual, **FLUID)
    solved = np.array(["dual" in level.iterations for level in flow.levels])
    lower = np.array([level.lower for level in flow.levels])
    assert solved.all() == every_dual
    assert (lower[~np.logical_or.accumulate(solved)] == 0).all()
    assert flow.lower > 0


# --- flow field --------------------------------------------------------------------------------

WATER = {"viscosity": 1e-3, "pressure_drop": 2e5}


def field_of(film, **options):
    return leak_rate(film, rtol=0.1, limits=Limits(unknowns=3000), field=True, **WATER | options)


def areas_and_slopes(field):
    """Area (C,) and pressure gradient (C, 2) of each cell, from points and pressure alone."""
    x = field.points[field.cells]
    to_corner = np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]], axis=2)
    p = field.pressure[field.cells]
    slope = np.einsum("cij,ci->cj", np.linalg.inv(to_corner), p[:, 1:] - p[:, :1])
    return np.abs(np.linalg.det(to_corner)) / 2, slope


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_flow_field_carries_the_leak_rate(method, sides, representation):
    """∫ j_x dx dy = Q Lx. For the discrete flow Q is the inflow: 1 - x/Lx is 1 on the inlet, 0 on
    the outlet and linear on every cell, so that both are a(p, w) with two such w, equal for the
    discrete minimiser. CG is away from it by √(2e-8) of the energy norm; the norms of the two w
    exceed √Q at most by the square root of mean K over Q, here a factor below 100."""
    gap = GridField(GAP.values * 1e-6, (2e-6, 1e-6), periodic=True)
    flow = field_of(
        GridFilm(gap, sides=sides, representation=representation),
        method=method,
    )
    field = flow.field
    area, slope = areas_and_slopes(field)
    through = (area * field.flux[:, 0]).sum() / gap.size[0]
    assert through == pytest.approx(flow.inflow, rel=100 * np.sqrt(2e-8), abs=0)
    assert flow.inflow == pytest.approx(flow.outflow, rel=100 * np.sqrt(2e-8), abs=0)
    # An upper bound before correction, which cannot do more than cells of a quarter of the size:
    # within the bracket and three times as much again.
    assert flow.lower <= through <= flow.upper + 3 * (flow.upper - flow.lower)
    # j = -K ∇p: along the pressure drop, and dissipating Q Δp in all.
    assert -(area * (field.flux * slope).sum(axis=1)).sum() == pytest.approx(
        flow.inflow * WATER["pressure_drop"], rel=100 * np.sqrt(2e-8), abs=0
    )
    assert ((field.flux * slope).sum(axis=1) <= 0).all()
    assert field.pressure.min() == 0
    assert field.pressure.max() == WATER["pressure_drop"]


@pytest.mark.parametrize("method", METHODS)
def test_points_stand_on_both_sides_of_a_contact_line(method):
    """A contact line across half of the strip: points on it stand twice, with two pressures."""
    values = np.ones((9, 9))
    values[4, :6] = 0
    flow = field_of(GridFilm(GridField(values, (1.0, 1.0))), method=method)
    field = flow.field
    place, index, number = np.unique(
        field.points.round(9), axis=0, return_inverse=True, return_counts=True
    )
    twice = place[number == 2]
    assert number.max() == 2
    assert len(twice) > 3
    assert (twice[:, 0] == 4).all()
    assert (twice[:, 1] < 5).all()  # its end, (4, 5), stands once
    for point in np.flatnonzero(number == 2):
        high, low = np.sort(field.pressure[index == point])[::-1]
        assert high - low > 0.05 * WATER["pressure_drop"]
    assert np.array_equal(np.unique(field.cells), np.arange(len(field.points)))
