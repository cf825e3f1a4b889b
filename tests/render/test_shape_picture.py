"""Pictures of a film of any shape: their key names what they show."""

from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from unittest.mock import Mock

import numpy as np
import pytest
from matplotlib.figure import Figure

from fem_seal.leak_rate import FlowField
from fem_seal.mesh.gap_source import Formula
from fem_seal.patch import Patch
from fem_seal.render import shape
from fem_seal.render.colours import CONTACT, NO_FLOW
from fem_seal.scene import Scene


@cache
def uniform(mesh_size):
    """A strip with a gap of 1 um."""
    shape = {"kind": "rectangle", "length": "4 mm", "width": "2 mm", "mesh_size": mesh_size}
    scene = {"shape": shape | {"gap": "1 um"}, "output": {"products": ["contact"]}}
    return Patch(Scene.from_mapping(scene)).film


def strip(expression="1e-6", mesh_size="1 mm"):
    film = uniform(mesh_size)
    return replace(film, values=Formula(expression)(film.mesh.xy))


def flow_everywhere(film, density=1.0):
    """A flow of one density over all triangles of a film."""
    mesh = film.mesh
    flux = np.tile([density, 0.0], (len(mesh.cells), 1))
    return FlowField(mesh.xy, mesh.cells, film.values, np.ones(len(mesh.xy)), flux)


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """Function that gives axes and keys of the pages, not drawn, and the layers of contact."""

    def drawn(film, field=None):
        pages, layers = {}, Mock(return_value=np.zeros((9, 9, 3), np.uint8))

        @contextmanager
        def page(window, path, *, key):
            panels = Figure().subplots(1, 1, squeeze=False)
            pages[path.stem] = panels[0, 0], key
            yield panels

        monkeypatch.setattr(shape, "draw_layers", layers)
        monkeypatch.setattr(shape, "page", page)
        shape.draw_shape(film, field, tmp_path)
        return pages, layers.call_args_list[0].args[0]

    return drawn


def test_key_names_contact_and_open_places_without_flow_only_where_there_are_some(drawn):
    """All cells flow; one cell does not; one flows weakly, in the lowest colour of the bar.

    Flow of a shape does not claim to run along x.
    """
    film, touching = strip(), strip("max(0, 1e-6 * (x / 0.002 - 1))")
    whole = flow_everywhere(film)
    part = replace(whole, cells=whole.cells[1:], flux=whole.flux[1:])
    weak = replace(
        whole, flux=whole.flux * np.where(np.arange(len(whole.cells)) == 0, 1e-9, 1)[:, None]
    )
    for field, pockets in ((whole, False), (part, True), (weak, False)):
        pages, _ = drawn(film, field)
        axes, key = pages["flow"]
        assert (NO_FLOW in key) == pockets
        assert axes.get_xlabel() == "x [mm]"
        assert not any(CONTACT in key for _, key in pages.values())
    pages, _ = drawn(touching, flow_everywhere(touching))
    assert all(CONTACT in key for _, key in pages.values())


def test_contact_is_drawn_on_the_triangles_that_touch(drawn):
    """Of a strip whose first half touches, up to a line of vertices: no part of other triangles."""
    touching = strip("max(0, 1e-6 * (x / 0.002 - 1))", "0.2 mm")
    (layer,) = drawn(touching)[1]
    corners = layer.points[layer.cells]
    area = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 2
    assert area == pytest.approx(touching.contact_area_fraction * 8e-6, rel=1e-12)
    assert 0 < area <= 4e-6 * (1 + 1e-12)
