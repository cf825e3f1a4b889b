"""The page: what its axes, bars and keys say, where they stand, and that it is written whole."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.colours import INLET, OUTLET
from fem_seal.render.page import Window, add_bar, frame, frame_film, page, window_of
from fem_seal.render.scale import Scale

WINDOW = Window(0.0, 4e-6, 0.0, 3e-6)
SCALE = Scale("gap [nm]", 0.0, 50.0)


def film():
    gap = np.ones((5, 4))
    gap[2, 1:3] = 0.5  # the constriction
    gap[2, 3:] = gap[2, 0] = 0.0
    return GridFilm(GridField(gap * 1e-6, (1e-6, 1e-6)), "wall")


def framed(*arguments, **options):
    """Axes on a page of one panel."""
    axes = Figure(layout="constrained").subplots()
    frame_film(axes, *arguments, **options)
    return axes


def test_axes_and_bar_state_their_units():
    axes = framed(film())
    add_bar(axes, SCALE)
    axes.figure.draw_without_rendering()
    (bar,) = axes.child_axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [µm], flow →", "y [µm]")
    labels = dict(zip(axes.get_xticks(), map(float, texts(axes.get_xticklabels())), strict=True))
    assert [1e6 * place for place in labels] == pytest.approx(list(labels.values()))
    assert axes.get_box_aspect() == pytest.approx(3 / 4)
    assert bar.get_ylabel() == "gap [nm]"
    assert bar.get_ylim() == pytest.approx((0, 50))


def texts(labels):
    return [label.get_text().replace("\N{MINUS SIGN}", "-") for label in labels]


def test_inlet_and_outlet_are_coloured_and_named_where_they_are_shown():
    """A part in the middle of a seal shows neither."""
    whole = window_of(film())
    for window, names in (
        (whole, ["inlet", "outlet"]),
        (Window(1e-6, 4e-6, 0, 3e-6), ["outlet"]),
        (Window(1e-6, 2e-6, 0, 3e-6), []),
    ):
        axes = framed(film(), window)
        assert (*axes.get_xlim(), *axes.get_ylim()) == window
        assert [text.get_text() for text in axes.texts] == names
        for swatch, side in ((INLET, "left"), (OUTLET, "right")):
            drawn = np.allclose(axes.spines[side].get_edgecolor()[:3], swatch.rgb)
            assert drawn == (swatch.name in names)


@pytest.mark.parametrize(("window", "shown"), [(None, True), (Window(0, 1e-6, 0, 1e-6), False)])
def test_the_constriction_has_a_ring_and_an_entry_in_the_key(tmp_path, window, shown):
    path = tmp_path / "page.png"
    with page(WINDOW, path) as axes:
        frame_film(axes[0, 0], film(), window, marked=True)
    rings, names = axes[0, 0].get_legend_handles_labels()
    assert names == ["critical constriction"] * shown
    for ring in rings:
        assert [*ring.get_xydata()[0]] == pytest.approx(film().constriction.position)
    assert [*axes[0, 0].figure.legends] != [] if shown else axes[0, 0].figure.legends == []


@pytest.mark.parametrize(
    ("window", "title", "heading"),
    [
        (Window(0, 100, 0, 1), "", "y stretched 20 times"),
        (Window(0, 1, 0, 8), "a", "a, x stretched 1.6 times"),
        (WINDOW, "true", "true"),
    ],
)
def test_a_stretched_drawing_says_so(window, title, heading):
    axes = Figure().subplots()
    frame(axes, window, title)
    assert axes.get_title() == heading


def test_bad_paths_are_refused(tmp_path):
    with pytest.raises(InvalidInput, match=r"end in \.png, \.pdf, \.svg"):
        page(WINDOW, tmp_path / "page.bmp").__enter__()
    assert not list(tmp_path.iterdir())
    (tmp_path / "file").touch()
    with (
        pytest.raises(InvalidInput, match="cannot be written"),
        page(WINDOW, tmp_path / "file" / "page.png"),
    ):
        pass
    with page(WINDOW, tmp_path / "new" / "page.png"):
        pass
    assert (tmp_path / "new" / "page.png").is_file()
