"""The same contact on finer and finer grids."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, rough_surface

from fem_seal.contact import extrapolate, on_finer_grids, solve
from fem_seal.errors import InvalidInput
from fem_seal.surface import resample


@pytest.fixture(scope="module")
def states():
    height = rough_surface((48, 48), short=4)
    return list(on_finer_grids(height, E_STAR, pressure=0.1 * E_STAR * SLOPE, factors=(1, 2, 4, 8)))


def test_raw_area_converges_at_first_order():
    """Every pixel of the contact's edge counts whole: an error ∝ perimeter × spacing. Edges are
    short, so that the order of one surface scatters by a quarter; twelve are taken together, to
    three of their standard errors."""
    surfaces, pressure = 12, 0.1 * E_STAR * SLOPE
    areas = [
        [
            state.contact_area_fraction
            for state in on_finer_grids(
                rough_surface((48, 48), short=4, seed=seed),
                E_STAR,
                pressure=pressure,
                factors=(1, 2, 4, 8),
            )
        ]
        for seed in range(surfaces)
    ]
    found = extrapolate(np.mean(areas, axis=0))
    assert found.order == pytest.approx(1, abs=3 * 0.25 / np.sqrt(surfaces))


def test_corrected_area_and_mean_gap_converge_faster(states):
    raw, corrected, gap = (
        np.array([getattr(state, name) for state in states])
        for name in ("contact_area_fraction", "contact_area_corrected", "mean_gap")
    )
    limit = extrapolate(raw).limit
    assert abs(corrected[0] - limit) < 0.3 * abs(raw[0] - limit)
    # The load, not its edge, carries the mean gap.
    assert abs(gap[0] / gap[-1] - 1) < 0.02 * abs(raw[0] / raw[-1] - 1)


def test_states_are_those_of_single_solves(states):
    height = resample(rough_surface((48, 48), short=4), (96, 96))
    alone = solve(height, E_STAR, pressure=0.1 * E_STAR * SLOPE)
    assert np.count_nonzero(states[1].contact != alone.contact) <= 1
    assert states[1].fft_pairs < alone.fft_pairs


def test_coarser_too():
    height = rough_surface((48, 36), short=8)
    shapes = [
        state.gap.shape
        for state in on_finer_grids(height, E_STAR, pressure=1e4, factors=(0.5, 1.5))
    ]
    assert shapes == [(24, 18), (72, 54)]


@pytest.mark.parametrize("order", [0.5, 1, 2])
def test_extrapolation_is_exact_for_one_power(order):
    values = [3 - 0.7 * h**order for h in (1, 1 / 2, 1 / 4)]
    found = extrapolate(values)
    assert found.limit == pytest.approx(3, rel=1e-12)
    assert found.order == pytest.approx(order, rel=1e-9)
    assert found.error == pytest.approx(3 - values[-1], rel=1e-9)


@pytest.mark.parametrize("values", [(1, 2, 1.5), (1, 2, 4), (1, 1, 2)])
def test_no_limit_without_convergence(values):
    found = extrapolate(values)
    assert found.limit == values[-1]
    assert found.error == max(abs(np.diff(values)))
    assert np.isnan(found.order)


def test_refused(rough):
    with pytest.raises(InvalidInput, match="three grids"):
        extrapolate([1.0, 2.0])
    with pytest.raises(InvalidInput, match="whole number"):
        on_finer_grids(rough, E_STAR, pressure=1e4, factors=(0.3, 1))
    with pytest.raises(InvalidInput, match="increase"):
        on_finer_grids(rough, E_STAR, pressure=1e4, factors=(2, 1))
    with pytest.raises(InvalidInput, match="exactly one load"):
        on_finer_grids(rough, E_STAR)
