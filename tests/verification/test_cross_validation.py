"""Methods side by side: same gap on every grid, true errors of the right sign and order."""

import csv
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from gaps import bracketed
from sample_gaps import rough_gap

from fem_seal.cli.study import _cross_validation_text
from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings
from fem_seal.grid import GridField
from fem_seal.leak_rate import Bounded, relative_width
from fem_seal.limits import Limits
from fem_seal.tables import as_csv, as_text, markdown
from fem_seal.verification.cross_validation import StudiedGap, compare, judge
from fem_seal.verification.exact_cases import CASES, finer_film
from fem_seal.verification.methods import METHODS, Answer
from fem_seal.verification.pictures import claims_figure, cross_validation_figure

SETTING = FlowSettings(1 / 12, 1.0, rtol=0.05)
GAP = rough_gap((16, 16), 0.3, 4)
FILM = GridFilm(GAP, sides="periodic")


def on_case(case, squares, methods):
    """Rows of one exact case."""
    return compare([StudiedGap.of_case(case, squares)], methods)[0][0]


def on_film(film, setting, grids, methods=tuple(METHODS)):
    """Rows and bracket of one film."""
    return compare([StudiedGap.of_film(film, setting, grids)], methods)[0]


def test_what_cannot_be_compared_is_refused():
    """A sealed gap has no relative errors; methods without bounds have no reference."""
    values = GAP.values.copy()
    values[5] = 0
    film = GridFilm(GridField(values, GAP.spacing, GAP.periodic), sides="periodic")
    with pytest.raises(InvalidInput, match="sealed"):
        on_film(film, SETTING, 2)
    with pytest.raises(InvalidInput, match="uniform"):
        on_film(FILM, SETTING, 2, ("harmonic",))


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("shape", [(6, 8), (5, 7)])
@pytest.mark.parametrize("periodic", [False, True])
def test_refining_the_samples_changes_nothing(representation, shape, periodic):
    """The second mesh of the gap is the first of its refinement: the same energies.

    CG stops at a relative energy error of 1e-8 on each, right within a factor of two, and the
    correction of the bounds adds the error's square root times their change, at most 0.3 here.
    """
    values = 0.2 + np.random.default_rng(1).random(shape)
    gap = GridField(values, (1.0, 0.5), periodic)
    film = GridFilm(gap, representation=representation)
    second, first = (
        bracketed(one, 1e-6, unknowns, method="uniform").levels[-1]
        for one, unknowns in ((film, 4 * values.size), (finer_film(film), 1))
    )
    assert first.unknowns == second.unknowns
    tolerance = 0.3 * np.sqrt(2e-8)
    assert first.upper == pytest.approx(second.upper, rel=tolerance)
    assert first.lower == pytest.approx(second.lower, rel=tolerance)


def series(rows, method):
    chosen = [row for row in rows if row.method == method]
    assert chosen, method
    return chosen


def assert_order(rows, method, expected, within):
    """The order between the finer two of three grids; that of the coarser two is further off.

    The next term of the error is smaller by some power of the spacing, and so is the distance of an
    observed order from the expected one: at most two thirds on grids twice as fine. Where the first
    pair of grids has it to 1 % by chance, nothing of this shows.
    """
    first, coarse, fine = (row.order for row in series(rows, method))
    assert first is None
    assert abs(fine - expected) < within, (method, coarse, fine)
    assert abs(fine - expected) < max(2 / 3 * abs(coarse - expected), 0.01), (method, coarse, fine)


@pytest.mark.parametrize(
    ("name", "order"), [("cosine-across", 2), ("cosine-along", 2), ("smooth-checkerboard", 2)]
)
def test_order_of_smooth_cases(name, order):
    """In the spacing, for both bounds, from sampling and from elements alike."""
    rows = on_case(CASES[name], (16, 32, 64), ("uniform",))
    assert {row.expected for row in rows} == {order}
    for method in ("FE upper", "FE lower", "FE √(lo·hi)"):
        assert_order(rows, method, order, 0.05)


def test_an_exact_bracket_has_no_band(monkeypatch):
    """Bounds that agree leave none, however much they differ from those of the grid before."""

    def exact_bounds(film, settings):
        rate = float(len(film.gap.values))
        return Answer("FE", rate, rate, rate, 1, 0.0)

    monkeypatch.setitem(METHODS, "uniform", exact_bounds)
    rows = on_case(CASES["cosine-across"], (8, 16), ("uniform",))
    assert [row.band for row in series(rows, "FE √(lo·hi)")] == [0, 0]


@pytest.fixture(scope="module")
def checkerboard():
    """Rows of the board on three grids."""
    return on_case(CASES["checkerboard"], (8, 16, 32), ("uniform", "harmonic", "arithmetic"))


def test_checkerboard_shows_the_order_of_its_corner(checkerboard):
    """Bounds converge as h^(2a), a = (4/π) atan √(K1/K2) < 1, and enclose √(K1 K2)."""
    case, rows = CASES["checkerboard"], checkerboard
    for method, side in (("FE upper", "high"), ("FE lower", "low")):
        assert series(rows, method)[-1].verdict == side
        assert_order(rows, method, case.order, 0.03)
    # Halves in series break every path, halves side by side open every one.
    assert series(rows, "FD harmonic")[-1].verdict == "low"
    assert series(rows, "FD arithmetic")[-1].verdict == "high"
    # Turned by a right angle the board is its own inverse: the geometric mean is exact, but for
    # the root of CG's 1e-8 times the correction of the bounds, less than their half-width.
    for row in series(rows, "FE √(lo·hi)"):
        assert abs(row.error) <= 1e-4 * row.band
        assert (row.verdict, row.order, row.effectivity) == ("exact", None, None)


def test_effectivity_is_that_of_the_claim(checkerboard):
    """Bounds claim at least their true error, to second order in it; arithmetic links too little.

    On the checkerboard those converge so slowly (order 0.78) that from one grid to the next the
    error falls by less than half of what is left.
    """
    rows = checkerboard
    for row in series(rows, "FE √(lo·hi)"):
        assert abs(row.distance) <= 1 + row.band
    for row in series(on_case(CASES["series-channel"], (8, 16), ("uniform",)), "FE √(lo·hi)"):
        assert row.effectivity > 1 - row.band
    last = series(rows, "FD arithmetic")[-1]
    assert last.effectivity == pytest.approx(1 / last.distance)
    assert last.effectivity < 1
    assert {row.effectivity for row in series(rows, "FE upper")} == {None}


def test_links_that_are_exact_in_series():
    """Linear-gap links are the closed form of the linear channel; so is the stream function y."""
    rows = on_case(CASES["series-channel"], (8, 16), ("linear-gap", "harmonic", "uniform"))
    for method in ("FD linear-gap", "FE lower"):
        assert {row.verdict for row in series(rows, method)} == {"exact"}
    assert {row.verdict for row in series(rows, "FD harmonic")} == {"low"}
    assert {row.verdict for row in series(rows, "FE upper")} == {"high"}


def test_a_rough_gap_is_judged_by_the_certified_bracket():
    rows, bracket = on_film(FILM, SETTING, grids=2)
    assert relative_width(bracket.lower, bracket.upper) <= SETTING.rtol
    assert {row.method.partition(" ")[0] for row in rows} == {"FD", "FE", "adaptive"}
    for row in rows:
        # Only finite differences, and only on the coarse grid, may err by more than the bracket.
        coarse = row.squares == 16 and row.method.startswith("FD")
        assert row.verdict in {"bound", "inside", "agrees"} or coarse
        if row.method.endswith("upper"):
            assert row.value >= bracket.lower
        if row.method.endswith("lower"):
            assert row.value <= bracket.upper
        if row.distance is not None:
            # The bracket is not quite even about √(lower·upper).
            margin = SETTING.rtol * (abs(row.distance) + 1)
            assert (row.verdict == "disagrees") == (abs(row.distance) > 1) or (
                abs(abs(row.distance) - 1) < margin
            )
    # Nobody's number takes part in the bracket but the bounds'.
    assert bracket.lower in [row.value for row in rows if row.method.endswith("lower")]


def test_limits_of_the_flow_end_the_adaptive_method():
    limited = replace(SETTING, rtol=1e-4, limits=Limits(unknowns=1000))
    assert METHODS["adaptive"](FILM, limited).unknowns <= 1000


def test_a_gap_that_links_do_not_follow_has_no_answer_by_them(tmp_path):
    """The gap is open along the diagonals of its triangles only: the five-point stencil finds no
    path on the first grid, and its 0 is no leak rate."""
    film = GridFilm(GridField(np.eye(6), (1.0, 1.0)))
    rows, reference = on_film(film, SETTING, 2, ("linear-gap", "uniform"))
    first, second = series(rows, "FD linear-gap")
    assert (first.value, first.verdict, first.band) == (0, "no answer", None)
    assert "only along diagonals" in first.reason
    # Nothing is known of the error of the first number either.
    assert (second.value > 0, second.verdict, second.band) == (True, "outside", None)
    text = _cross_validation_text({"": (rows, reference)}, slips=False)
    assert f"FD linear-gap on 6: {first.reason}" in text
    for draw in (claims_figure, partial(cross_validation_figure, reference=reference)):
        draw(rows, tmp_path / "a.png", title="diagonal")
        assert (tmp_path / "a.png").stat().st_size > 0
        (tmp_path / "a.png").unlink()


def test_the_judge():
    reference = Bounded(1.0, 0.99, 1.01)
    assert judge(0.8, None, reference) == "outside"
    assert judge(0.8, 0.1, reference) == "disagrees"
    assert judge(0.8, 0.3, reference) == "agrees"
    assert judge(1.0, 0.3, reference) == "inside"


def test_an_unknown_method_lists_those_there_are():
    with pytest.raises(InvalidInput, match=", ".join(METHODS)):
        on_film(FILM, SETTING, 1, ("adaptive", "magic"))


def test_tables_hold_every_cell():
    rows = on_case(CASES["cosine-along"], (8,), ("harmonic",))
    header, line = csv.reader(as_csv(rows).splitlines())
    assert float(line[header.index("value")]) == rows[0].value
    assert line[header.index("band")] == ""
    assert as_text(rows, ("method",)) == "method\nFD harmonic"
    # People read units, programs the names of the fields.
    assert as_text(rows, ("value", "order")).splitlines()[0] == "Q [m^3/s]  order"
    assert markdown("ab", ["cd"]) == "| a | b |\n| --- | --- |\n| c | d |"
    with pytest.raises(InvalidInput, match="nothing"):
        as_csv([])
