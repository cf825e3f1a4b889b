"""Meshes are integrated and corrected a batch of cells after the other: where one batch ends and
the next begins must not show in the bounds."""

import numpy as np
import pytest
from drawn_stripes import Case
from gaps import level_problem, represented, solved
from sample_gaps import rough_gap

from fem_seal.flow import hierarchical
from fem_seal.flow.integrals import AT_ONCE


@pytest.mark.parametrize(("representation", "periodic"), [("linear", True), ("constant", False)])
def test_bubbles_in_small_batches(representation, periodic, monkeypatch):
    """The cells of an edge belong to one bubble, in whatever batch they are: apart, each would
    have a bubble of its own, the pressure could jump and the bounds would cross the truth. The
    same sums in another order: 1e-12. Contact lines part bubbles of their own."""
    gap = represented(rough_gap((8, 8), 0.3, 8), representation)
    markings = [lambda mesh: mesh.cells[:, 0] % 3 == 0] * 3
    problem = level_problem(gap, 1, periodic, markings=markings)
    found = solved(problem)
    whole = problem.corrected(*found).numbers
    monkeypatch.setattr(hierarchical, "QUARTERED_AT_ONCE", 3)
    assert problem.corrected(*found).numbers == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize(("periodic", "contact"), [(True, 0.3)])
def test_bubbles_in_small_blocks(periodic, contact, monkeypatch):
    """No bubble stands on the rim of a block: with as many steps as it takes, fewer bubbles find
    no lower energies, as they would if the halves of one were free of each other, but the energies
    of admissible functions. The sums differ in order: 1e-12."""
    markings = [lambda mesh: mesh.cells[:, 0] % 3 == 0] * 3
    problem = level_problem(represented(rough_gap((8, 8), contact, 8)), 1, periodic, 1e-8, markings)
    found = solved(problem)
    assert 300 < len(problem.mesh.cells) < 600
    monkeypatch.setattr(hierarchical, "STEPS", 40)
    whole = problem.corrected(*found).numbers
    for block in (1, 50, 300):
        monkeypatch.setattr(hierarchical, "BLOCK", block)
        lower, upper = problem.corrected(*found).numbers
        assert 1 / found[1].upper_bound().item() <= lower < whole[0] * (1 + 1e-12)
        assert whole[1] * (1 - 1e-12) < upper <= found[0].upper_bound().item()
    # Two blocks, and a small part of the bubbles between them.
    assert lower > (found[1].conductance + whole[0]) / 2
    assert upper < (found[0].energies.item() + whole[1]) / 2


@pytest.mark.parametrize("along", [False, True])
def test_closed_forms_over_several_batches(along):
    """A channel g(y), or one g(x): on all levels one of the bounds is exact, on the last one the
    sum over several batches. Bounds are widened by 1e-12; CG stops at 2e-8 of the energy at most,
    and starts from what is exact."""
    heights = 1 + 0.3 * np.sin(5 * np.linspace(0, 1, 49))
    kind = "along" if along else "across"
    case = Case(kind, heights, 49, (1 / 48, 1 / 48), "wall", "linear", "uniform")
    flow = case.solve(10_000, rtol=1e-9)
    assert flow.levels[-1].cells > 4 * AT_ONCE
    for level in flow.levels:
        found = level.upper if along else level.lower
        assert found == pytest.approx(case.exact, rel=4e-8)
