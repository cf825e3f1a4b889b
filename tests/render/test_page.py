"""The page copies drawings pixel for pixel, is written whole or not at all, and names units."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from fem_seal.errors import InvalidInput
from fem_seal.render import page
from fem_seal.render.colours import colour_map
from fem_seal.render.page import CONSTRICTION, INLET, OUTLET, Panel, Swatch, write_page
from fem_seal.render.window import Scale, Window

WINDOW = Window(0.0, 4e-6, 0.0, 3e-6)
SCALE = Scale("gap [nm]", 0.0, 50.0)
FRAME = 3  # pixels inside the drawing that the frame's line of 0.8 pt may cover


def noise(shape=(300, 400), seed=0):
    return np.random.default_rng(seed).integers(0, 256, (*shape, 3)).astype(np.uint8)


def read(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def find(drawing, written):
    """Upper left corner of a drawing in the page, by its middle row."""
    inner = drawing[FRAME:-FRAME, FRAME:-FRAME]
    h, w = inner.shape[:2]
    for y, x in np.argwhere((written == inner[0, 0]).all(axis=2)):
        if np.array_equal(written[y : y + h, x : x + w], inner):
            return y - FRAME, x - FRAME
    raise AssertionError("the drawing is not in the page pixel for pixel")


def test_drawings_are_copied_pixel_for_pixel(tmp_path):
    rows = [
        [Panel(noise(seed=1), WINDOW, "first"), Panel(noise(seed=2), WINDOW)],
        [Panel(noise((240, 320), seed=3), WINDOW)],
    ]
    key = [Swatch("contact", (0, 0, 0))]
    written = read(write_page(rows, tmp_path / "page.png", scale=SCALE, key=key))
    places = [find(panel.pixels, written) for row in rows for panel in row]
    assert places[0][0] == places[1][0]  # one row
    assert places[0][1] + 400 < places[1][1]
    assert places[0][0] + 300 < places[2][0]
    assert places[0][1] == places[2][1]
    # Below the last drawing there is room for its axis and, under that, for the key.
    below = written.shape[0] - (places[2][0] + 240)
    assert below == page._dots(page.BOTTOM) + page._dots(page.KEY)


def test_bar_runs_through_the_colours_of_its_scale(tmp_path):
    blank = Panel(np.full((600, 400, 3), 255, np.uint8), WINDOW)
    written = read(write_page([[blank]], tmp_path / "page.png", scale=SCALE))
    for level in (0.1, 0.5, 0.9):
        colour = 255 * np.array(colour_map(SCALE.colours)(level)[:3])
        assert (np.abs(written - colour).max(axis=2) < 2).any()


def test_axes_and_bar_state_their_units(tmp_path):
    panel = Panel(noise(), WINDOW)
    # Lettering as text instead of outlines, to read it back.
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):
        figure = Figure()
        page._place(figure, panel, page._Box(100, 100, 400, 300))
        page._add_bar(figure, SCALE, page._Box(100, 100, 400, 300))
    axes, bar = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [µm], flow →", "y [µm]")
    assert axes.get_xlim() == pytest.approx((0, 4))
    assert bar.get_ylabel() == "gap [nm]"
    assert bar.get_ylim() == pytest.approx((0, 50))
    path = write_page([[panel]], tmp_path / "page.svg", scale=SCALE)
    assert path.read_text().startswith("<?xml")


@pytest.mark.parametrize(("log", "low", "high"), [(True, 1e-12, 1e-8), (False, -1.0, 3.0)])
def test_limits_of_the_bar_are_those_of_the_scale(log, low, high):
    figure = Figure()
    page._add_bar(figure, Scale("s", low, high, log), page._Box(0, 0, 10, 1000))
    (bar,) = figure.axes
    assert bar.get_ylim() == pytest.approx((low, high), rel=1e-9, abs=0)
    assert bar.get_yscale() == ("log" if log else "linear")


@pytest.mark.parametrize(
    ("low", "high", "names"),
    [
        (0.5, 500.0, ["0.5", "1", "10", "100", "500"]),
        (2e-11, 1e-9, [r"$2 \cdot 10^{-11}$", "$10^{-10}$", "$10^{-9}$"]),
        (0.9, 1000.0, ["0.9", "10", "100", "1000"]),  # 1 is too close to 0.9
        (1.0, 10.0, ["1", "10"]),
    ],
)
def test_logarithmic_bars_name_their_ends_and_the_decades(low, high, names):
    figure = Figure()
    page._add_bar(figure, Scale("s", low, high, True), page._Box(0, 0, 10, 1000))
    (bar,) = figure.axes
    assert [text.get_text() for text in bar.get_yticklabels()] == names
    assert not any(text.get_text() for text in bar.get_yticklabels(minor=True))
    assert bar.get_yticks()[[0, -1]] == pytest.approx((low, high))


@pytest.mark.parametrize("height", [240, 480, 1200])
@pytest.mark.parametrize("low", [1e-15, 2e-15, 5e-15, 8e-15])
def test_names_beside_a_logarithmic_bar_do_not_collide(low, height):
    """On one decade up to the five of a bar in a strip of small drawings."""
    for decades in (1, 2, 5):
        figure = Figure(figsize=(4, 8), dpi=page.DPI)
        scale = Scale("s", low, low * 10.0**decades, True)
        page._add_bar(figure, scale, page._Box(100, 100, 30, height))
        figure.canvas.draw()
        boxes = [text.get_window_extent() for text in figure.axes[0].get_yticklabels()]
        if height / page.DPI > len(boxes) * page.NAME_HEIGHT:
            assert not any(one.overlaps(next_) for one, next_ in pairwise(boxes))


def test_inlet_and_outlet_are_coloured_and_named_where_they_are_shown(tmp_path):
    """The panel says which edges they are; a part in the middle of a seal shows neither."""
    blank = np.full((300, 400, 3), 255, np.uint8)
    for ends in ((True, True), (False, True), (False, False)):
        figure = Figure()
        page._place(figure, Panel(blank, WINDOW, ends=ends), page._Box(100, 100, 400, 300))
        names = [text.get_text() for text in figure.axes[0].texts]
        both = zip(("inlet", "outlet"), ends, strict=True)
        assert names == [name for name, shown in both if shown]
        written = read(write_page([[Panel(blank, WINDOW, ends=ends)]], tmp_path / "page.png"))
        for swatch, shown in zip((INLET, OUTLET), ends, strict=True):
            assert ((written == swatch.colour).all(axis=2).sum() > 300) == shown


@pytest.mark.parametrize(("place", "shown"), [((1e-6, 1e-6), True), ((9e-6, 1e-6), False)])
def test_the_constriction_has_a_ring_and_an_entry_in_the_key(tmp_path, place, shown):
    panel = Panel(np.full((300, 400, 3), 200, np.uint8), WINDOW, constriction=place)
    assert panel.marked is shown
    plain = read(write_page([[Panel(panel.pixels, WINDOW)]], tmp_path / "plain.png"))
    written = read(write_page([[panel]], tmp_path / "page.png"))
    assert (written.shape[0] > plain.shape[0]) is shown  # the key
    left, below = page._dots(page.LEFT), page._dots(page.TOP)
    drawing = written[below : below + 300, left : left + 400]
    dark = np.argwhere((drawing == CONSTRICTION.colour).all(axis=2)[FRAME:-FRAME, FRAME:-FRAME])
    assert bool(len(dark)) is shown
    if shown:
        y, x = dark.mean(axis=0) + FRAME
        assert (x, 300 - y) == pytest.approx((100, 100), abs=1)


def test_panels_with_bars_of_their_own_do_not_overlap(tmp_path):
    """The neighbour begins to the right of the bar and its numbers."""
    panels = [Panel(noise(seed=k), WINDOW, scale=SCALE) for k in (1, 2)]
    written = read(write_page([panels], tmp_path / "page.png"))
    (_, first), (_, second) = (find(panel.pixels, written) for panel in panels)
    assert second - first > 400 + page._dots(page.BAR_GAP + page.BAR + page.BAR_LABELS + page.LEFT)
    # A column without ink between the label of the bar and that of the neighbour's axis.
    between = written[:, first + 400 : second]
    blank = (between == 255).all(axis=(0, 2))
    assert blank[page._dots(page.BAR_GAP + page.BAR) :].any()


def test_a_stretched_drawing_says_so():
    assert Panel(noise((240, 1200)), Window(0, 100, 0, 1)).heading == "y stretched 20 times"
    assert Panel(noise((400, 100)), Window(0, 1, 0, 8), "a").heading == "a, x stretched 2 times"
    assert Panel(noise(), WINDOW, "true").heading == "true"


def test_narrow_pages_hold_their_key(tmp_path):
    key = [Swatch(f"a rather long name number {k}", (40 * k, 0, 0)) for k in range(5)]
    narrow = Panel(np.full((400, 100, 3), 255, np.uint8), Window(0, 1, 0, 4))
    written = read(write_page([[narrow]], tmp_path / "page.png", key=key))
    margin = page._dots(0.02)
    assert (written[:, :margin] == 255).all()
    assert (written[:, -margin:] == 255).all()
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
        write_page([[Panel(noise(), WINDOW)]], path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_bad_paths_are_refused(tmp_path):
    rows = [[Panel(noise(), WINDOW)]]
    with pytest.raises(InvalidInput, match=r"end in \.png, \.pdf, \.svg"):
        write_page(rows, tmp_path / "page.bmp")
    with pytest.raises(InvalidInput, match="not a folder"):
        write_page(rows, tmp_path / "nowhere" / "page.png")
    assert not list(tmp_path.iterdir())
