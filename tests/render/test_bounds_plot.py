"""The plot of the bounds shows every level, except lower bounds and half-widths of zero."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fem_seal.errors import InvalidInput
from fem_seal.leak_rate import LevelRecord
from fem_seal.render import bounds_plot
from fem_seal.render.convergence import draw_bounds

LEVELS = tuple(
    LevelRecord(unknowns=n, cells=2 * n, lower=lower, upper=upper)
    for n, lower, upper in (
        (100, 0.0, 9e-15),
        (220, 1e-15, 6e-15),
        (500, 2.5e-15, 4e-15),
        (1100, 2.9e-15, 3.4e-15),
    )
)


def line(axes, label):
    (curve,) = (artist for artist in axes.lines if artist.get_label() == label)
    return np.array(curve.get_data())


def test_plotted_data_are_the_levels():
    figure = Figure()
    draw_bounds(figure, LEVELS)
    rates, widths = figure.axes
    assert {rates.get_xscale(), rates.get_yscale(), widths.get_xscale(), widths.get_yscale()} == {
        "log"
    }
    upper, lower = line(rates, "upper bound"), line(rates, "lower bound")
    np.testing.assert_array_equal(upper, [[100, 220, 500, 1100], [9e-15, 6e-15, 4e-15, 3.4e-15]])
    np.testing.assert_array_equal(lower[1], [np.nan, 1e-15, 2.5e-15, 2.9e-15])
    shown = np.array(widths.lines[0].get_data())
    np.testing.assert_allclose(shown[1], [1, 5 / 7, 1.5 / 6.5, 0.5 / 6.3])
    assert "m³/s" in rates.get_ylabel()
    # The thin line has slope -1, through the last level.
    x, y = line(widths, "∝ 1 / unknowns")
    assert np.diff(np.log(y)) / np.diff(np.log(x)) == pytest.approx(-1)
    assert y[-1] == pytest.approx(LEVELS[-1].half_width)


def test_exact_bounds_have_no_half_width_to_plot(tmp_path):
    exact = [LevelRecord(10, 20, 1.0, 1.0)]  # as in a uniform channel
    bounds_plot(exact, tmp_path / "bounds.png")
    assert (tmp_path / "bounds.png").stat().st_size > 1000


def test_no_levels_are_refused(tmp_path):
    with pytest.raises(InvalidInput, match="no bounds to plot"):
        bounds_plot((), tmp_path / "bounds.png")
    assert not list(tmp_path.iterdir())
