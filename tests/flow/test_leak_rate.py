"""leak_rate as its callers see it: limits, refusals, progress and the flow field."""

import numpy as np
import pytest
from gaps import areas_and_slopes
from project import leak_rate
from sample_gaps import FLUID, rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import Limits
from fem_seal.flow.stopping import GROWTH_FOR_ORDER, MOST_UNKNOWNS
from fem_seal.grid import GridField

METHODS = ["uniform", "adaptive"]
GAP = rough_gap((16, 16), 0.3, 6)


# --- limits ------------------------------------------------------------------------------------


def crossed_by_a_line(least):
    """Open gaps, and a row of small ones across the flow."""
    values = 0.5 + 0.5 * np.random.default_rng(0).random((9, 9))
    values[4] = least
    return GridField(values, (1.0, 1.0))


def test_a_tight_spot_does_not_end():
    """Its cost is a + b ln(1/least), however small its gap is: h = |x² - y²| + least, cut at 0."""
    x = np.linspace(-1, 1, 17)
    gaps = (np.maximum(0, x[:, None] ** 2 - x**2 + least) for least in (1e-3, 1e-5))
    wide, tight = (leak_rate(GridFilm(GridField(gap, (1.0, 1.0))), **FLUID) for gap in gaps)
    assert wide.converged
    assert tight.converged
    assert tight.unknowns < 5 / 3 * wide.unknowns


@pytest.mark.parametrize("method", METHODS)
def test_a_line_of_tiny_gaps(method):
    """To resolve a gap of 1e-30 all along a line takes 1e30 triangles: the bounds say how far. They
    decide on limits that do not lie between them."""
    film = GridFilm(crossed_by_a_line(1e-30))
    wide = leak_rate(film, method=method, **FLUID)
    assert not wide.converged
    assert f"needs more than {MOST_UNKNOWNS} unknowns" in wide.reason
    assert "the critical constriction is 1e-30 of the largest gap" in wide.reason
    assert 0 < wide.lower < wide.upper
    # Judged as soon as the mesh has grown by that much, and no mesh is more than 4 times the last.
    assert wide.levels[-1].cells < 4 * GROWTH_FOR_ORDER * wide.levels[0].cells
    above, below = (
        leak_rate(film, method=method, decide=limit, **FLUID)
        for limit in (2 * wide.upper, wide.lower / 2)
    )
    assert above.converged
    assert above.upper <= 2 * wide.upper
    assert below.converged
    assert below.lower > wide.lower / 2
    # Nothing is said of a limit between them before it is decided.
    limits = Limits(unknowns=5 * wide.unknowns)
    middle = (wide.lower * wide.upper) ** 0.5
    between = leak_rate(film, method=method, decide=middle, limits=limits, **FLUID)
    assert between.unknowns > wide.unknowns
    assert "times the limit" in between.reason


@pytest.mark.parametrize(
    ("method", "rtol", "every_dual"),
    [("uniform", 0.5, False), ("adaptive", 0.1, True), ("adaptive", 0.05, False)],
)
def test_levels(method, rtol, every_dual):
    """Progress is told all that the result keeps, in m³/s: larger and larger meshes until one meets
    the tolerance. A level without a true dual has no lower bound of its own; one is there at the
    end."""
    seen = []
    options = {"method": method, "rtol": rtol, "every_dual": every_dual, "progress": seen.append}
    flow = leak_rate(GridFilm(GAP), **options, **FLUID)
    assert flow.converged
    assert flow.reason == ""
    assert tuple(seen) == flow.levels
    assert (seen[-1].lower, seen[-1].upper) == flow.bounds
    assert flow.value == pytest.approx(np.sqrt(flow.lower * flow.upper), rel=1e-12)
    lower, upper, unknowns, cells = np.transpose(
        [(v.lower, v.upper, v.unknowns, v.cells) for v in seen]
    )
    assert upper[-1] - lower[-1] <= rtol * flow.value
    assert (upper - lower > rtol * np.sqrt(lower * upper))[:-1].all()
    assert (np.diff(unknowns) > 0).all()
    assert (np.diff(cells) > 0).all()
    for level in seen:
        assert {k: len(errors) for k, errors in level.residuals.items()} == level.iterations
        # CG ends where the energy is known to Tuning.tolerance, or far below it.
        assert all(errors[-1] <= 1e-6 for errors in level.residuals.values() if errors)
    solved = np.array(["dual" in level.iterations for level in seen])
    assert solved.all() == (every_dual or method == "uniform")
    assert (lower[~np.logical_or.accumulate(solved)] == 0).all()


# --- flow field --------------------------------------------------------------------------------

WATER = {"viscosity": 1e-3, "pressure_drop": 2e5}


@pytest.mark.parametrize(
    ("method", "sides", "representation"),
    [
        *(("uniform", "wall", "constant"), ("adaptive", "wall", "linear")),
        *(("uniform", "periodic", "linear"), ("adaptive", "periodic", "constant")),
    ],
)
def test_flow_field_carries_the_leak_rate(method, sides, representation):
    """∫ j_x dx dy = Q Lx. For the discrete flow Q is the inflow: 1 - x/Lx is 1 on the inlet, 0 on
    the outlet and linear on every cell, so that both are a(p, w) with two such w, equal for the
    discrete minimiser. CG is away from it by √(2e-8) of the energy norm; the norms of the two w
    exceed √Q at most by the square root of mean K over Q, here a factor below 100."""
    gap = GridField(GAP.values * 1e-6, (2e-6, 1e-6), periodic=True)
    film, limits = GridFilm(gap, sides, representation), Limits(unknowns=3000)
    flow = leak_rate(film, method=method, rtol=0.1, limits=limits, field=True, **WATER)
    field = flow.field
    area, slope = areas_and_slopes(field)
    through = (area * field.flux[:, 0]).sum() / gap.size[0]
    assert through == pytest.approx(flow.inflow, rel=100 * np.sqrt(2e-8))
    assert flow.inflow == pytest.approx(flow.outflow, rel=100 * np.sqrt(2e-8))
    # An upper bound before correction, which cannot do more than cells of a quarter of the size:
    # within the bracket and three times as much again.
    assert flow.lower <= through <= flow.upper + 3 * (flow.upper - flow.lower)
    # j = -K ∇p: along the pressure drop, and dissipating Q Δp in all.
    assert -(area * (field.flux * slope).sum(axis=1)).sum() == pytest.approx(
        flow.inflow * WATER["pressure_drop"], rel=100 * np.sqrt(2e-8)
    )
    assert ((field.flux * slope).sum(axis=1) <= 0).all()
    assert field.pressure.min() == 0
    assert field.pressure.max() == WATER["pressure_drop"]


def test_flux_where_the_pressure_is_constant():
    """A thin film lets the same flux through every cell, also through those of one pressure.

    An energy that is 1e-8 too large leaves a cell in the film, one of 64, a flux off by √(64e-8).
    """
    samples = np.where(np.abs((np.arange(32) + 0.5) / 32 - 0.5) < 0.1, 1e-6, 1.0)
    gap, exact = np.repeat(samples[:, None], 32, axis=1), 32 / (1 / samples**3).sum()
    film = GridFilm(GridField(gap, (1.0, 1.0)), representation="constant")
    flow = leak_rate(film, rtol=1e-8, field=True, **FLUID)
    assert flow.field.flux[:, 0] == pytest.approx(exact / 32, rel=1e-3)
    assert np.abs(flow.field.flux[:, 1]).max() < 1e-3 * exact / 32
