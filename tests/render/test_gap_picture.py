"""The gap picture: its colours are those of the gap, its bar has round ends."""

import numpy as np
import pytest
from drawn_fields import colours_of, smooth_gap, stand_for
from PIL import Image

from fem_seal.digits import readable
from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.render.gap import CONTACT, draw_gap, gap_picture, gap_scale


def test_gap_can_be_recovered_from_its_colours():
    gap = smooth_gap((40, 24), 0.3, periodic=False)
    scale = gap_scale(gap.values)
    _, colours = colours_of(draw_gap, GridFilm(gap), scale)
    contact = gap.values == 0
    assert (colours[contact] == CONTACT.colour).all()
    parts = np.maximum(gap.values * scale.per_si / scale.low, 1)
    exact = np.log(parts) / np.log(scale.high / scale.low)
    assert stand_for(colours, scale.colours, exact)[~contact].all()


@pytest.mark.parametrize("length", [1e-9, 1e3])
def test_picture_is_unit_neutral(length):
    """Gap and plane measured in other units give the same drawing.

    The ends of the bar are round numbers, so that a unit is a power of ten.
    """
    gap = smooth_gap((30, 20), 0.3)
    other = GridField(gap.values * length, tuple(s * length for s in gap.spacing), True)
    drawn = [colours_of(draw_gap, GridFilm(g), gap_scale(g.values))[1] for g in (gap, other)]
    # Powers of ten in the unit of the bar round once: colours may move by one of 256 steps.
    assert np.abs(drawn[0].astype(int) - drawn[1]).max() <= 3


@pytest.mark.parametrize(
    ("metres", "number", "unit"),
    [(3e-9, 3, "nm"), (0.999e-6, 999, "nm"), (1e-6, 1, "µm"), (1e-3, 1, "mm"), (20.0, 20, "m")],
)
def test_readable_units(metres, number, unit):
    factor, symbol = readable(metres, "m")
    assert symbol == unit
    assert metres * factor == pytest.approx(number)


@pytest.mark.parametrize(
    ("least", "largest", "low", "high", "beyond"),
    [
        (3e-8, 1.5e-6, 0.02, 2.0, "neither"),  # both ends at a 1, 2 or 5
        (2e-6, 2e-6, 0.2, 2.0, "neither"),  # one decade at least
        (1e-12, 4e-6, 0.005, 5.0, "min"),  # three at most
    ],
)
def test_bar_is_no_longer_than_the_gap_needs(least, largest, low, high, beyond):
    """Contact, where the gap is 0, is not on the bar."""
    scale = gap_scale(np.array([[0.0, least], [largest, 0.0]]))
    assert (scale.low, scale.high) == pytest.approx((low, high), rel=1e-9)
    assert (scale.beyond, scale.logarithmic) == (beyond, True)


def test_closed_gap_is_all_contact(tmp_path):
    """A gap of 0 everywhere is drawn, although it has no scale."""
    closed = GridField(np.zeros((5, 5)), (1e-6, 1e-6))
    with Image.open(gap_picture(GridFilm(closed), tmp_path / "gap.png")) as image:
        pixels = np.asarray(image.convert("RGB"))
    assert (pixels == CONTACT.colour).all(axis=2).mean() > 0.6
    with pytest.raises(InvalidInput, match="zero everywhere"):
        gap_scale(closed.values)
