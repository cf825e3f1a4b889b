"""Bounds of a leak rate and of a tensor, and when a refinement ends with them."""

from types import SimpleNamespace

import numpy as np
import pytest

from fem_seal.errors import Inconsistent
from fem_seal.fenicsx import MPI
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.numbering import Numbering
from fem_seal.flow.solution import SolvedLevel
from fem_seal.flow.stopping import Decision, Stopping, Tolerance
from fem_seal.limits import Limits


def matrices(lower, upper) -> Bounds:
    return Bounds(np.array(lower, dtype=float), np.array(upper, dtype=float))


def of_rate(lower, upper) -> Bounds:
    return matrices([[lower]], [[upper]])


def test_a_tensor_of_one_number_has_its_width():
    """Multiples of one matrix, turned: the same excess and width as their factors."""
    A = np.array([[2.0, 0.7], [0.7, 1.0]])
    one, other = of_rate(0.8, 1.1), Bounds(0.8 * A, 1.1 * A)
    assert other.excess == pytest.approx(one.excess) == pytest.approx(1.1 / 0.8 - 1)
    assert other.width == pytest.approx(one.width) == pytest.approx(0.3 / np.sqrt(0.88))
    # The worst direction counts, however little flows there.
    assert matrices(np.diag([1, 1e-9]), np.diag([1.1, 1.5e-9])).excess == pytest.approx(0.5)
    # Turned, it keeps what rounding errors of 2e-16 leave of 1e-12.
    turn = np.array([[1, -1], [1, 1]]) / np.sqrt(2)
    lower, upper = (turn @ np.diag(ends) @ turn.T for ends in ([1, 1e-12], [1.1, 1.5e-12]))
    assert matrices(lower, upper).excess == pytest.approx(0.5, rel=1e-2)
    assert of_rate(0.0, 1.0).width == of_rate(0.0, 1.0).excess == np.inf
    assert matrices(np.diag([1, 0]), np.eye(2)).excess == np.inf


@pytest.mark.parametrize(("lower", "upper"), [([[2]], [[1]]), ([1], [2]), ([[1]], np.eye(2))])
def test_no_bounds(lower, upper):
    with pytest.raises(Inconsistent, match="bounds"):
        matrices(lower, upper)


def test_no_numbering():
    corners = np.array([[0, 1, -1], [1, 2, 0]])
    assert Numbering(corners, np.zeros((2, 3)), 3).count == 3
    for offset, count in (np.zeros((2, 3)), 2), (np.zeros(3), 3):
        with pytest.raises(Inconsistent, match=f"^{count} unknowns, and corners of 3$"):
            Numbering(corners, offset, count)


def test_the_better_bounds_are_kept():
    """Of numbers each bound for itself; of matrices the narrowest pair, the new one if none is."""
    assert of_rate(1.0, 3.0).tightened(of_rate(2.0, 4.0)).numbers == (2.0, 3.0)
    assert of_rate(0.0, 3.0).tightened(of_rate(0.0, 2.0)).numbers == (0.0, 2.0)
    old, new = matrices(np.eye(2), 2 * np.eye(2)), matrices(0.9 * np.eye(2), 1.9 * np.eye(2))
    best = new.tightened(old)
    np.testing.assert_array_equal(best.lower, old.lower)
    np.testing.assert_array_equal(best.upper, new.upper)
    # Neither upper bound is below the other one: that which is narrower with the lower one.
    crossed = matrices(np.eye(2), np.diag([1.1, 3]))
    np.testing.assert_array_equal(crossed.tightened(old).upper, old.upper)
    # Without lower bounds yet, finer meshes are better.
    none = matrices(np.zeros((2, 2)), 1.5 * np.eye(2))
    assert none.tightened(matrices(np.zeros((2, 2)), 2 * np.eye(2))).upper is none.upper


def test_hardly_better():
    """Less than 1 %: of both numbers, and of the width of a tensor."""
    assert of_rate(1.0, 2.0).hardly_better(of_rate(1.0, 2.0))
    assert not of_rate(1.02, 2.0).hardly_better(of_rate(1.0, 2.0))
    assert not of_rate(1.0, 1.97).hardly_better(of_rate(1.0, 2.0))
    wide, narrow = (matrices(np.eye(2), upper * np.eye(2)) for upper in (2.0, 1.9))
    assert wide.hardly_better(wide)
    assert not narrow.hardly_better(wide)


# --- the end of a refinement ---------------------------------------------------------------------


def solution(lower, upper, certified=None, stalled=""):
    """A solution without a mesh.

    With `certified` it lacks its dual, and certifying it gives that solution.
    """
    level, dual = SolvedLevel(100, 200, of_rate(lower, upper)), None if certified else "solved"
    found = {"level": level, "stream": dual, "slip": None, "stalled": stalled}
    return SimpleNamespace(**found, certified=lambda: certified)


def stopping_by(criterion, **limits) -> Stopping:
    return Stopping(criterion, Limits(**limits), 2.0, 0.1, MPI.COMM_SELF)


@pytest.mark.parametrize(("least", "reached"), [(0.5, False), (0.98, True)])
def test_the_last_solution_is_certified(least, reached):
    """At a limit the dual is solved, and if its bound meets the tolerance there is no reason."""
    stopping, last = stopping_by(Tolerance(0.05), seconds=1e-9), solution(least, 1.0)
    assert stopping.judged(solution(0.0, 1.0, certified=last)) is last
    assert stopping.levels == [last.level]
    assert stopping.ended
    assert stopping.reached == reached
    assert bool(stopping.reason) != reached


def test_a_stalled_solver_ends_it_where_the_bounds_stay():
    """Not at once: only if two more meshes have hardly improved them."""
    stopping, stalled = stopping_by(Tolerance(0.01)), solution(0.5, 1.0, stalled="CG has stalled")
    for reason in ("", "", "CG has stalled"):
        stopping.judged(stalled)
        assert stopping.reason == reason


@pytest.mark.parametrize(
    ("lower", "upper", "reached", "undecidable"),
    [
        (0.5, 0.904, True, False),
        (0.5, 0.906, False, False),
        (1.106, 2.0, True, False),
        (1.104, 2.0, False, False),
        (0.906, 1.104, False, True),
        (0.904, 1.104, False, False),
        (0.906, 1.106, False, False),
    ],
)
def test_a_margin_widens_the_bounds_of_a_decision(lower, upper, reached, undecidable):
    """Bounds over the limit, beside a margin of e^0.1 = 1.1052: a limit is decided beyond it, and
    no mesh decides one that both bounds are within it of."""
    decision, found = Decision(limit=0.5, unit=0.5, margin=0.1), solution(lower, upper)
    assert decision.reached(found) == reached
    assert ("uncertainty of the lift, " in decision.why_undecidable(found)) == undecidable
    assert Decision(limit=0.5, unit=0.5).why_undecidable(found) == ""
