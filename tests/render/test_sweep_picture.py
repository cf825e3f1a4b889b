"""The picture of a sweep: every point is in it, its bounds and names where they can be read."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from fem_seal.errors import InvalidInput
from fem_seal.quantities.headline import SI, ShownUnit
from fem_seal.sweep import picture
from fem_seal.sweep.point import UNSETTLED, Point, failed
from fem_seal.sweep.summary import COLUMNS, groups

PRESSURE, SEED, RTOL = "contact.pressure", "surface.seed", "flow.rtol"


def point(*values, leak=None, lower=None, upper=None, state=None):
    state = state or ("leaking" if leak else "sealed")
    ends = {"lower": lower, "upper": upper, "together_lower": lower, "together_upper": upper}
    return Point(values, True, "", state, leak_rate=leak, contact_area_fraction=0.1, **ends)


FALLING = tuple(
    point(f"{p} MPa", leak=10.0**-k, lower=0.8 * 10.0**-k, upper=1.3 * 10.0**-k)
    for p, k in ((0.1, 14), (0.2, 16), (0.3, 19))
)
SEALED = point("0.4 MPa", leak=0.0, lower=0.0, upper=0.0)


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """Function that draws a table, in a unit; the axes of the picture, which is not written."""
    figure = Figure(figsize=(6.4, 4.4), dpi=100)
    monkeypatch.setattr(picture, "new_figure", lambda size, path: nullcontext(figure))

    def drawn(keys, table, shown=SI):
        picture.sweep_figure(keys, table, tmp_path, shown)
        figure.canvas.draw()
        return figure.axes[0]

    return drawn


def bars(axes):
    """Ends of the bars, (n, 2)."""
    return [bar.get_segments()[0][:, 1] for bar in axes.collections]


def test_line_and_bars_are_leak_rates_and_their_ranges_with_all_errors(drawn):
    wide = [replace(p, together_lower=p.lower / 9, together_upper=9 * p.upper) for p in FALLING]
    axes = drawn((PRESSURE,), wide, ShownUnit("ml/h", 3.6e9))
    line = axes.lines[0]
    assert line.get_linestyle() == "-"
    np.testing.assert_allclose(line.get_xdata(), [0.1, 0.2, 0.3])
    np.testing.assert_allclose(line.get_ydata(), [3.6e-5, 3.6e-7, 3.6e-10])
    ends = [[p.lower / 9, 9 * p.upper] for p in FALLING]
    np.testing.assert_allclose(bars(axes), 3.6e9 * np.array(ends))
    assert axes.get_yscale() == "log"
    assert axes.get_title() == "bars: all counted errors; open: not settled"


def test_the_bar_of_a_lower_bound_of_zero_reaches_to_the_edge(drawn):
    axes = drawn((PRESSURE,), (*FALLING, point("0.4 MPa", leak=1e-20, lower=0.0, upper=1e-20)))
    assert axes.lines[0].get_ydata()[-1] == 1e-20
    assert bars(axes)[-1] == pytest.approx([axes.get_ylim()[0], 1e-20])


def test_sealed_and_lifted_off_stand_on_the_edges_below_and_above_the_others(drawn):
    off = point("0.05 MPa", state="lifted off")
    points = [replace(p, values=(*p.values, k)) for p in (off, *FALLING, SEALED) for k in "12"]
    axes = drawn((PRESSURE, SEED), points)
    marks = {line.get_marker(): line for line in axes.lines}
    for mark, place in ("x", (0.4, 0.0)), ("^", (0.05, 1.0)):
        at = marks[mark].get_transform().transform(marks[mark].get_xydata()[0])
        np.testing.assert_allclose(at, axes.get_xaxis_transform().transform(place))
    bottom, top = axes.get_ylim()
    assert bottom < min(p.lower for p in FALLING) < max(p.upper for p in FALLING) < top
    assert {"sealed", "lifted off", "  2 of 2"} <= {text.get_text() for text in axes.texts}


def test_over_seeds_the_line_is_the_median(drawn):
    rates = {"0.1 MPa": (1e-14, 3e-14, 9e-14), "0.2 MPa": (1e-18, 1e-16, 0.0)}
    table = [
        point(pressure, str(seed), leak=rate, lower=rate, upper=rate)
        for pressure, of_seeds in rates.items()
        for seed, rate in enumerate(of_seeds)
    ]
    axes = drawn((PRESSURE, SEED), table)
    median = next(ln for ln in axes.lines if ln.get_linestyle() == "-" and ln.get_color() == "C0")
    # The sealed surface counts as 0.
    np.testing.assert_allclose(median.get_ydata(), [3e-14, 1e-18])
    assert "  1 of 3" in [text.get_text() for text in axes.texts]


def unsettled(*values, lower, upper):
    ends = {"together_lower": lower, "together_upper": upper}
    return Point(values, False, "", UNSETTLED, contact_area_fraction=0.1, **ends)


def test_points_that_have_not_settled_are_open_and_no_median_counts_them(drawn):
    """In no line and on no edge; the bar is the range, to the edge where that has no end."""
    rates = dict(enumerate((1e-14, 3e-14, 9e-14)))
    table = [point("0.1 MPa", str(k), leak=q, lower=q, upper=q) for k, q in rates.items()]
    ranges = [(1e-18, 4e-18), (0.0, 1e-16), (1e-17, None)]
    table += [
        unsettled("0.1 MPa", str(3 + k), lower=low, upper=high)
        for k, (low, high) in enumerate(ranges)
    ]
    table += [failed(("0.1 MPa", "6"), "")]  # it failed
    axes = drawn((PRESSURE, SEED), table)
    markers = [line for line in axes.lines if line.get_markerfacecolor() == "white"]
    heights = [line.get_ydata()[0] for line in markers]
    np.testing.assert_allclose(heights, [2e-18, 1e-16, 1e-17])
    *_, closed, low, high = bars(axes)
    np.testing.assert_allclose(closed, [1e-18, 4e-18])
    assert low[0] < 1e-18
    assert high[1] > 9e-14
    median = next(ln for ln in axes.lines if ln.get_linestyle() == "-" and ln.get_color() == "C0")
    np.testing.assert_allclose(median.get_ydata(), [3e-14])
    assert "x" not in [line.get_marker() for line in axes.lines]
    assert axes.get_title().startswith("line: median of the seeds that have settled; ")
    (group,) = groups((PRESSURE, SEED), table)
    row = dict(zip(COLUMNS, group.row(), strict=True))
    assert [row[k] for k in COLUMNS[:6]] == [7, 3, 0, 0, 3, 4]
    assert (row["median"], row["lowest"]) == (3e-14, 1e-14)
    assert row["decades"] == pytest.approx(np.log10(3), rel=1e-12)  # of 1, 3 and 9


def test_a_rate_of_zero_is_sealed_only_where_the_state_says_so():
    """Finite differences that stop short leave "leaking, 0": neither sealed nor leaking."""
    table = [SEALED, point("0.4 MPa", leak=0.0, state="leaking")]
    row = dict(zip(COLUMNS, groups((PRESSURE,), table)[0].row(), strict=True))
    assert [row[k] for k in COLUMNS[:6]] == [2, 0, 1, 0, 0, 1]


def test_seeds_alone_are_not_joined(drawn):
    table = [point(str(k), leak=k * 1e-16, lower=k * 0.9e-16, upper=k * 1.1e-16) for k in (1, 2, 3)]
    axes = drawn((SEED,), table)
    assert {line.get_linestyle() for line in axes.lines} == {"None"}
    assert "median" not in axes.get_title()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ([SEALED], "no point of the sweep has a leak rate above 0"),
        ([point("1 MPa", str(k), leak=1e-16) for k in range(11)], "would have 11 curves"),
    ],
)
def test_nothing_or_too_much_to_draw_is_refused(table, message, tmp_path):
    keys = (PRESSURE, RTOL)[: len(table[0].values)]
    with pytest.raises(InvalidInput, match=message):
        picture.sweep_figure(keys, table, tmp_path)
    assert not list(tmp_path.iterdir())
