"""The bearing model is the surface's own height distribution."""

import numpy as np
import pytest
from project import scene_of_samples

from fem_seal.contact import bearing
from fem_seal.contact.settings import Load
from fem_seal.contact.state import PERIMETER_FACTOR
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.patch import Given, Patch
from fem_seal.scene import Scene
from fem_seal.surface import rms_height


@pytest.mark.parametrize("wanted", [0.01, 0.2, 0.5, 0.93])
def test_area(rough, wanted):
    state = bearing(rough, area_fraction=wanted)
    assert abs(state.contact_area_fraction - wanted) <= 0.5 / rough.values.size
    # The letter's formula, gap = max(0, d_free - Δd).
    free = rough.values.max() - rough.values
    assert np.abs(state.gap.values - np.maximum(0, free - state.shift)).max() < 1e-12 * free.max()
    # Cut, not pressed: contact is exactly the highest points.
    assert rough.values[state.contact].min() > rough.values[~state.contact].max()


@pytest.mark.parametrize("relative", [0.01, 0.4, 1.0, 3.0, 10.0])
def test_mean_gap(rough, relative):
    wanted = relative * rms_height(rough)
    state = bearing(rough, mean_gap=wanted)
    assert state.mean_gap == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("mean_gap", [1e-24, 1e-30, 1e-300])
def test_a_mean_gap_below_the_rounding_of_the_heights(mean_gap):
    """Heights of 1 µm are rounded by 1e-22 m."""
    heights = GridField(1e-6 * np.random.default_rng(1).random((16, 16)), (1e-6, 1e-6))
    with pytest.raises(InvalidInput, match="lost in the rounding"):
        bearing(heights, mean_gap=mean_gap)
    assert bearing(heights, mean_gap=1e-12).mean_gap == pytest.approx(1e-12, rel=1e-4)


def test_ties_touch_together():
    steps = GridField(np.repeat([0.0, 1.0, 2.0], 4).reshape(3, 4), (1.0, 1.0))
    assert bearing(steps, area_fraction=0.1).contact_area_fraction == pytest.approx(1 / 3)
    assert bearing(steps, area_fraction=0.0).contact_area_fraction == pytest.approx(1 / 3)


@pytest.mark.parametrize(("periodic", "edges"), [(False, 4), (True, 8)])
def test_the_edge_of_a_contact_at_a_border(periodic, edges):
    """The last row touches: it meets the first one only if the surface repeats."""
    steps = GridField(np.repeat([0.0, 1.0, 2.0], 4).reshape(3, 4), (1.0, 1.0), periodic)
    corrected = bearing(steps, area_fraction=0.1).contact_area_corrected
    assert corrected == pytest.approx(1 / 3 - PERIMETER_FACTOR * edges / 12)


def test_another_load_of_a_patch():
    """A pressure cuts nothing; what the scene does not give is named as such."""
    cut = {"contact": {"model": "bearing", "area_fraction": 0.2}, "output.products": ["contact"]}
    scene = Scene.from_mapping(scene_of_samples(16)).with_(cut | {"fluid": None, "flow": {}})
    half = Patch(scene).with_(Given(load=Load("area_fraction", 0.5)))
    assert half.contact.contact_area_fraction == 0.5
    with pytest.raises(InvalidInput, match="knows no pressure"):
        _ = half.with_(Given(load=Load("pressure", 1e5))).contact
    with pytest.raises(InvalidInput, match="elastic contact"):
        _ = half.elastic_state
    with pytest.raises(InvalidInput, match=r"\[fluid\] is missing"):
        _ = half.leak_rate
