"""The threshold: one side of it leaks and the other does not."""

from functools import partial
from math import ceil, log

import numpy as np
import pytest

from fem_seal.contact import ElasticSolid, Load, bearing, press
from fem_seal.errors import Inconsistent, NotConverged
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.quantities.constriction import constriction
from fem_seal.quantities.of_patch import quantities
from fem_seal.scene import Scene
from fem_seal.threshold import (
    LOAD_RATIO,
    PRECISION,
    Threshold,
    threshold_of_cut,
    threshold_of_pressure,
)


@pytest.fixture
def scene(small_scene):
    """A dry contact and its threshold, nothing else."""

    def changed(**contact):
        small_scene["flow"] = {}
        small_scene["contact"] = contact
        small_scene["output"] = {"products": ["threshold"]}
        return Scene.from_mapping(small_scene)

    return changed


def sealed(gap):
    return GridFilm(gap, "periodic").sealed


def test_lowering_by_the_constriction_just_seals():
    values = np.random.default_rng(1).random((40, 40))
    gap = GridField(values, (1.0, 1.0), periodic=True)
    tightest = constriction(GridFilm(gap, "periodic"))
    found = threshold_of_cut(GridFilm(gap, "periodic"), "gap")
    for part, state, area in ((0.999999, False, found.area_leaking), (1, True, found.area_sealed)):
        lowered = np.maximum(values - part * tightest.gap, 0)
        assert sealed(GridField(lowered, (1.0, 1.0), periodic=True)) is state
        assert np.mean(lowered == 0) == area
    # One site of random heights decides.
    assert found.area_sealed - found.area_leaking == pytest.approx(1 / 1600)


def test_gap_that_is_sealed_has_no_threshold_of_its_own():
    assert threshold_of_cut(GridFilm(GridField(np.zeros((4, 4)), (1, 1))), "gap") is None


@pytest.mark.parametrize("area", [0.1, 0.8])
def test_bearing_threshold_is_that_of_its_cuts(scene, area):
    """The same from a leaking and from a sealed contact, and the bearing model agrees."""
    patch = Patch(scene(model="bearing", area_fraction=area))
    found = quantities(patch).threshold
    for fraction, state in ((found.area_leaking, False), (found.area_sealed, True)):
        assert sealed(bearing(patch.surface, area_fraction=fraction).gap) is state
    assert found.pressure_sealed is None


@pytest.mark.parametrize("pressure", ["0.1 MPa", "1 MPa", "1e-14 Pa"])
def test_elastic_threshold_lies_between_contacts_that_leak_and_seal(scene, pressure):
    """Sought from a leaking contact, a sealed one, and one that hardly touches."""
    patch = Patch(scene(pressure=pressure))
    found = quantities(patch).threshold
    # As docs/guide/verdict.md says.
    assert found.pressure_sealed / found.pressure_leaking <= 1.01 * (1 + 1e-9)
    assert found.area_leaking <= found.area_sealed
    for pressure, state in ((found.pressure_leaking, False), (found.pressure_sealed, True)):
        contact = press(patch.surface, ElasticSolid(1e7), Load("pressure", pressure))
        assert sealed(contact.gap) is state
    # Steps of the load to the other side of the threshold, then halves of the last one.
    steps = abs(log(found.pressure_leaking / patch.elastic_state.mean_pressure)) / log(LOAD_RATIO)
    halves = log(log(LOAD_RATIO) / log(1 + PRECISION), 2)
    assert found.contacts == ceil(steps) + ceil(halves)


def under(pressure, near=None, height=None):
    """Contact of a height with a solid of E* = 1; a flat one by default."""
    height = GridField(np.zeros((4, 4)), (1, 1), periodic=True) if height is None else height
    return press(height, ElasticSolid(1.0), Load("pressure", pressure), start=near)


def test_a_ring_seals_at_first_touch():
    """A ridge around the cell across the flow seals under every pressure: the search gives up."""
    x = np.arange(16) / 16
    ridge = GridField(np.tile(np.cos(2 * np.pi * x)[:, None], (1, 16)), (1, 1), periodic=True)
    pressed = partial(under, height=ridge)
    found = threshold_of_pressure(pressed(0.1), pressed, sealed)
    assert (found.area_leaking, found.pressure_leaking) == (0.0, 0.0)
    assert found.area_sealed > 0


def test_a_contact_that_never_seals():
    with pytest.raises(NotConverged, match="still leaks"):
        threshold_of_pressure(under(1.0), under, lambda gap: False)


@pytest.mark.parametrize("ends", [(0.2, 0.1), (0.1, 0.2, 2.0, 1.0), (0.1, 0.2, 1.0, None)])
def test_thresholds_that_cannot_be_are_refused(ends):
    with pytest.raises(Inconsistent, match="a threshold between"):
        Threshold("gfmd", *ends)
