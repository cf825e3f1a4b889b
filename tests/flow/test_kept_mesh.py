"""Flows that begin with the mesh of another film: same bounds, pressures that can be compared."""

import numpy as np
import pytest
from gaps import Random, level_problem, represented
from sample_gaps import FLUID, rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import KeptMesh, leak_rate, pressure_on_kept
from fem_seal.fluid import Slip
from fem_seal.grid import GridField

REPRESENTATIONS = ["linear", "constant"]


def films(representation, sides):
    """A rough film with contact, and the same lifted by a few per cent of its largest gap."""
    gap = rough_gap((32, 32), 0.2, seed=3, smooth=2)
    lifted = GridField(np.where(gap.values > 0, gap.values + 0.03, 0.0), gap.spacing, periodic=True)
    return [GridFilm(field, sides, representation) for field in (gap, lifted)]


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_gap_at_the_vertices_of_any_mesh(seed, periodic):
    """As carried along from bisection to bisection, to rounding; contact is exactly contact."""
    gap = represented(rough_gap((12, 8), 0.4, seed), cut=0.02, floor=0.05)
    problem = level_problem(gap, 1, periodic, markings=[Random(seed)] * 5)
    assert (problem.mesh.xy % (1 << 24)).any()  # vertices between the samples are meant
    values = gap.values_at(problem.mesh)
    np.testing.assert_allclose(values, problem.values, rtol=0, atol=1e-15)
    assert np.array_equal(values == 0, problem.values == 0)


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_bounds_from_the_mesh_of_another_film(representation, sides):
    """They overlap with those from the coarsest mesh, in fewer steps."""
    film, other = films(representation, sides)
    kept = KeptMesh()
    leak_rate(film, **FLUID, kept=kept)
    warm, cold = leak_rate(other, **FLUID, kept=kept), leak_rate(other, **FLUID)
    assert warm.converged
    assert max(warm.lower, cold.lower) <= min(warm.upper, cold.upper)
    assert len(warm.levels) < len(cold.levels)


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize("slips", [False, True])
def test_pressure_alone_on_the_mesh_of_another_film(representation, slips):
    """The same film has the same inflow; a wider one more, by its bounds, and an upper bound."""
    film, other = films(representation, "periodic")
    slip = Slip(2.0, 1.0, 0.05) if slips else None
    kept = KeptMesh()
    first = leak_rate(film, **FLUID, slip=slip, kept=kept, field=True)
    same = pressure_on_kept(film, kept, **FLUID, slip=slip)
    # CG begins with the pressure at which it stopped, and stops again: rounding.
    assert same.inflow == pytest.approx(first.inflow, rel=1e-13, abs=0)
    np.testing.assert_allclose(same.field.pressure, first.field.pressure, rtol=0, atol=1e-13)
    wider = pressure_on_kept(other, kept, **FLUID, slip=slip)
    exact = leak_rate(other, **FLUID, slip=slip, rtol=0.01)
    assert not wider.converged
    assert exact.refined_bounds[0] <= wider.refined_bounds[1]
    # Each inflow is at most so much too high, both in the same direction.
    excess = max(first.inflow / first.lower, wider.inflow / exact.lower) - 1
    ratio, true = wider.inflow / first.inflow, exact.value / first.value
    assert ratio == pytest.approx(true, rel=excess, abs=0)
    assert true > 1.1
