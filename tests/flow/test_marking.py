"""Marking: the fewest cells with a given part of the error, and how often each is halved."""

from dataclasses import fields, replace

import numpy as np
import pytest
from costs import CHOICES
from project import leak_rate
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.flow.marking import REFINEMENTS, Tuning, completed, mark_all
from fem_seal.mesh.bisection import doerfler, times_halved


@pytest.mark.parametrize("name", [field.name for field in fields(Tuning)])
def test_a_parameter_has_a_range_and_a_measured_cost(name):
    with pytest.raises(InvalidInput, match=f"{name} = -5"):
        Tuning(**{name: -5})
    assert len({getattr(choice, name) for choice in CHOICES.values()}) > 1


@pytest.mark.parametrize("name", ["ahead", "coarsest"])
def test_a_number_of_halvings_or_squares_is_whole(name):
    with pytest.raises(InvalidInput, match=f"{name} = 2.5 must be a whole number >= "):
        Tuning(**{name: 2.5})


@pytest.mark.parametrize("part", [0.05, 0.5, 0.8, 0.99, 1.0])
@pytest.mark.parametrize("spread", [0.0, 0.1, 3.0, 20.0])
@pytest.mark.parametrize("before", [0.0, 0.2])
def test_the_fewest_cells_that_hold_enough(part, spread, before):
    """Shares of any spread, a fifth of them zero or negative by rounding: together with what was
    marked before, those added hold the part asked for, no other is larger, and without the least of
    them it would not be enough. The sums take 500 steps of half an eps each."""
    rng = np.random.default_rng(1)
    indicators = np.exp(spread * rng.normal(size=500))
    indicators[::5] = rng.choice([0.0, -1e-30], 100)
    total, marked = indicators[indicators > 0].sum(), rng.random(500) < before
    rounding = 250 * np.finfo(float).eps * total
    added = completed(marked, indicators, part * total) if before else doerfler(indicators, part)
    held = indicators[marked | added].sum()
    assert not (added & marked).any()
    assert held >= part * total - rounding
    assert added.any() == (indicators[marked].sum() < part * total)
    if added.any():
        least = indicators[added].min()
        assert least >= indicators[~(marked | added)].max(initial=0)
        assert held - least <= part * total + rounding


@pytest.mark.parametrize("indicators", [np.empty(0), np.zeros(4), np.full(3, -1e-20)])
def test_nothing_to_mark(indicators):
    assert not doerfler(indicators, 0.8).any()


def test_a_cell_is_halved_once_more_for_each_factor_of_four():
    """Of a smooth solution half a cell has a quarter: 4^k times the smallest is k more."""
    indicators = np.array([1.0, 3.9, 4.1, 17.0, 65.0, 1e9, 0.5])
    marked = np.array([True] * 6 + [False])
    assert times_halved(indicators, marked).tolist() == [1, 1, 1, 2, 3, 4, 0]


def test_the_rule_of_a_name_marks(monkeypatch):
    """A rule of one's own under a name: it marks all cells twice, which makes four of each."""
    monkeypatch.setitem(REFINEMENTS, "adaptive", lambda problem, *_: mark_all(problem))
    gap = rough_gap((32, 32), 0.2, seed=1, smooth=2)
    film, tuning = GridFilm(replace(gap, values=gap.values + 0.05)), Tuning(coarsest=4, ahead=0)
    leak = leak_rate(film, viscosity=1.0, pressure_drop=1.0, rtol=0.1, tuning=tuning)
    cells = [level.cells for level in leak.levels]
    assert leak.converged
    assert len(cells) > 1
    assert cells == [cells[0] * 4**k for k in range(len(cells))]


def test_rounding_alone_adds_nothing():
    """All cells are marked, and hold what is required but for a rounding."""
    indicators = np.array([1.0, 2.0])
    assert not completed(indicators > 0, indicators, 3 * (1 + 1e-15)).any()
