"""Bad files: one sentence that names the file and the fault, exit status 2, nothing written."""

import re

import h5py
import layouts
import numpy as np
import pytest
from project import write_toml
from scipy.io import netcdf_file
from test_formats import GAP, LAYOUTS, SIZE, SPACING, in_um

from fem_seal import cli
from fem_seal.errors import InvalidInput
from fem_seal.field_file import GAP_NAMES, HEIGHT_NAMES, Stated, read_map

SAID = Stated(unit="um", size=SIZE)


def h5(path, gap=GAP, unit="m", x=None, **more):
    """HDF5 with coordinates, of which those along x may be bad."""
    with h5py.File(path, "w") as file:
        file["gap"] = gap
        if unit is not None:
            file["gap"].attrs["unit"] = unit
        file["x"] = np.arange(6) * SPACING[0] if x is None else x
        file["y"] = np.arange(4) * SPACING[1]
        for name in ("x", "y"):
            file[name].attrs["unit"] = more.get(f"{name}_unit", "m")
        for name, value in more.items():
            if not name.endswith("_unit"):
                file[name] = value


def h5_attribute(path, name, value, of="x"):
    """The same with an attribute of one array."""
    h5(path)
    with h5py.File(path, "a") as file:
        file[of].attrs[name] = value


def nc_attribute(path, name, value):
    """NetCDF 3 of a gap with an attribute."""
    with netcdf_file(path, "w") as file:
        for axis, n in zip("xy", GAP.shape, strict=True):
            file.createDimension(axis, n)
        file.createVariable("gap", "f8", ("x", "y"))[...] = GAP
        setattr(file.variables["gap"], name, value)


def npy(path, values):
    np.save(path, values)


UNEVEN = np.array([0, 1, 2, 3, 4, 5.01]) * SPACING[0]
CASES = {
    "no unit": ("a.h5", lambda p: h5(p, unit=None), Stated(), "have no unit; say it"),
    "no unit of x": (
        "a.h5",
        lambda p: layouts.plain_h5(p, "gap", GAP, SPACING, "m"),
        Stated(),
        "the lengths of .*a.h5 have no unit; say it in the scene",
    ),
    "no size": (
        "a.npy",
        lambda p: npy(p, GAP),
        Stated(unit="um"),
        "does not say its lengths; give its size",
    ),
    "unit of another kind": ("a.h5", lambda p: h5(p, unit="kg"), Stated(), "in 'kg', which is no"),
    "mask of words": (
        "a.h5",
        lambda p: h5(p, mask=np.full(GAP.shape, b"no")),
        Stated(),
        "mask in .*a.h5 must hold true and false",
    ),
    "length of words": (
        "a.h5",
        lambda p: h5_attribute(p, "length", "6 um"),
        Stated(),
        r"length of x in .*a.h5 must be one number, got \['6 um'\]",
    ),
    "periodic of words": (
        "a.h5",
        lambda p: h5_attribute(p, "periodic", "false"),
        Stated(),
        "periodic in .*a.h5 must be one true or false, got 'false'",
    ),
    "periodic of nothing": (
        "a.h5",
        lambda p: h5_attribute(p, "periodic", np.array([], dtype=int)),
        Stated(),
        "periodic in .*a.h5 must be one true or false",
    ),
    "periodic of another number": (
        "a.h5",
        lambda p: h5(p, periodic=2.5),
        Stated(),
        "periodic in .*a.h5 must be one true or false",
    ),
    "ampere": ("a.h5", lambda p: h5(p, unit="mA"), Stated(), "in 'mA', which is no unit of length"),
    "unit against the scene": ("a.h5", h5, SAID, r"are in m, but unit = 'um' was given; leave out"),
    "size against the scene": (
        "a.h5",
        h5,
        Stated(size=(3e-6, 2e-6)),
        "size = 3e-06 m by 1e-06 m, but size = 3e-06 m by 2e-06 m was given",
    ),
    "size a little against the scene": (
        "a.h5",
        h5,
        Stated(size=(3.00001e-6, 1e-6)),
        "size = 3e-06 m by 1e-06 m, but size = 3.00001e-06 m by 1e-06 m was given",
    ),
    "repeats against the scene": (
        "a.npz",
        lambda p: np.savez(p, gap=GAP, spacing=SPACING, periodic=False),
        Stated(periodic=True),
        "says periodic = False, but True was given; .*make_periodic",
    ),
    "units of x and y": ("a.h5", lambda p: h5(p, y_unit="mm"), Stated(), "differ in unit: m, mm"),
    "uneven": ("a.h5", lambda p: h5(p, x=UNEVEN), Stated(), "x in .* is not evenly spaced"),
    "backwards": ("a.h5", lambda p: h5(p, x=-UNEVEN), Stated(), "not evenly spaced and increasing"),
    "too many coordinates": ("a.h5", lambda p: h5(p, x=np.arange(7.0)), Stated(), "6 coordinates"),
    "infinite": ("a.npy", lambda p: npy(p, GAP + np.inf), SAID, "24 of 24 values .* infinite"),
    "missing points of a gap": ("a.npy", lambda p: npy(p, GAP * np.nan), SAID, "not finite"),
    "line scan": ("a.npy", lambda p: npy(p, GAP[0]), SAID, "two-dimensional, .* not \\(4,\\)"),
    "volume": ("a.h5", lambda p: h5(p, np.stack([GAP, GAP])), Stated(), "has shape \\(2, 6, 4\\)"),
    "complex": ("a.h5", lambda p: h5(p, GAP * 1j), Stated(), "must hold real numbers, not complex"),
    "no gap": (
        "a.nc",
        lambda p: layouts.contact_mechanics_nc(p, displacements=GAP[None], forces=GAP[None]),
        SAID,
        "has no array 'gap' or 'gaps'; it holds displacements, forces",
    ),
    "no frame": (
        "a.nc",
        lambda p: layouts.contact_mechanics_nc(p, gap=GAP[None][:0]),
        SAID,
        "gap in .* has no frame",
    ),
    "no such array": ("a.h5", h5, Stated(array="height"), "no array 'height'; it holds gap, x, y"),
    "traction of another shape": (
        "a.npz",
        lambda p: layouts.tamaas_npz(p, (3.0, 1.0), gap=GAP, traction=GAP[1:]),
        Stated(unit="um"),
        r"shape \(6, 4\), but its contact pressure \(5, 4\)",
    ),
    "attributes of Tamaas": (
        "a.npz",
        lambda p: np.savez(p, gap=GAP, attrs="{"),
        SAID,
        "attrs in .* is not the JSON that Tamaas writes",
    ),
    "ragged text": (
        "a.txt",
        lambda p: p.write_text("1 2\n\n3\n"),
        SAID,
        "line 3 of .*a.txt has 1 number, and other lines have 2: '3'",
    ),
    "empty text": ("a.txt", lambda p: p.write_text("# nothing\n"), SAID, "holds no numbers: it is"),
    "words": ("a.txt", lambda p: p.write_text("\none two\n"), SAID, "line 2 is 'one two'"),
    "a word in a line": (
        "a.txt",
        lambda p: p.write_text("Width; 3\n1;2;3\n4;o5;6\n"),
        SAID,
        "line 3, column 2 of .*a.txt is 'o5', which is no number",
    ),
    "a word in the first line": (
        "a.txt",
        lambda p: p.write_text("1 2 3o\n4 5 6\n"),
        SAID,
        "line 1, column 3 of .*a.txt is '3o'",
    ),
    "commas of two kinds": (
        "a.csv",
        lambda p: p.write_text("0,5, 0,7\n1,5, 2,5\n"),
        SAID,
        "lines such as '1,5, 2,5', whose commas may be decimal commas or stand between",
    ),
    "commas of one kind": ("a.csv", lambda p: p.write_text("1,5\n2,7\n"), SAID, "may be decimal"),
    "an underscore": ("a.txt", lambda p: p.write_text("1 2\n3 4_0\n"), SAID, "column 2 .* '4_0'"),
    "bytes": ("a.txt", lambda p: p.write_bytes(b"1 2 3 4\x00 5"), SAID, "no text file, character"),
    "half of UTF-16": (
        "a.txt",
        lambda p: p.write_bytes("1 2\n3 4\n".encode("utf-16")[:-1]),
        SAID,
        "byte 17 is no text in UTF-16",
    ),
    "fewer lines than announced": (
        "a.txt",
        lambda p: p.write_text("ncols 3\nnrows 4\n1 2 3\n4 5 6\n7 8 9\n"),
        SAID,
        "holds 3 lines of 3 numbers, and its header announces 4 of 3; it may be cut off",
    ),
    "a profile": ("a.txt", lambda p: p.write_text("0 1\n1 2\n2 3\n3 1\n"), SAID, "is a line scan"),
    "points of no grid": (
        "a.txt",
        lambda p: p.write_text("0 0 1\n0 1 2\n1 0 3\n1.3 1 4\n"),
        SAID,
        "line 3 of .*a.txt: x = .* is not on the even grid",
    ),
    "few points": (
        "a.txt",
        lambda p: p.write_text("".join(f"{k} {k} 1\n" for k in range(9))),
        SAID,
        "its 9 points are few of the 9 x 9",
    ),
    "a point twice": (
        "a.txt",
        lambda p: p.write_text("0 0 1\n0 1 2\n1 0 3\n# again\n0 1 4\n1 1 2\n"),
        SAID,
        "line 5 of .*a.txt has the same x and y as a line before it",
    ),
    "a point nowhere": (
        "a.txt",
        lambda p: p.write_text("0 0 1\n0 1 2\n1 nan 3\n1 1 4\n"),
        SAID,
        "line 3 of .*a.txt has no x or no y",
    ),
    "three columns that are no list": (
        "a.txt",
        lambda p: p.write_text("1 2 3\n1 3 4\n1 4 5\n1 5 3\n"),
        SAID,
        "x is the same in all lines; a map that is three samples wide",
    ),
    "unknown format": (
        "a.xyz1",
        lambda p: p.write_bytes(b"\x00\x01" * 9),
        SAID,
        "no format that Surface",
    ),
    "fill value of words": (
        "a.h5",
        lambda p: h5_attribute(p, "_FillValue", "none", of="gap"),
        Stated(),
        "_FillValue of gap in .*a.h5 must be one number, got 'none'",
    ),
    "missing value of words": (
        "a.nc",
        lambda p: nc_attribute(p, "missing_value", "none"),
        Stated(),
        "missing_value of gap in .*a.nc must be one number, got 'none'",
    ),
    "scale of words": (
        "a.nc",
        lambda p: nc_attribute(p, "scale_factor", "um"),
        Stated(),
        "scale_factor of gap in .*a.nc must be one number, got 'um'",
    ),
    "NetCDF that is none": ("a.nc", lambda p: p.write_text("CDF"), SAID, "not a whole NetCDF file"),
    "HDF5 that is none": ("a.h5", lambda p: p.write_text("HDF"), SAID, "cannot be read"),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_file(case, tmp_path, monkeypatch, capsys):
    """Through the command, which must write nothing."""
    name, write, said, words = CASES[case]
    monkeypatch.chdir(tmp_path)
    write(tmp_path / name)
    arguments = ["leak", name, "--out", "out", "--method", "finite-difference"]
    for option, value in (
        ("--length-unit", said.unit),
        ("--array", said.array),
        ("--size", said.size and f"{said.size[0]},{said.size[1]}"),
        ("--periodic", said.periodic and "yes"),
    ):
        arguments += [option, value] if value else []
    assert cli.main(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "Traceback" not in error
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert re.search(words, error)


def test_any_attribute_called_name_is_allowed(tmp_path):
    """NetCDF 4 marks mere dimensions by an attribute NAME; others may use it for words."""
    h5_attribute(tmp_path / "a.h5", "NAME", "along the flow")
    np.testing.assert_array_equal(read_map(tmp_path / "a.h5", GAP_NAMES).values, GAP)


@pytest.mark.parametrize("name", [name for name in LAYOUTS if not name.endswith("txt")])
def test_file_cut_off_anywhere(name, tmp_path):
    """A binary file without its end is refused, wherever it was cut; the whole one is not."""
    stated = in_um(tmp_path / name)
    whole = (tmp_path / name).read_bytes()
    cut = tmp_path / f"cut-{name}"
    for k in range(0, len(whole) - 1, max(1, len(whole) // 25)):
        cut.write_bytes(whole[:k])
        with pytest.raises(InvalidInput, match=f"cut-{name}") as caught:
            read_map(cut, GAP_NAMES, stated)
        assert "\n" not in str(caught.value)
    cut.write_bytes(whole)
    read_map(cut, GAP_NAMES, stated)


def test_netcdf_3_cut_off_anywhere(tmp_path):
    layouts.topography_nc(tmp_path / "a.nc", GAP, SIZE, "m")
    whole = (tmp_path / "a.nc").read_bytes()
    for k in range(0, len(whole) - 8, 40):
        (tmp_path / "a.nc").write_bytes(whole[:k])
        with pytest.raises(InvalidInput, match=r"a\.nc"):
            read_map(tmp_path / "a.nc", HEIGHT_NAMES)


BAD_SURFACES = {
    "beyond double precision": (
        {"heights": GAP / GAP.max() * 1e200},
        {},
        "reach 1.0e+200 m, whose squares are beyond double precision; check their unit",
    ),
    "all points missing": ({"heights": GAP * np.nan}, {"fill": "harmonic"}, "all 24 points are"),
    "missing and not filled": (
        {"heights": np.where(GAP == 0, np.nan, GAP)},
        {},
        "2 of 24 points are missing; say how to fill them",
    ),
    "too many missing": (
        {"heights": np.where(GAP == 0, np.nan, GAP)},
        {"fill": "linear", "max_missing": 0.05},
        "2 of 24 points are missing (8.3 %), more than max_missing = 0.05",
    ),
    "crop leaves the map": (
        {"heights": GAP},
        {"crop": [[0, 9e-6], [0, 1e-6]]},
        "leaves the map",
    ),
    "does not repeat": ({"heights": GAP, "periodic": False}, {}, "or make_periodic = 'mirror'"),
    "repeats already": ({"heights": GAP, "periodic": True}, {"make_periodic": "cut"}, "leave make"),
}


@pytest.mark.parametrize("command", ["run", "surface"])
@pytest.mark.parametrize("case", BAD_SURFACES)
def test_bad_surface(case, command, small_scene, tmp_path, monkeypatch, capsys):
    arrays, fields, words = BAD_SURFACES[case]
    if (case, command) == ("does not repeat", "surface"):
        return  # it may be looked at
    monkeypatch.chdir(tmp_path)
    np.savez("surface.npz", spacing=SPACING, **arrays)
    small_scene["surface"] = {"kind": "file", "path": "surface.npz", **fields}
    write_toml(tmp_path / "scene.toml", small_scene)
    out = "out" if command == "run" else "out.png"
    assert cli.main([command, "scene.toml", "--out", out]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert words in error
    assert {path.name for path in tmp_path.iterdir()} == {"scene.toml", "surface.npz"}
