"""Flows that begin with the mesh of another film have the same bounds, in fewer steps."""

import numpy as np
import pytest
from gaps import Random, level_problem, represented
from sample_gaps import FLUID, rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import leak_rate
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
    flows = []
    leak_rate(film, **FLUID, keep=flows.append)
    warm, cold = leak_rate(other, **FLUID, start=flows[0].start), leak_rate(other, **FLUID)
    assert warm.converged
    assert max(warm.lower, cold.lower) <= min(warm.upper, cold.upper)
    assert len(warm.levels) < len(cold.levels)
