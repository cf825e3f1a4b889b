"""Pictures of flow density, pressure and mesh show the values on the triangles."""

from contextlib import contextmanager

import numpy as np
import pytest
from drawn_fields import drawn_samples, structured_flow, table_of
from matplotlib.figure import Figure

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render import flow, offscreen
from fem_seal.render.colours import CONTACT, NO_FLOW
from fem_seal.render.offscreen import DrawnTriangles
from fem_seal.render.page import Window
from fem_seal.render.scale import Scale, pressure_scale

pytestmark = pytest.mark.render
OPEN = GridFilm(GridField(np.ones((21, 11)), (1e-6, 1e-6)))  # 20 by 10 µm
SIZE = (20e-6, 10e-6)
SIDE = 600  # 30 pixels per interval


def drawn_flow(field, film, scale):
    """Pixels (height, width, 3) of the triangles, and the colours (nx, ny, 3) drawn in the end."""
    axes = Figure().subplots()
    flow.draw_flow(axes, field, film, scale)
    return axes.images[0].get_array(), drawn_samples(axes, film)


def test_decades_of_flow_are_equal_steps_of_colour():
    """|j| = 10^(-9 + 4 x/Lx) on a scale of the four decades: position on the map = x/Lx."""
    field = structured_flow(20, 10, SIZE, lambda x: 10 ** (-9 + 4 * x))
    scale = Scale("|j|", 1e-9, 1e-5, True, flow.FLOW_COLOURS)
    pixels, _ = drawn_flow(field, OPEN, scale)
    height, width = pixels.shape[:2]
    middles = (np.arange(20) + 0.5) / 20
    at = (width * middles).astype(int)
    # The colour at the position or one beside it on the map, rounded.
    near = table_of(scale.colours)[(256 * middles).astype(int) + np.arange(-1, 2)[:, None]]
    assert np.abs(pixels[height // 2, at] - near).max(axis=2).min(axis=0).max() <= 1


@pytest.mark.parametrize("density", [0.0, 1e-9])
def test_flow_below_the_scale_has_the_colour_of_its_end(density):
    """White is left to what no flow can reach."""
    field = structured_flow(20, 10, SIZE, lambda x: density + 0 * x)
    scale = Scale("|j|", 1e-9, 1e-5, True, flow.FLOW_COLOURS)
    pixels, samples = drawn_flow(field, OPEN, scale)
    # The middle of the last samples lies on the rim.
    for colours in (pixels[::10, ::10], samples[:-1, :-1]):
        assert np.abs(colours - table_of(scale.colours)[0]).max() <= 1


@pytest.mark.parametrize(
    ("peak", "high"), [(3e-12, 5e-12), (1e-10, 1e-10), (1.01e-10, 2e-10), (7.0, 10.0)]
)
def test_scale_ends_above_the_peak_of_all_fields_and_spans_its_decades(peak, high):
    field = structured_flow(4, 4, SIZE, lambda x: np.where(x > 0.8, peak, 0.0))
    weaker = structured_flow(4, 4, SIZE, lambda x: 1e-3 * peak + 0 * x)
    for decades in (3, flow.DECADES):
        scale = flow.flow_scale(weaker, field, decades=decades)
        assert (scale.logarithmic, scale.beyond) == (True, "min")
        assert scale.high == pytest.approx(high, rel=1e-9)
        assert scale.high / scale.low == pytest.approx(10**decades)
    assert scale == flow.flow_scale(field)
    assert scale != flow.flow_scale(weaker)
    assert scale.label.endswith("[m²/s]")


def test_contact_covers_flow_cells_and_pockets_are_pale():
    """The one coarse row of cells reaches 1.5 samples into the contact."""
    values = np.ones((21, 11))
    values[14:, :] = 0.0
    values[17, 5] = 1.0  # a pocket
    values[14:, 10] = 1.0  # the channel to the outlet
    film = GridFilm(GridField(values, (1e-6, 1e-6)))
    field = structured_flow(1, 1, (15e-6, 10e-6), lambda x: 1e-6 + 0 * x)
    _, samples = drawn_flow(field, film, flow.flow_scale(field))
    pocket = (np.arange(21) == 17)[:, None] & (np.arange(11) == 5)
    for swatch, where in ((CONTACT, values == 0), (NO_FLOW, pocket)):
        np.testing.assert_array_equal((samples == swatch.colour).all(axis=2), where)


def test_pressure_is_interpolated_before_it_is_coloured(monkeypatch):
    """On one cell from 1 to 0 the colours follow the map, not the line between its two ends."""
    field = structured_flow(1, 1, SIZE, lambda x: 1 + 0 * x, lambda x: 1e5 * (1 - x))
    scale = pressure_scale("pressure", field.pressure)
    assert scale.label == "pressure [kPa]"
    assert (scale.low, scale.high) == pytest.approx((0.0, 100.0))
    values = field.pressure * scale.per_si
    layer = DrawnTriangles(field.points, field.cells, values=values, scale=scale)
    monkeypatch.setattr(offscreen, "LONG_SIDE", SIDE)
    pixels = offscreen.draw_layers([layer], Window(0, SIZE[0], 0, SIZE[1]))
    # A pixel is as wide as 256/600 colours of the map: the mean of those at its two ends, rounded.
    ends = 1 - np.stack([np.arange(SIDE), np.arange(1, SIDE + 1)]) / SIDE
    two = table_of(scale.colours)[np.clip((256 * ends).astype(int), 0, 255)]
    assert (two.min(axis=0) - 1 <= pixels[150]).all()
    assert (pixels[150] <= two.max(axis=0) + 1).all()


def test_isobars_lie_where_the_pressure_has_their_level(monkeypatch):
    """Pressure falls evenly from 1 to 0: lines at equal steps, as many as the bar shows."""
    field = structured_flow(20, 10, SIZE, lambda x: 1 + 0 * x, lambda x: 1e5 * (1 - x))
    scale = pressure_scale("pressure", field.pressure)
    assert scale.lines == pytest.approx(np.arange(10, 100, 10))
    pages = []

    @contextmanager
    def page(*arguments, key):
        pages.append(Figure().subplots(1, 1, squeeze=False))
        yield pages[0]

    monkeypatch.setattr(flow, "page", page)
    flow.pressure_picture(field, OPEN, "pressure.png")
    (lines,) = pages[0][0, 0].collections
    for level, line in zip(lines.levels, lines.get_paths(), strict=True):
        assert line.vertices[:, 0] == pytest.approx(SIZE[0] * (1 - level / 100), rel=1e-9)


def test_mesh_picture_has_a_detail_around_the_strongest_flow():
    field = structured_flow(20, 10, SIZE, lambda x: np.where(abs(x - 0.775) < 0.01, 5.0, 1.0))
    whole = Window(0, SIZE[0], 0, SIZE[1])
    window = flow.peak_window(field, whole)
    assert window.x0 < 15.5e-6 < window.x1
    assert window.x1 - window.x0 == pytest.approx(SIZE[0] / 8, rel=1e-9)
    assert window.y0 >= 0  # the strongest cell lies on the boundary: the window is moved inside


def test_a_field_without_flow_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="no flow field"):
        flow.flow_picture(None, OPEN, tmp_path / "flow.png")
    still = structured_flow(2, 2, SIZE, lambda x: 0 * x)
    with pytest.raises(InvalidInput, match="zero everywhere"):
        flow.flow_picture(still, OPEN, tmp_path / "flow.png")
    assert not list(tmp_path.iterdir())
