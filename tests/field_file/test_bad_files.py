"""Bad files: one sentence that names the file and the fault, exit status 2, nothing written."""

import re

import h5py
import layouts
import numpy as np
import pytest
from test_formats import GAP, LAYOUTS, SIZE, SPACING, in_um

from fem_seal.errors import InvalidInput
from fem_seal.field_file import GAP_NAMES, Stated, read_map

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


UNEVEN = np.array([0, 1, 2, 3, 4, 5.2]) * SPACING[0]


def of_h5(words, said=Stated(), **more):  # noqa: B008
    return "a.h5", lambda p: h5(p, **more), said, words


def of_attribute(words, name, value, of="x"):
    return "a.h5", lambda p: h5_attribute(p, name, value, of), Stated(), words


def of_npy(words, values, said=SAID):
    return "a.npy", lambda p: np.save(p, values), said, words


def of_npz(words, said, **arrays):
    return "a.npz", lambda p: np.savez(p, **arrays), said, words


def of_text(words, text, name="a.txt"):
    content = text if isinstance(text, bytes) else text.encode()
    return name, lambda p: p.write_bytes(content), SAID, words


FRAMES = layouts.contact_mechanics_nc
CASES = {
    "no unit": of_h5("have no unit; say it", unit=None),
    "no unit of x": (
        "a.h5",
        lambda p: layouts.plain_h5(p, "gap", GAP, SPACING, "m"),
        Stated(),
        "the lengths of .*a.h5 have no unit; give its size",
    ),
    "unit of x": (
        "a.txt",
        lambda p: p.write_text(
            "".join(f"{i / 1000} {j / 1000} {z}\n" for (i, j), z in np.ndenumerate(GAP * 1e6))
        ),
        Stated(unit="um"),
        r"its rms slope is [\de+.]+; check the unit",
    ),
    "no size": of_npy("does not say its lengths; give its size", GAP, Stated(unit="um")),
    "ampere": of_h5("in 'mA', which is no unit of length", unit="mA"),
    "mask of words": of_h5("mask in .*a.h5 must hold true", mask=np.full(GAP.shape, b"no")),
    "periodic of words": of_attribute(
        "periodic in .*a.h5 must be one true or false, got 'false'", "periodic", "false"
    ),
    "unit against the scene": of_h5("are in m, but unit = 'um' was given; leave out", SAID),
    "size against the scene": of_h5(
        "size = 3e-06 m by 1e-06 m, but size = 3.00001e-06 m by 1e-06 m was given",
        Stated(size=(3.00001e-6, 1e-6)),
    ),
    "repeats against the scene": of_npz(
        "says periodic = False, but True was given; .*make_periodic",
        Stated(periodic=True),
        **{"gap": GAP, "spacing": SPACING, "periodic": False},
    ),
    "units of x and y": of_h5("differ in unit: m, mm", y_unit="mm"),
    "uneven": of_h5("x in .* not evenly spaced: its steps are from 5e-07 to 6e-07;", x=UNEVEN),
    "falling": of_h5("x in .* falls; reverse it, and the samples along x", x=UNEVEN[::-1]),
    "a single coordinate": of_h5("x in .* is a single coordinate", gap=GAP[:1], x=UNEVEN[:1]),
    "too many coordinates": of_h5("6 coordinates", x=np.arange(7.0)),
    "infinite": of_npy("24 of 24 values .* infinite", GAP + np.inf),
    "missing points of a gap": of_npy("not finite", GAP * np.nan),
    "volume": of_h5(r"has shape \(2, 6, 4\)", gap=np.stack([GAP, GAP])),
    "no gap": (
        "a.nc",
        lambda p: FRAMES(p, displacements=GAP[None], forces=GAP[None]),
        SAID,
        "has no array 'gap' or 'gaps'; it holds displacements, forces",
    ),
    "a name that is not UTF-8": (
        "a.h5",
        lambda p: h5py.File(p, "w").create_dataset(b"\x86", data=GAP).file.close(),
        SAID,
        "has no array 'gap' or 'gaps'; it holds \N{REPLACEMENT CHARACTER}",
    ),
    "no frame": ("a.nc", lambda p: FRAMES(p, gap=GAP[None][:0]), SAID, "gap in .* has no frame"),
    "no such array": of_h5("no array 'height'; it holds gap, x, y", Stated(array="height")),
    "traction of another shape": (
        "a.npz",
        lambda p: layouts.tamaas_npz(p, (3.0, 1.0), gap=GAP, traction=GAP[1:]),
        Stated(unit="um"),
        r"shape \(6, 4\), but its contact pressure \(5, 4\)",
    ),
    "attributes of Tamaas": of_npz(
        "attrs in .* is not the JSON that Tamaas writes", SAID, gap=GAP, attrs="{"
    ),
    "ragged text": of_text(
        "line 3 of .*a.txt has 1 number, and other lines have 2: '3'", "1 2\n\n3\n"
    ),
    "empty text": of_text("holds no numbers: it is", "# nothing\n"),
    "words": of_text("line 2 is 'one two'", "\none two\n"),
    "a word in the first line": of_text("line 1, column 3 of .*a.txt is '3o'", "1 2 3o\n4 5 6\n"),
    "commas of two kinds": of_text(
        "lines such as '1,5, 2,5', whose commas may be decimal commas or stand between",
        "0,5, 0,7\n1,5, 2,5\n",
        "a.csv",
    ),
    "a point among decimal commas": of_text(
        r"is '0.5', which is no number \(other numbers have decimal commas\)",
        "1,5;2,5\n0.5;2,5\n1,5;2,5\n",
        "a.csv",
    ),
    "an underscore": of_text("column 2 .* '4_0'", "1 2\n3 4_0\n"),
    "bytes": of_text("no text file, character", b"1 2 3 4\x00 5"),
    "half of UTF-16": of_text("byte 17 is no text in UTF-16", "1 2\n3 4\n".encode("utf-16")[:-1]),
    "fewer lines than announced": of_text(
        "holds 3 lines of 3 numbers, and its header announces 4 of 3; it may be cut off",
        "ncols 3\nnrows 4\n1 2 3\n4 5 6\n7 8 9\n",
    ),
    "an infinite coordinate": of_text(
        "1 of 12 values .* infinite", "0 1 2 1e999\n1 3 1 2\n2 1 1 5\n"
    ),
    "a profile": of_text("is a line scan", "0 1\n1 2\n2 3\n3 1\n"),
    "points of no grid": of_text(
        "line 3 of .*a.txt: x = .* is not on the even grid", "0 0 1\n0 1 2\n1 0 3\n1.3 1 4\n"
    ),
    "few points": of_text(
        "its 9 points are few of the 9 x 9", "".join(f"{k} {k} 1\n" for k in range(9))
    ),
    "a point twice": of_text(
        "line 5 of .*a.txt has the same x and y as a line before it",
        "0 0 1\n0 1 2\n1 0 3\n# again\n0 1 4\n1 1 2\n",
    ),
    "a point nowhere": of_text(
        "line 3 of .*a.txt has no x or no y", "0 0 1\n0 1 2\n1 nan 3\n1 1 4\n"
    ),
    "three columns that are no list": of_text(
        "x is the same in all lines; a map that is three samples wide",
        "1 2 3\n1 3 4\n1 4 5\n1 5 3\n",
    ),
    "unknown format": of_text("no format that Surface", b"\x00\x01" * 9, "a.xyz1"),
    "fill value of words": of_attribute(
        "_FillValue of gap in .*a.h5 must be one number, got 'none'", "_FillValue", "none", "gap"
    ),
    "NetCDF that is none": of_text("not a whole NetCDF file", "CDF", "a.nc"),
    "HDF5 that is none": of_text("cannot be read", "HDF", "a.h5"),
    "single row": of_npz("two", Stated(), gap=GAP[:1], spacing=SPACING),
}
ARRAYS = {
    "no spacing": {"gap": GAP},
    "negative": {"gap": GAP - 1e-7, "spacing": SPACING},
    "NaN spacing": {"gap": GAP, "spacing": [1, np.nan]},
    "spacing without a square": {"gap": GAP, "spacing": [1e-200, 1e-200]},
    "spacings of other worlds": {"gap": GAP, "spacing": [1e7, 1e-7]},
    "one spacing": {"gap": GAP, "spacing": 1.0},
    "empty": {"gap": np.ones((0, 5)), "spacing": SPACING},
    "text": {"gap": np.full((5, 5), "1"), "spacing": SPACING},
    "bool": {"gap": GAP > 0, "spacing": SPACING},
    "objects": {"gap": np.array([[None]]), "spacing": SPACING},
}
CASES |= {name: of_npz(r"a\.npz", Stated(), **arrays) for name, arrays in ARRAYS.items()}


@pytest.mark.parametrize("case", CASES)
def test_bad_file(case, tmp_path, here, refused):
    """Through the command."""
    name, write, said, words = CASES[case]
    write(tmp_path / name)
    arguments = ["leak", name, "--out", "out", "--method", "finite-difference"]
    for option, value in (
        ("--length-unit", said.unit),
        ("--array", said.array),
        ("--size", said.size and f"{said.size[0]},{said.size[1]}"),
        ("--periodic", said.periodic and "yes"),
    ):
        arguments += [option, value] if value else []
    assert re.search(words, refused(*arguments))


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
