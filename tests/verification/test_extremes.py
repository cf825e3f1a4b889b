"""The extremes come out right, refused or limited, as docs/limits.md says; never broken."""

from inspect import getdoc

import numpy as np
import pytest
from project import ROOT

from fem_seal.errors import FemSealError, InvalidInput
from fem_seal.finite_difference import solve
from fem_seal.flow import Limits, leak_rate
from fem_seal.grid import GridField
from fem_seal.verification.extremes import EXTREMES, Finding, as_page, look_at
from fem_seal.verification.finding import Outcome, refusal, right


@pytest.mark.parametrize("size", [1e-310, 1e-120, 1e-70, 1e70, 1e120])
@pytest.mark.parametrize("solver", [leak_rate, solve])
def test_leak_rates_beyond_double_precision_are_refused(size, solver):
    """The cube of the gap underflows or overflows; it once came out as a leak rate of 0."""
    gap = GridField(np.full((4, 4), size), (1.0, 1.0))
    with pytest.raises(InvalidInput, match="beyond double precision; check the units"):
        solver(gap, viscosity=1e-3, pressure_drop=1e5, sides="wall")


EVERY = [extreme for part in EXTREMES.values() for extreme in part]


@pytest.mark.parametrize("extreme", EVERY, ids=lambda extreme: extreme.__name__)
def test_nothing_is_broken(extreme):
    """Each finding proves itself; what is limited names the number where that begins."""
    finding = look_at(extreme)
    assert finding.verdict in {"right", "refused", "limited"}, finding.found
    if finding.verdict == "limited":
        assert any(character.isdigit() for character in finding.found)


def test_the_page_is_that_of_this_version():
    """Rows and verdicts; the numbers in the text may differ from machine to machine."""
    page = (ROOT / "docs" / "limits.md").read_text()
    for extreme in EVERY:
        assert f"| {getdoc(extreme).rstrip('.')} |" in page, "run fem-seal study extremes"
    assert "| broken |" not in page


def test_what_breaks_is_called_broken():
    def crossing() -> Outcome:
        """Bounds that cross."""
        raise FemSealError("the bounds cross")

    def warning() -> Outcome:
        """A division by zero that numpy only warns of."""
        return right(str(np.ones(1) / np.zeros(1)))

    assert look_at(crossing).verdict == "broken"
    assert look_at(warning).verdict == "broken"
    assert refusal(lambda: 1) is None


def test_the_page_has_a_table_for_each_part():
    page = as_page([Finding(getdoc(e).rstrip("."), "right", "because") for e in EVERY])
    assert page.count("| extreme | verdict | found |") == len(EXTREMES)
    assert page.count("| right | because |") == len(EVERY)


def test_a_budget_of_unknowns_ends_with_both_bounds():
    """Out of reach of 3000 unknowns: what is known so far includes the lower bound."""
    flow = flow_of_checkerboard(contrast=100.0)
    assert not flow.converged
    assert "3000 unknowns" in flow.reason
    assert 0 < flow.lower < 1 < flow.upper
    assert flow.value == pytest.approx(np.sqrt(flow.lower * flow.upper))


def flow_of_checkerboard(contrast):
    high, low = contrast ** (1 / 6), contrast ** (-1 / 6)
    board = np.array([[low, high], [high, low]]).repeat(8, 0).repeat(8, 1)
    return leak_rate(
        GridField(board, (1 / 16, 1 / 16)),
        viscosity=1 / 12,
        pressure_drop=1.0,
        representation="constant",
        rtol=0.05,
        limits=Limits(unknowns=3000),
    )
