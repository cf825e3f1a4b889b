"""Python prompts and notebooks: objects as tables, completed names, other libraries."""

import re

import numpy as np
import pytest
import pyvista as pv
from PIL import Image
from project import scene_of_samples

from fem_seal import (
    InvalidInput,
    LeakRate,
    Result,
    Scene,
    pictures,
    run,
    solve,
    to_pyvista,
    to_xarray,
)

SCENE = scene_of_samples(32) | {
    "contact": {"pressure": "100 kPa"},
    "flow": {"pressure_drop": "10 kPa", "rtol": 0.2},
    "limit": {"leak_rate": "1 ml/h"},
    "output": {"products": ["leak_rate", "mesh"]},
}


@pytest.fixture(scope="module")
def solved():
    return solve(Scene.from_mapping(SCENE))


@pytest.fixture(scope="module")
def patch(solved):
    return solved.patch


def rows(thing):
    """Names and texts of the table that a notebook shows."""
    return dict(re.findall(r"<tr><th>(.*?)</th><td>(.*?)</td></tr>", thing._repr_html_()))


def test_a_scene_shows_what_was_set_with_units():
    shown = rows(Scene.from_mapping(SCENE))
    for section, fields in SCENE.items():
        for key, value in fields.items():
            text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
            assert shown[f"{section}.{key}"] == text
    assert len(shown) == sum(map(len, SCENE.values()))


def test_numbers_have_their_units(patch):
    contact, leak = rows(patch.contact), rows(patch.leak_rate)
    assert contact["mean pressure"] == "100 kPa"
    assert contact["samples"] == "32 x 32"
    assert leak["leak rate"] in str(patch.leak_rate)
    assert "leak rate" not in rows(LeakRate.sealed("adaptive"))


def test_a_text_of_a_stranger_is_text():
    """A reason may quote the name of a file."""
    leak = LeakRate("leaking", "adaptive", 1.0, converged=False, reason="<script>")
    assert "<script>" not in leak._repr_html_()


def test_save_writes_what_run_writes(solved, tmp_path):
    saved, ran = solved.save(tmp_path / "saved"), run(solved.patch.scene, tmp_path / "ran")
    assert saved.files == ran.files
    assert (saved.leak_rate, saved.headline) == (ran.leak_rate, ran.headline)
    assert rows(solved)["leak rate"] == rows(ran)["leak rate"] == str(solved)
    assert Result.from_folder(tmp_path / "saved").verdict == solved.verdict
    assert solved.verdict.decision == "within limit"
    other = solve(Scene.from_mapping(SCENE | {"flow": {"pressure_drop": "9 kPa", "rtol": 0.2}}))
    with pytest.raises(InvalidInput, match="overwrite"):
        other.save(tmp_path / "saved")
    assert other.save(tmp_path / "saved", overwrite=True).leak_rate.value == other.leak_rate.value


def test_xarray(patch):
    xr = pytest.importorskip("xarray")
    data = to_xarray(patch.contact)
    assert isinstance(data, xr.Dataset)
    assert dict(data.sizes) == {"x": 32, "y": 32}
    # Where x and y are the coordinates of a sample, the variables are its values.
    dx, dy = patch.contact.gap.spacing
    at = data.sel(x=5 * dx, y=7 * dy, method="nearest")
    assert float(at.gap) == patch.contact.gap.values[5, 7]
    assert float(at.pressure) == patch.contact.pressure.values[5, 7]
    assert to_xarray(patch.contact.gap)["values"].attrs == {}
    with pytest.raises(InvalidInput, match="not a int"):
        to_xarray(3)


def test_pyvista_mesh_carries_the_flow(patch):
    mesh = to_pyvista(patch.leak_rate)
    assert isinstance(mesh, pv.PolyData)
    # Flow through each line x = const is the leak rate: ∫ j_x dA = Q Lx.
    area = mesh.compute_cell_sizes(length=False, volume=False).cell_data["Area"]
    through = np.sum(area * mesh.cell_data["flux"][:, 0]) / patch.contact.gap.size[0]
    leak = patch.leak_rate
    # CG stops at 1e-8 of the energy: the flux through a line is known to the root of that.
    assert leak.lower <= through <= leak.inflow * (1 + 1e-4)
    with pytest.raises(InvalidInput, match="add 'mesh' to output"):
        to_pyvista(LeakRate.sealed("adaptive"))


@pytest.mark.render
def test_pictures_at_a_prompt_are_those_of_a_run(tmp_path):
    products = {"products": ["contact", "leak_rate", "pictures"]}
    flow = SCENE["flow"] | {"rtol": 0.5}
    solved = solve(Scene.from_mapping(SCENE | {"flow": flow, "output": products}))
    shown = pictures(solved)
    result = solved.save(tmp_path / "out")
    assert {f"{name}.png" for name in shown} == {n for n in result.files if n.endswith(".png")}
    assert {"contact", "contact_pressure", "flow", "gap", "lift"} == set(shown)
    for name, picture in shown.items():
        assert picture._repr_png_().startswith(b"\x89PNG")
        assert picture.save(tmp_path / "copy.png").read_bytes() == picture.png
        ran = Image.open(tmp_path / "out" / f"{name}.png")
        assert np.array_equal(np.asarray(Image.open(tmp_path / "copy.png")), np.asarray(ran))
