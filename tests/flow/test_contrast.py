"""Gaps whose conductivity spans more decades than double precision has digits."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from project import leak_rate
from sample_gaps import FLUID

from fem_seal.film import GridFilm
from fem_seal.flow import Limits
from fem_seal.grid import GridField

FLUX = 1e-4  # relative error of a flux that the solver allows: the root of that of the energy


@pytest.mark.slow  # cheaper ones: test_invariants.py, test_vertices.py, test_closed_forms.py
@example(seed=31, decades=7)
@example(seed=1568, decades=41)
@settings(max_examples=10, derandomize=True)
@given(seed=st.integers(0, 10_000), decades=st.integers(3, 50))
def test_rough_constriction(seed, decades):
    """Adaptive and uniform bounds of one gap overlap, and what flows in flows out.

    One gap in a hundred has its narrowest channel pass one vertex, beside a triangle 1e11 times as
    high: the flow spreads from a point, each halving there adds as much resistance as the one
    before, and what both bounds miss shows in no cell more than in others. Such a gap, on which
    uniform meshes do no better, ends with bounds that hold and a reason.
    """
    rng, x = np.random.default_rng(seed), (np.arange(24) + 0.5) / 24
    squeezed = 10 ** (-decades * np.exp(-(((x - 0.5) / 0.1) ** 2)))
    values = squeezed[:, None] * np.exp(rng.normal(size=(24, 24)) / 2)
    values[rng.uniform(size=values.shape) < 0.1] = 0
    gap = GridField(values, (1.0, 1.0))
    adaptive, uniform = (
        leak_rate(GridFilm(gap), method=method, rtol=0.05, limits=Limits(unknowns=most), **FLUID)
        # Most gaps take a few hundred unknowns.
        for method, most in (("adaptive", 20_000), ("uniform", 8_000))
    )
    assert adaptive.converged or not uniform.converged
    assert adaptive.converged or "unknowns" in adaptive.reason
    assert adaptive.upper < 1.5 * adaptive.lower
    assert max(adaptive.lower, uniform.lower) <= min(adaptive.upper, uniform.upper)
    for flow in (adaptive, uniform):
        assert flow.inflow == pytest.approx(flow.outflow, rel=2 * FLUX)


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
