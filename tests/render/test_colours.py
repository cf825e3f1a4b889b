"""In print without colour, contact differs from all other colours."""

import numpy as np
import pytest

from fem_seal.render import flow, samples, scale, shape
from fem_seal.render.colours import CONTACT, NO_FLOW, OPEN, colour_map

# Rec. 709: how light a printed colour is, 0 to 1.
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def lightness(colours):
    return np.asarray(colours, dtype=float) @ WEIGHTS / 255


@pytest.mark.parametrize(
    "name",
    [
        *(flow.FLOW_COLOURS, scale.PRESSURE_COLOURS, samples.GAP_COLOURS),
        samples.CONTACT_PRESSURE_COLOURS,
    ],
)
def test_maps_are_monotonic_and_darker_than_contact(name):
    """The lightness falls along the map and is a tenth of its range below that of contact."""
    shades = lightness(255 * colour_map(name)(np.linspace(0, 1, 256))[:, :3])
    steps = np.diff(shades)
    assert (steps > -1e-3).all() or (steps < 1e-3).all()
    assert abs(shades[-1] - shades[0]) > 0.55
    assert shades.max() < lightness(CONTACT.colour) - 0.1 < lightness(OPEN.colour) - 0.2


@pytest.mark.parametrize(
    "key", [samples.CONTACT_KEY, (*shape.BOUNDARIES.values(), CONTACT, NO_FLOW)]
)
def test_entries_of_a_key_differ_in_grey(key):
    shades = np.sort([lightness(swatch.colour) for swatch in key])
    assert np.diff(shades).min() > 0.1
