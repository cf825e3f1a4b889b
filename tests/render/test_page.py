"""The page copies drawings pixel for pixel, is written whole or not at all, and names units."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from fem_seal.errors import InvalidInput
from fem_seal.render import page
from fem_seal.render.colours import colour_map
from fem_seal.render.offscreen import Scale, Window
from fem_seal.render.page import Panel, Swatch, write_page

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
    page._add_bar(figure, Scale("s", low, high, log), page._Box(0, 0, 10, 100))
    (bar,) = figure.axes
    assert bar.get_ylim() == pytest.approx((low, high), rel=1e-9, abs=0)
    assert bar.get_yscale() == ("log" if log else "linear")


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
