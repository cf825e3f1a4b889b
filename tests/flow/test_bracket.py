"""The difference of the bounds, cell by cell; where the depth of a mesh ends."""

import numpy as np
import pytest
from gaps import Random, bracketed, everything, level_problem, represented, solved
from sample_gaps import rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.flow.indicators import error_indicators
from fem_seal.grid import GridField


@pytest.mark.parametrize(
    ("representation", "periodic"), [("linear", False), ("linear", True), ("constant", True)]
)
@pytest.mark.parametrize("contact", [0.0, 0.3])
@pytest.mark.parametrize(("tolerance", "spacing"), [(1e-8, (5.0, 1.0)), (1e-1, (1.0, 1.0))])
def test_indicators_are_positive_and_sum_to_the_difference(
    representation, periodic, contact, tolerance, spacing
):
    """Prager and Synge: e_T ≥ 0 and Σ e_T = upper - lower, for any admissible pair, converged or
    not; power traces, blocked cells and cuts included. Sums of 10³ terms: 1e-12 of the upper."""
    limits = {"cut": 0.02, "floor": 0.02} if contact else {}
    rough = GridField(rough_gap((16, 16), contact, 5).values, spacing, periodic=True)
    gap = represented(rough, representation, width=2, **limits)
    markings = [everything, *([Random(1)] * 5)]
    problem = level_problem(gap, 2, periodic, tolerance, markings)
    pressure, stream = solved(problem)
    indicators = error_indicators(problem, problem.flows(pressure, stream))
    assert indicators.min() > -1e-12 * pressure.energies.item()
    difference = pressure.energies.item() - stream.conductance
    assert indicators.sum() == pytest.approx(difference, abs=1e-12 * pressure.energies.item())
    assert 0 < stream.conductance < pressure.energies.item()
    if contact and representation == "linear":
        number = problem.data.contact_vertex.sum(axis=1)
        assert {0, 1, 2} <= set(number)  # all kinds of traces took part


def test_depth_ends_with_the_bounds_so_far():
    """A corner of four fields of contrast 1e6, p ~ r^0.0013: triangles of 2^-24 pixels do not do.
    The bounds reached by then are returned, and the reason. (A small θ keeps the mesh small.)"""
    gap = GridField(np.array([[1.0, 1e-2], [1e-2, 1.0]]), (1.0, 1.0))
    film, tuning = GridFilm(gap, representation="constant"), Tuning(theta=0.1)
    flow = bracketed(film, 0.1, unknowns=None, tuning=tuning)
    assert not flow.converged
    assert "2^-24" in flow.reason
    assert 0 < flow.lower <= 1e-3 <= flow.upper
    assert flow.field is None
