"""One map through every format, in the layouts of the codes that write them."""

import sys

import h5py
import layouts
import numpy as np
import pytest

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.field_file import GAP_NAMES, HEIGHT_NAMES, Stated, instruments, read_map
from fem_seal.field_file.read import READERS
from fem_seal.field_file.recorded import Recorded
from fem_seal.gap_file import load_gap

NX, NY = 6, 4
SIZE = (3e-6, 1e-6)
SPACING = (0.5e-6, 0.25e-6)
UM = (3.0, 1.0)  # the same in µm
GAP = np.random.default_rng(1).random((NX, NY)) * 1e-6
GAP[2:4, 1] = 0

# Lengths that went through a unit and back: two roundings of 2^-53 each.
ROUNDED = {"rtol": 5e-16, "atol": 0}
SAID = Stated(unit="um", size=SIZE)


IN_UM, STEPS, ONE_UM = GAP * 1e6, np.array(SPACING) * 1e6, Stated(unit="um")
NORMAL = np.stack([IN_UM * 0, IN_UM * 0, IN_UM], axis=-1)
LAST = np.stack([IN_UM + 7, IN_UM])
# What the scene must say about a file, and how it is written.
LAYOUTS = {
    "ours.npz": (Stated(), lambda p: np.savez(p, gap=GAP, spacing=SPACING)),
    "unit.npz": (Stated(), lambda p: np.savez(p, gap=IN_UM, spacing=STEPS, unit="um")),
    "reynoldsflow.npz": (Stated(), lambda p: np.savez(p, gaps=GAP, spacing=SPACING)),
    "plain.npy": (SAID, lambda p: np.save(p, IN_UM)),
    "tamaas.npz": (
        ONE_UM,
        lambda p: layouts.tamaas_npz(p, UM, gap=IN_UM, traction=(GAP == 0) * 1.0),
    ),
    "vector.npz": (ONE_UM, lambda p: layouts.tamaas_npz(p, UM, gap=NORMAL)),
    "tamaas.h5": (ONE_UM, lambda p: layouts.tamaas_h5(p, UM, gap=IN_UM)),
    "tamaas.nc": (ONE_UM, lambda p: layouts.tamaas_nc(p, UM, gap=LAST)),
    "hard_wall.txt": (Stated(size=SIZE), lambda p: layouts.hard_wall_text(p, IN_UM, "µm")),
    "container.nc": (SAID, lambda p: layouts.contact_mechanics_nc(p, gap=LAST)),
    "map.x3p": (Stated(), lambda p: layouts.x3p(p, GAP, SPACING)),
    "units.h5": (Stated(), lambda p: layouts.plain_h5(p, "gap", IN_UM, STEPS * 1e3, "um", "nm")),
}


def in_um(path):
    """Write the gap in the layout of this name; return what the scene must say about it."""
    stated, write = LAYOUTS[path.name]
    write(path)
    return stated


@pytest.mark.parametrize("name", LAYOUTS)
def test_same_gap_from_every_layout(name, tmp_path):
    stated = in_um(tmp_path / name)
    gap = load_gap(tmp_path / name, stated)
    np.testing.assert_allclose(gap.values, GAP, **ROUNDED)
    np.testing.assert_allclose(gap.spacing, SPACING, rtol=1e-15)
    # Models of Tamaas repeat; of the others nobody has said so.
    assert gap.periodic == ("tamaas" in name or "vector" in name)


def test_contact_of_tamaas_is_where_it_has_traction(tmp_path):
    """Its gap in contact is a rounding: 31 of 32 points of a 64 x 64 model, up to 6e-14 of it."""
    left = np.where(GAP == 0, 3e-20, GAP)
    layouts.tamaas_npz(tmp_path / "a.npz", SIZE, gap=left, traction=(GAP == 0) * 2.0)
    assert np.array_equal(load_gap(tmp_path / "a.npz", Stated(unit="m")).values, GAP)
    layouts.tamaas_npz(tmp_path / "b.npz", SIZE, gap=left)
    assert np.array_equal(load_gap(tmp_path / "b.npz", Stated(unit="m")).values, left)


def test_a_file_is_read_once_until_it_changes(tmp_path, monkeypatch):
    reads = []

    def read(path, names):
        reads.append(path)
        return Recorded(np.load(path), "m", (1.0, 1.0), "m")

    monkeypatch.setitem(READERS, ".npy", read)
    for values in (GAP, GAP + 1):
        np.save(tmp_path / "a.npy", values)
        for factor in (1.0, 2.0):
            stated = Stated(height_factor=factor)
            assert np.array_equal(
                read_map(tmp_path / "a.npy", HEIGHT_NAMES, stated).values, factor * values
            )
    assert len(reads) == 2


def test_contact_below(tmp_path):
    """Roundings of either sign become contact; a gap that is really negative stays an error."""
    layouts.hard_wall_text(tmp_path / "gap.txt", np.where(GAP == 0, -3e-13, GAP), "m")
    said = Stated(size=SIZE)
    with pytest.raises(InvalidInput, match="negative at 2 of 24"):
        load_gap(tmp_path / "gap.txt", said)
    assert np.array_equal(load_gap(tmp_path / "gap.txt", said, contact_below=1e-12).values, GAP)
    with pytest.raises(InvalidInput, match="negative at 2 of 24"):
        load_gap(tmp_path / "gap.txt", said, contact_below=1e-13)
    with pytest.raises(InvalidInput, match="contact_below = nan must be a positive number"):
        load_gap(tmp_path / "gap.txt", said, contact_below=np.nan)


@pytest.mark.parametrize("unit", ["um", "nm", "A", "m"])
def test_heights_of_surface_topography(unit, tmp_path):
    """Units as its ASCII spells them: A is the ångström."""
    metres = {"um": 1e-6, "nm": 1e-9, "A": 1e-10, "m": 1.0}[unit]
    mask = np.isclose(GAP, GAP.max(), rtol=0, atol=0)
    path = layouts.topography_nc(
        tmp_path / "a.nc", GAP / metres, np.array(SIZE) / metres, unit, False, mask
    )
    found = read_map(path, HEIGHT_NAMES)
    np.testing.assert_allclose(found.values, np.where(mask, np.nan, GAP), **ROUNDED)
    np.testing.assert_allclose(found.spacing, SPACING, rtol=1e-14)
    assert (found.periodic, found.missing) == (False, 1)


def test_real_files_of_surface_topography(tmp_path):
    """Its own NetCDF, and an instrument's format that only it can read, agree with ours."""
    from SurfaceTopography import Topography
    from SurfaceTopography.IO.NC import write_nc_uniform

    size = (3.0, 1.0)
    topography = Topography(GAP * 1e6, size, periodic=True, unit="µm")
    write_nc_uniform(topography, str(tmp_path / "real.nc"))
    layouts.topography_nc(tmp_path / "ours.nc", GAP * 1e6, size, "um")
    real, ours = (read_map(tmp_path / name, HEIGHT_NAMES) for name in ("real.nc", "ours.nc"))
    assert np.array_equal(real.values, ours.values)
    assert (real.spacing, real.periodic) == (ours.spacing, True)
    # The same bytes under an ending that is not ours go through SurfaceTopography.
    (tmp_path / "real.dat").write_bytes((tmp_path / "real.nc").read_bytes())
    through = read_map(tmp_path / "real.dat", HEIGHT_NAMES)
    np.testing.assert_allclose(through.values, real.values, **ROUNDED)
    # It writes lengths in single precision.
    np.testing.assert_allclose(through.spacing, real.spacing, rtol=2**-24)
    assert through.periodic


@pytest.mark.parametrize("padding", range(4))
def test_simple_field_of_gwyddion(tmp_path, padding):
    """Heights in single precision behind one to four zero bytes; each line runs along x."""
    keys = f"XRes = 6\nYRes = 4\nXReal = {SIZE[0]}\nYReal = {SIZE[1]}\nXYUnits = m\nZUnits = m\n"
    head = f"Gwyddion Simple Field 1.0\n{keys}Title = {'a' * padding}\n".encode()
    zeros, path = b"\0" * (4 - len(head) % 4), tmp_path / "a.gsf"
    missing = np.where(GAP.max() == GAP, np.nan, GAP)
    path.write_bytes(head + zeros + missing.T.astype("<f4").tobytes())
    found = read_map(path, HEIGHT_NAMES)
    np.testing.assert_allclose(found.values, missing, rtol=2**-24)
    np.testing.assert_allclose(found.spacing, SPACING, rtol=1e-15)
    # What an instrument has measured does not repeat, unless the scene knows better.
    assert found.periodic is False
    assert read_map(path, HEIGHT_NAMES, Stated(periodic=True)).periodic
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InvalidInput, match="not a whole GSF file"):
        read_map(path, HEIGHT_NAMES)


@pytest.mark.parametrize("kind", ["I <i2", "I <u2", "L <i4", "L <u4"])
def test_integers_of_x3p(tmp_path, kind):
    """Signed, as openGPS has them, or not; a file of bits tells the points that are missing."""
    x, y = np.meshgrid(np.arange(NX), np.arange(NY), indexing="ij")
    valid, heights = ~((x == 2) & (y == 1)), 1e-6 * np.cos(x) + 2e-7 * y
    letter, dtype = kind.split()
    steps = np.rint(heights / 1e-10) if dtype[1] == "i" else np.rint(heights / 1e-10) + 3e4
    start = 0.0 if dtype[1] == "i" else -3e-6
    points = np.where(valid, steps, 0)
    layouts.x3p(tmp_path / "a.x3p", points, SPACING, letter, dtype, 1e-10, start, valid)
    found = read_map(tmp_path / "a.x3p", HEIGHT_NAMES)
    np.testing.assert_allclose(found.values, np.where(valid, heights, np.nan), atol=0.51e-10)
    np.testing.assert_allclose(found.spacing, SPACING, rtol=1e-15)
    assert found.periodic is False


@pytest.mark.parametrize("special", [0, 1])
def test_points_of_sur_that_were_not_measured(tmp_path, special):
    """They stand two steps below the lowest height, if the header says that there are some."""
    steps = np.rint(GAP * 1e10)
    steps[2, 1] = steps[GAP > 0].min() - 2
    steps[3, 1] = steps[GAP > 0].min()
    layouts.sur(tmp_path / "a.sur", steps, SPACING, 1e-10, special)
    found = read_map(tmp_path / "a.sur", HEIGHT_NAMES)
    missing = (np.arange(GAP.size) == 2 * NY + 1).reshape(GAP.shape) & (special == 1)
    # The step stands in single precision in the header.
    np.testing.assert_allclose(
        found.values, np.where(missing, np.nan, steps * 1e-10), rtol=2**-23, atol=1e-20
    )


MARK, PACKED = GAP[1, 2], np.arange(24, dtype=np.int16).reshape(6, 4)
SQUARE, MASK = GAP[:4], np.eye(4, k=1)


@pytest.mark.parametrize("write", [layouts.netcdf, layouts.netcdf_4])
@pytest.mark.parametrize(
    ("arrays", "attributes", "dimensions", "expected"),
    [
        ({"heights": GAP}, {"_FillValue": MARK}, "xy", np.where(MARK == GAP, np.nan, GAP)),
        (
            {"heights": PACKED},
            {"_FillValue": np.int16(7), "missing_value": np.int16(9)},
            "xy",
            np.where((PACKED == 7) | (PACKED == 9), np.nan, PACKED),
        ),
        # As xarray writes them; a square map does not show its order otherwise.
        (
            {"heights": SQUARE.T, "mask": MASK.T.astype(np.int8)},
            {},
            "yx",
            np.where(MASK, np.nan, SQUARE),
        ),
    ],
    ids=["fill value", "two marks", "y first"],
)
def test_conventions_of_netcdf(write, arrays, attributes, dimensions, expected, tmp_path):
    """In versions 3 and 4."""
    path = write(tmp_path / "a.nc", attributes, dimensions, **arrays)
    found = read_map(path, HEIGHT_NAMES, Stated(unit="m", size=SIZE))
    np.testing.assert_array_equal(found.values, expected)


@pytest.mark.parametrize(
    ("name", "neutral", "other"),
    [
        *((name, 1.0, 1e-3) for name in ("scale", "z_scale", "Zscale", "multiplier")),
        ("scale", "linear", 0.5),
        ("scale_factor", 1.0, 0.25),
        ("scale_factor", 1, "um"),
        ("add_offset", 0.0, 2.0),
        ("_Unsigned", "false", "true"),
        *((f"valid_{end}", None, 1e-7) for end in ("min", "max", "range")),
    ],
)
def test_attributes_that_would_change_numbers(name, neutral, other, tmp_path):
    """Whether a factor is in the values already is not known; packed numbers are not unpacked."""
    layouts.plain_h5(tmp_path / "a.h5", "heights", GAP, SPACING, "m", "m")
    for value in {neutral, other} - {None}:
        with h5py.File(tmp_path / "a.h5", "a") as file:
            file["heights"].attrs[name] = value
        if value == other:
            with pytest.raises(InvalidInput, match=f"attribute {name} = {value}, which is not"):
                read_map(tmp_path / "a.h5", HEIGHT_NAMES)
        else:
            np.testing.assert_array_equal(read_map(tmp_path / "a.h5", HEIGHT_NAMES).values, GAP)


def test_named_array(tmp_path):
    np.savez(tmp_path / "a.npz", gap=GAP, filtered=2 * GAP, spacing=SPACING)
    assert np.array_equal(load_gap(tmp_path / "a.npz", Stated(array="filtered")).values, 2 * GAP)
    layouts.plain_h5(tmp_path / "a.h5", "scan/gap", GAP)
    with pytest.raises(InvalidInput, match="holds scan/gap"):
        load_gap(tmp_path / "a.h5", Stated(unit="m", size=SIZE))
    inside = load_gap(tmp_path / "a.h5", Stated(array="scan/gap", unit="m", size=SIZE))
    np.testing.assert_array_equal(inside.values, GAP)


def test_file_and_scene_may_say_the_same(tmp_path):
    in_um(tmp_path / "unit.npz")
    said = Stated(unit="µm", size=SIZE)
    assert load_gap(tmp_path / "unit.npz", said).spacing == pytest.approx(SPACING, rel=1e-15)


def test_single_precision_coordinates_are_even(tmp_path):
    """0.1 has no end in binary: steps of float32 coordinates differ by their rounding."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["gap"] = GAP
        file["gap"].attrs["units"] = "m"
        for name, n in zip("xy", GAP.shape, strict=True):
            file[name] = (1e3 + 0.1 * np.arange(n)).astype(np.float32)
            file[name].attrs["units"] = "m"
    # Ends of the axis are rounded to 2^-24 of 1000.
    assert load_gap(tmp_path / "a.h5").spacing == pytest.approx((0.1, 0.1), abs=1e3 * 2**-23)


@pytest.mark.parametrize("debian", [True, False])
@pytest.mark.parametrize(
    ("package", "name"), [("h5py", "tamaas.h5"), ("SurfaceTopography", "map.datx")]
)
def test_missing_package(package, name, debian, tmp_path, monkeypatch):
    """The remedy is that of the environment: setup.sh leaves there which numpy must stay."""
    layouts.tamaas_h5(tmp_path / name, UM, gap=GAP)
    if debian:
        (tmp_path / "debian.txt").touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    remedy = ".venv/bin/pip install -c .venv/debian.txt" if debian else "python -m pip install"
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setitem(sys.modules, f"{package}.Exceptions", None)
    with pytest.raises(
        MissingPackage,
        match=f"needs? {package}: {remedy} {package}",
    ):
        read_map(tmp_path / name, GAP_NAMES, SAID)


def test_channel_of_an_instrument(tmp_path):
    """By its name; others are listed."""
    layouts.topography_nc(tmp_path / "a.dat", GAP, SIZE, "m")
    found = read_map(tmp_path / "a.dat", HEIGHT_NAMES, Stated(array="Default"))
    assert np.array_equal(found.values, GAP)
    with pytest.raises(InvalidInput, match="has no channel 'Phase'; it holds 'Default'"):
        read_map(tmp_path / "a.dat", HEIGHT_NAMES, Stated(array="Phase"))


@pytest.mark.parametrize(
    ("name", "shape", "channels", "misread"),
    [
        ("di", (4, 4), 2, None),
        ("di", (6, 4), 1, "the lines of maps that are not square"),
        ("oir", (6, 4), 1, None),
        ("oir", (6, 4), 2, "all but one of several channels"),
        ("mi", (4, 4), 1, "the lengths"),
        ("bcr", (4, 4), 1, "the missing points"),
    ],
)
def test_what_surface_topography_misreads(monkeypatch, tmp_path, name, shape, channels, misread):
    """A stand-in for its reader; maps that it reads well are read."""
    layouts.topography_nc(tmp_path / "a.dat", GAP[:4] if shape[0] == 4 else GAP, SIZE, "m")
    opened = instruments._open

    def of_format(path):
        reader = opened(path)
        (channel,) = reader.channels
        stand_in = type(reader)
        monkeypatch.setattr(stand_in, "format", lambda self: name)
        monkeypatch.setattr(stand_in, "channels", channels * [channel])
        return reader

    monkeypatch.setattr(instruments, "_open", of_format)
    if misread is None:
        assert read_map(tmp_path / "a.dat", HEIGHT_NAMES).values.shape == shape
        return
    with pytest.raises(InvalidInput, match=f"format '{name}', .* misreads {misread}"):
        read_map(tmp_path / "a.dat", HEIGHT_NAMES)
