"""The page: what its axes, bars and keys say, where they stand, and that it is written whole."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from fem_seal.errors import InvalidInput
from fem_seal.render.colours import colour_map
from fem_seal.render.page import CONSTRICTION, INLET, OUTLET, Panel, Swatch, draw_page, write_page
from fem_seal.render.window import Scale, Window

WINDOW = Window(0.0, 4e-6, 0.0, 3e-6)
SCALE = Scale("gap [nm]", 0.0, 50.0)


def blank(shape=(300, 400)):
    return np.full((*shape, 3), 255, np.uint8)


def drawn(*panels):
    """Figure of a row of panels."""
    figure = Figure(figsize=(5 * len(panels), 4), layout="constrained")
    draw_page(figure, [panels])
    return figure


def read(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def test_axes_and_bar_state_their_units():
    """The drawing fills its window, to scale; the bar has its limits and colours."""
    figure = drawn(Panel(blank(), WINDOW, scale=SCALE))
    (axes,) = figure.axes
    (bar,) = axes.child_axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [µm], flow →", "y [µm]")
    assert axes.images[0].get_extent() == pytest.approx((0, 4, 0, 3))
    assert axes.get_box_aspect() == pytest.approx(3 / 4)
    assert bar.get_ylabel() == "gap [nm]"
    assert bar.get_ylim() == pytest.approx((0, 50))


def test_bar_runs_through_the_colours_of_its_scale(tmp_path):
    written = read(write_page([[Panel(blank(), WINDOW)]], tmp_path / "page.png", scale=SCALE))
    for level in (0.1, 0.5, 0.9):
        colour = 255 * np.array(colour_map(SCALE.colours)(level)[:3])
        assert (np.abs(written - colour).max(axis=2) < 2).any()


@pytest.mark.parametrize(("low", "high"), [(0.5, 500.0), (2e-11, 1e-9), (0.9, 1000.0), (1.0, 10.0)])
def test_logarithmic_bars_have_numbers(low, high):
    """Two at least, plain ones where they are short."""
    figure = drawn(Panel(blank(), WINDOW, scale=Scale("s", low, high, True)))
    figure.draw_without_rendering()
    (bar,) = figure.axes[0].child_axes
    shown = [
        label.get_text()
        for label, at in zip(bar.get_yticklabels(), bar.get_yticks(), strict=True)
        if low * (1 - 1e-9) <= at <= high * (1 + 1e-9) and label.get_text()
    ]
    assert len(shown) >= 2
    assert any("$" in text for text in shown) == (low < 1e-3)


def test_inlet_and_outlet_are_coloured_and_named_where_they_are_shown(tmp_path):
    """The panel says which edges they are; a part in the middle of a seal shows neither."""
    for ends in ((True, True), (False, True), (False, False)):
        panel = Panel(blank(), WINDOW, ends=ends)
        names = [text.get_text() for text in drawn(panel).axes[0].texts]
        assert names == [n for n, shown in zip(("inlet", "outlet"), ends, strict=True) if shown]
        written = read(write_page([[panel]], tmp_path / "page.png"))
        for swatch, shown in zip((INLET, OUTLET), ends, strict=True):
            assert ((written == swatch.colour).all(axis=2).sum() > 300) == shown


@pytest.mark.parametrize(("place", "shown"), [((1e-6, 1e-6), True), ((9e-6, 1e-6), False)])
def test_the_constriction_has_a_ring_and_an_entry_in_the_key(tmp_path, place, shown):
    panel = Panel(np.full((300, 400, 3), 200, np.uint8), WINDOW, constriction=place)
    assert panel.marked is shown
    plain = read(write_page([[Panel(panel.pixels, WINDOW)]], tmp_path / "plain.png"))
    written = read(write_page([[panel]], tmp_path / "page.png"))
    assert (written.shape[0] > plain.shape[0]) is shown  # the key
    rings = drawn(panel).axes[0].lines
    assert bool(rings) is shown
    if shown:
        assert rings[-1].get_markeredgecolor() == pytest.approx(np.array(CONSTRICTION.colour) / 255)
        assert [*rings[-1].get_xydata()[0]] == pytest.approx([1, 1])


def test_panels_with_bars_of_their_own_do_not_overlap():
    """The neighbour begins to the right of the bar and its label."""
    figure = drawn(*(Panel(blank(), WINDOW, scale=SCALE) for _ in range(2)))
    figure.draw_without_rendering()
    first, second = (axes.get_tightbbox() for axes in figure.axes)
    assert first.x1 < second.x0


def test_a_stretched_drawing_says_so():
    assert Panel(blank((240, 1200)), Window(0, 100, 0, 1)).heading == "y stretched 20 times"
    assert Panel(blank((400, 100)), Window(0, 1, 0, 8), "a").heading == "a, x stretched 2 times"
    assert Panel(blank(), WINDOW, "true").heading == "true"


def test_narrow_pages_hold_their_key(tmp_path):
    key = [Swatch(f"a rather long name number {k}", (40 * k, 0, 0)) for k in range(5)]
    narrow = Panel(blank((400, 100)), Window(0, 1, 0, 4))
    written = read(write_page([[narrow]], tmp_path / "page.png", key=key))
    for edge in (written[:, :3], written[:, -3:], written[:3], written[-3:]):
        assert (edge == 255).all()
    for swatch in key:
        assert (written == swatch.colour).all(axis=2).sum() > 50


def test_a_failed_picture_leaves_the_old_one_and_no_rubbish(tmp_path, monkeypatch):
    path = tmp_path / "page.png"
    path.write_bytes(b"old")

    def half_written(figure, target, **options):
        target.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(Figure, "savefig", half_written)
    with pytest.raises(KeyboardInterrupt):
        write_page([[Panel(blank(), WINDOW)]], path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_bad_paths_are_refused(tmp_path):
    rows = [[Panel(blank(), WINDOW)]]
    with pytest.raises(InvalidInput, match=r"end in \.png, \.pdf, \.svg"):
        write_page(rows, tmp_path / "page.bmp")
    with pytest.raises(InvalidInput, match="not a folder"):
        write_page(rows, tmp_path / "nowhere" / "page.png")
    assert not list(tmp_path.iterdir())
