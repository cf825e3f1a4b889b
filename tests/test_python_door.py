"""The door for Python: sections as objects, errors of one sentence, notebooks, other libraries."""

import pickle
import re

import numpy as np
import pytest
import pyvista as pv
from PIL import Image
from project import ROOT, refused_calls, scene_of_samples, without_numbers

import fem_seal as fs
from fem_seal.grid import GridField
from fem_seal.render.patch import OF_LIFTED_CONTACT
from fem_seal.results import read_contact
from fem_seal.results.words import summary_of
from fem_seal.scene import Scene
from fem_seal.scene.readable import rows_of_mapping

PAGE = (ROOT / "docs/guide/python.md").read_text(encoding="utf-8")
FILE = scene_of_samples(32) | {
    "contact": {"pressure": "100 kPa"},
    "flow": {"pressure_drop": "10 kPa", "rtol": 0.2},
    "output": {"products": ["leak_rate"]},
}
SCENE = FILE | {
    "limit": {"leak_rate": "1 ml/h"},
    "output": {"products": ["leak_rate", "mesh"]},
}
DRY = {name: SCENE[name] for name in ("surface", "solid", "contact")} | {
    "output": {"products": ["contact", "pictures"]}
}


def in_python(**sections):
    """The scene FILE of objects, with other sections."""
    kinds = {"surface": fs.SelfAffine, "solid": fs.Solid, "contact": fs.Contact}
    kinds |= {"fluid": fs.Fluid, "flow": fs.Flow, "output": fs.Output}
    return fs.Scene(**{name: kinds[name](**FILE[name]) for name in kinds} | sections)


def test_a_scene_of_objects_is_that_of_a_file():
    made = in_python()
    assert made == Scene.from_mapping(FILE)
    assert made.to_mapping() == Scene.from_mapping(FILE).to_mapping()
    assert repr(made.contact) == "Contact(pressure='100 kPa')"
    assert eval(repr(made), vars(fs) | {name: getattr(fs, name) for name in fs.__all__}) == made


def test_changed_copies_are_those_of_changed_files():
    """Also of defaults that follow from other fields: half of seal.rtol is that of the flow."""
    data = FILE | {"flow": {"pressure_drop": 1e4}, "output": {"products": ["seal"]}}
    data["seal"] = {"leak_path": "1 mm", "circumference": "1 mm", "rtol": 0.3}
    other = Scene.from_mapping(data | {"seal": {**data["seal"], "rtol": 0.1}})
    assert Scene.from_mapping(data).with_({"seal.rtol": 0.1}) == other
    assert other.flow.rtol == 0.05
    plain = Scene.from_mapping(FILE)
    assert plain.with_({"contact.pressure": None, "contact.mean_gap": "1 um"}) == in_python(
        contact=fs.Contact(mean_gap=1e-6)
    )
    assert plain.with_({"fluid": fs.Fluid(viscosity=2.0)}).viscosity == 2
    assert plain.with_({"flow.rtol": 0.1}).with_({"flow.rtol": 0.2}) == plain
    with pytest.raises(AttributeError, match="with_"):
        plain.contact.pressure = 1.0


FLAT = GridField(np.ones((4, 4)), (1e-6, 1e-6))
HOLES = fs.field_file.FieldMap(np.r_[999 * [np.nan], 0][:, None], (1e-6, 1e-6), periodic=True)
LIQUID = fs.flow.FlowSettings(viscosity=1e-3, pressure_drop=1e5)
TABLE = fs.upscaling.ConductivityTable([1e5, 2e5], [1e-18, 0.0], [1e-18, 0.0])
STRIP = fs.Scene(
    shape=fs.Strip(length=2e-3, width=1e-3, mesh_size=1e-3, gap=1e-6),
    fluid=fs.Fluid(viscosity=1e-3),
    flow=fs.Flow(pressure_drop=1e5),
)
HERTZ, PATH = fs.upscaling.Hertz(2e5, 1e-3), fs.upscaling.StraightPath(1e-3, 1.0)


# A wrong kind of argument is refused where it is given, in place of an error from deep inside or a
# number that it does not mean.
test_errors_are_one_sentence = refused_calls(
    (lambda: fs.Contact(pressure="0.1 MPaa"), "^Contact: pressure = '0.1 MPaa' has an unknown"),
    (lambda: fs.Contact(presure=1), "^Contact: presure is not a known key; did you mean"),
    (lambda: fs.Contact("0.1 MPa"), r"^Contact takes its fields by name, as in Contact\("),
    (lambda: in_python(contact=fs.Flow()), "^contact is a Flow, which does not belong"),
    (lambda: fs.Scene(), r"give \[surface\] and \[contact\], or \[gap\];"),
    (lambda: in_python().with_({"contact.presure": 1}), "^contact.presure is not a known key"),
    (lambda: in_python().with_({"contact.pressure": "x"}), "^contact.pressure = 'x' must be"),
    (lambda: fs.Heights(np.ones(3), size=(1, 1)), "two-dimensional array .* shape \\(3,\\)$"),
    (lambda: fs.Heights(np.ones((3, 3))), "need their size, such as"),
    (lambda: fs.solve("scene.toml"), "^a Scene is needed, not a str; Scene.from_file"),
    (lambda: fs.run("scene.toml", "out"), "^a Scene is needed, not a str; Scene.from_file"),
    (lambda: fs.pictures(FLAT), "^of must be of type Solved or Patch, not GridField$"),
    (lambda: in_python().with_(["flow.rtol"]), "^changes must be of type Mapping, not list$"),
    (lambda: Scene.from_mapping([1]), "^data must be of type Mapping, not list$"),
    (lambda: fs.sweep.read_points("gone.csv"), "^cannot read the points gone.csv: No such"),
    (
        lambda: fs.sweep.sweep("gone.toml", fs.sweep.combinations("a.b=1"), "out"),
        "^cannot read the scene file gone.toml: No such",
    ),
    (lambda: GridField(1j * FLAT.values, (1, 1)), "^a grid needs an array of numbers, got com"),
    (lambda: GridField([["1"]], (1, 1)), "^a grid needs an array of numbers, got <U1$"),
    (lambda: fs.surface.rms_height(FLAT.values), "^the surface is a ndarray; make it a Grid"),
    (lambda: fs.surface.rms_slope(FLAT.values), "^the surface is a ndarray; make it a Grid"),
    (lambda: fs.surface.resample(1, (2, 2)), "^the surface is a int; make it a GridField"),
    (lambda: fs.surface.twin(None, 1), "^the surface is a NoneType; make it a GridField"),
    (lambda: fs.field_file.Stated(turn=45), "^turn = 45 must be one of 0, 90, 180 and 270"),
    (lambda: fs.field_file.Stated(transpose="no"), "^transpose must be of type bool, not str$"),
    (
        lambda: fs.field_file.Stated(periodic="no"),
        "^periodic must be of type bool or None",
    ),
    (
        lambda: fs.field_file.Stated(height_factor=np.nan),
        "^height_factor = nan must be a pos",
    ),
    (lambda: fs.surface.fill(HOLES, np.nan), r"^999 of 1000 .*\(100 %\), .* max_missing = nan"),
    (
        lambda: fs.contact.press(FLAT, fs.contact.Load("pressure", 1.0), None),
        "^solid must be of type ElasticSolid, not Load$",
    ),
    (
        lambda: fs.contact.press(FLAT, fs.contact.ElasticSolid(1e7), 1e5),
        "^load must be of type Load, not float$",
    ),
    (
        lambda: fs.flow.FlowSettings(viscosity=1, pressure_drop=1, slip="first-order"),
        "^slip must be of type Slip or None, not str$",
    ),
    (
        lambda: fs.flow.FlowSettings(viscosity=1, pressure_drop=1, limits=100),
        "^limits must be of type Limits, not int$",
    ),
    (lambda: fs.flow.leak_rate(LIQUID, FLAT), "^settings must be of type FlowSettings, not Gr"),
    (
        lambda: fs.finite_difference.by_differences(fs.film.GridFilm(FLAT), LIQUID, 1e5),
        "^viscosity = FlowSettings.* must be a positive number, in SI units$",
    ),
    (
        lambda: fs.flow.FlowSettings(viscosity=1, pressure_drop=1, link_rule="harmonic"),
        "^method = 'adaptive' has no links: leave link_rule out$",
    ),
    *(
        (
            lambda unread=unread: fs.flow.FlowSettings(1, 1, method="finite-difference", **unread),
            "^method = 'finite-difference' has neither bounds nor a mesh: leave out decide, ",
        )
        for unread in ({"decide": 1.0}, {"field": True}, {"limits": fs.flow.Limits(unknowns=9)})
    ),
    (lambda: fs.Patch(STRIP).sensitivity, "^an elastic contact is needed: contact.model = "),
    (lambda: fs.Patch(STRIP).grid_gap, r"^\[shape\] gives the gap itself, which has no grid$"),
    (lambda: fs.upscaling.RingPath(1e-3, np.inf), "^outlet_radius = inf must be a positive"),
    (lambda: fs.upscaling.EndPressures(1e5, ambient=np.nan), "^ambient = nan must be a finite"),
    (
        lambda: fs.upscaling.seal_flow(
            TABLE, HERTZ, PATH, fs.upscaling.EndPressures(5e4), cells=-1
        ),
        "^cells = -1 must be a whole number >= 1$",
    ),
)


def test_heights_of_an_array_are_those_of_the_surface_they_were_taken_from(tmp_path, monkeypatch):
    """Values and lengths to the last digit; a copy of the scene, and the result, find them."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    solved = fs.solve(in_python())
    field = solved.patch.surface
    for heights in (fs.Heights(field), fs.Heights(field.values, size=field.size, periodic=True)):
        again = fs.solve(in_python(surface=heights))
        assert np.array_equal(again.patch.surface.values, field.values)
        assert again.patch.surface.spacing == pytest.approx(field.spacing, rel=1e-15)
        assert again.headline.value == pytest.approx(solved.headline.value, rel=1e-9)
        [name] = again.result().provenance.inputs
        assert name.startswith(str(tmp_path))
        assert Scene.from_mapping(again.patch.scene.to_mapping()).surface.path == heights.path
    masked = np.ma.masked_less(field.values, np.sort(field.values, axis=None)[3])
    with pytest.raises(fs.InvalidInput, match="3 of 1024 points are missing"):
        _ = fs.Patch(in_python(surface=fs.Heights(masked, size=(1, 1), periodic=True))).surface
    with pytest.raises(fs.InvalidInput, match="3 of 1024 grid values are not finite"):
        GridField(masked, field.spacing)
    millimetres = fs.Heights(1e3 * field.values, size=field.size, unit="mm", periodic=True)
    read = fs.Patch(in_python(surface=millimetres)).surface
    assert read.values == pytest.approx(field.values, rel=1e-15)


def test_names_at_a_prompt():
    assert {"Scene", "solve", "run", "SelfAffine", "contact", "flow", "film"} <= set(dir(fs))
    assert fs.contact.press.__doc__.startswith("Dry contact")
    assert "fem_seal.solve" in fs.contact.press.__doc__.splitlines()[0]


@pytest.mark.render
def test_recipes_of_the_page(tmp_path, monkeypatch, capsys, here):
    """Every block runs; the first prints what the page says, to the flow's rtol."""
    pytest.importorskip("pandas", reason="pip install pandas")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    names = {}
    first, *others = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(first, names)
    # The others do not print numbers of the page.
    smaller = {"surface.shape": (16, 16), "surface.short_wavelength": "25 um", "flow.rtol": 0.3}
    smaller |= {"surface.long_wavelength": "50 um", "accuracy.contact_grid": False}
    names["scene"] = names["scene"].with_(smaller)
    for code in others:
        if "fs.pictures(" in code:
            names["solved"] = fs.solve(Scene.from_mapping(DRY))
        exec(code.replace("np.pi, 64", "np.pi, 32"), names)
    [said] = re.findall(r"```text\n(.*?)\n```", PAGE, re.DOTALL)
    printed = capsys.readouterr().out.splitlines()[0]
    assert without_numbers(printed) == without_numbers(said)
    stated, found = (
        [float(end) for end in re.search(r"(\S+) to (\S+) with", text).groups()]
        for text in (said, printed)
    )
    assert found == pytest.approx(stated, rel=0.05)
    # More load leaks less, and the rows of the table are in the order of the loads.
    assert names["table"]["leak rate"].is_monotonic_decreasing
    assert (tmp_path / "gap.png").is_file()


@pytest.fixture(scope="module")
def solved():
    return fs.solve(Scene.from_mapping(SCENE))


@pytest.fixture(scope="module")
def patch(solved):
    return solved.patch


def test_a_scene_is_shown_with_units():
    shown = dict(rows_of_mapping(Scene.from_mapping(SCENE).to_mapping(), Scene))
    for section, fields in SCENE.items():
        for key, value in fields.items():
            text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
            assert shown[f"{section}.{key}"] == text


def test_save_writes_what_run_writes(solved, tmp_path):
    """Also of an answer that another process has sent."""
    assert str(pickle.loads(pickle.dumps(solved))) == str(solved)
    saved, ran = solved.save(tmp_path / "saved"), fs.run(solved.patch.scene, tmp_path / "ran")
    assert saved.files == ran.files
    assert (saved.leak_rate, saved.headline) == (ran.leak_rate, ran.headline)
    assert dict(summary_of(ran))["leak rate"] == str(solved)
    assert fs.Result.from_folder(tmp_path / "saved").verdict == solved.verdict
    assert solved.verdict.decision == "within limit"
    other = fs.solve(Scene.from_mapping(SCENE | {"flow": {"pressure_drop": "9 kPa", "rtol": 0.2}}))
    with pytest.raises(fs.InvalidInput, match="overwrite"):
        other.save(tmp_path / "saved")
    assert other.save(tmp_path / "saved", overwrite=True).leak_rate.value == other.leak_rate.value


def test_xarray(patch):
    xr = pytest.importorskip("xarray")
    data = fs.to_xarray(patch.contact)
    assert isinstance(data, xr.Dataset)
    assert dict(data.sizes) == {"x": 32, "y": 32}
    # Where x and y are the coordinates of a sample, the variables are its values.
    dx, dy = patch.contact.gap.spacing
    at = data.sel(x=5 * dx, y=7 * dy, method="nearest")
    assert float(at.gap) == patch.contact.gap.values[5, 7]
    assert float(at.pressure) == patch.contact.pressure.values[5, 7]
    assert fs.to_xarray(patch.contact.gap)["values"].attrs == {}
    with pytest.raises(fs.InvalidInput, match="not a int"):
        fs.to_xarray(3)


def test_pyvista_mesh_carries_the_flow(patch):
    mesh = fs.to_pyvista(patch.leak_rate)
    assert isinstance(mesh, pv.PolyData)
    # Flow through each line x = const is the leak rate: ∫ j_x dA = Q Lx.
    area = mesh.compute_cell_sizes(length=False, volume=False).cell_data["Area"]
    through = np.sum(area * mesh.cell_data["flux"][:, 0]) / patch.contact.gap.size[0]
    leak = patch.leak_rate
    # CG stops at 1e-8 of the energy: the flux through a line is known to the root of that.
    assert leak.lower <= through <= leak.inflow * (1 + 1e-4)
    with pytest.raises(fs.InvalidInput, match="add 'mesh' to output"):
        fs.to_pyvista(fs.LeakRate.sealed("adaptive"))
    with pytest.raises(fs.InvalidInput, match="leak_rate, not a Patch"):
        fs.to_pyvista(patch)


@pytest.mark.render
def test_pictures_at_a_prompt_are_those_of_a_run(tmp_path):
    solved = fs.solve(Scene.from_mapping(DRY))
    shown = fs.pictures(solved)
    result = solved.save(tmp_path / "out")
    assert {f"{name}.png" for name in shown} == {n for n in result.files if n.endswith(".png")}
    assert {f"{name}.png" for name in shown} == {*OF_LIFTED_CONTACT} - {"lift.png", "flow.png"}
    assert read_contact(tmp_path / "out").fluid_pressure is None
    for name, picture in shown.items():
        assert picture._repr_png_().startswith(b"\x89PNG")
        assert picture.save(tmp_path / "copy.png").read_bytes() == picture.png
        ran = Image.open(tmp_path / "out" / f"{name}.png")
        assert np.array_equal(np.asarray(Image.open(tmp_path / "copy.png")), np.asarray(ran))
