"""Pictures of a film of any shape: their key names what they show."""

from contextlib import contextmanager
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib.figure import Figure

from fem_seal.leak_rate import FlowField
from fem_seal.mesh.gap_source import Formula
from fem_seal.patch import Patch
from fem_seal.render import offscreen, shape
from fem_seal.render.colours import CONTACT, NO_FLOW
from fem_seal.scene import Scene


@cache
def uniform(mesh_size):
    """A strip with a gap of 1 um."""
    shape = {"kind": "rectangle", "length": "4 mm", "width": "2 mm", "mesh_size": mesh_size}
    scene = {"shape": shape | {"gap": "1 um"}, "output": {"products": ["contact"]}}
    return Patch(Scene.from_mapping(scene)).film


def strip(expression="1e-6", mesh_size="1 mm"):
    film, formula = uniform(mesh_size), Formula(expression)
    return replace(film, values=formula(film.mesh.xy), formula=formula)


def flow_everywhere(film, density=1.0):
    """A flow of one density over all triangles of a film."""
    mesh = film.mesh
    flux = np.tile([density, 0.0], (len(mesh.cells), 1))
    return FlowField(mesh.xy, mesh.cells, film.values, np.ones(len(mesh.xy)), flux)


@pytest.fixture
def keys(monkeypatch):
    """Keys of the pages, which are not drawn."""
    seen = {}

    @contextmanager
    def page(window, path, *, key):
        seen[path.stem] = key
        yield Figure().subplots(1, 1, squeeze=False)

    blank = np.zeros((9, 9, 3), np.uint8)
    monkeypatch.setattr(shape, "draw_layers", lambda layers, window: blank)
    monkeypatch.setattr(shape, "page", page)
    return seen


def test_key_names_contact_and_open_places_without_flow_only_where_there_are_some(keys, tmp_path):
    """All cells flow; one cell does not; one flows weakly, in the lowest colour of the bar."""
    film, touching = strip(), strip("max(0, 1e-6 * (x / 0.002 - 1))")
    whole = flow_everywhere(film)
    part = replace(whole, cells=whole.cells[1:], flux=whole.flux[1:])
    weak = replace(
        whole, flux=whole.flux * np.where(np.arange(len(whole.cells)) == 0, 1e-9, 1)[:, None]
    )
    for field, pockets in ((whole, False), (part, True), (weak, False)):
        shape.draw_shape(film, field, tmp_path)
        assert (NO_FLOW in keys["flow"]) == pockets
        assert not any(CONTACT in key for key in keys.values())
    shape.draw_shape(touching, flow_everywhere(touching), tmp_path)
    assert all(CONTACT in key for key in keys.values())


def area_of(layers):
    """Area of all triangles of some layers."""
    return sum(shape._area(layer.points, layer.cells) for layer in layers)


def test_contact_is_drawn_where_the_formula_is_zero(monkeypatch):
    """A disc: its area to the pixels of its rim. The film as meshed touches on less."""
    monkeypatch.setattr(offscreen, "LONG_SIDE", 1200)
    radius, gap = 0.6e-3, "max(0, (x - 0.002)**2 + (y - 0.001)**2 - 0.36e-6)"
    film = strip(gap, "0.2 mm")
    pixel = 4e-3 / offscreen.LONG_SIDE
    # Sub-triangles of at most a pixel are in or out as a whole: an error of a pixel along the rim.
    rim = 2 * np.pi * radius * pixel
    drawn = area_of(shape._contact_of(film))
    assert drawn == pytest.approx(np.pi * radius**2, abs=rim)
    as_meshed = area_of(shape._contact_of(replace(film, formula=None)))
    assert as_meshed < drawn - 10 * rim


@pytest.mark.render
def test_flow_of_a_shape_does_not_claim_to_run_along_x(tmp_path):
    film = strip()
    with shape._page(film, tmp_path / "a.png", []) as axes:
        assert axes.get_xlabel() == "x [mm]"
