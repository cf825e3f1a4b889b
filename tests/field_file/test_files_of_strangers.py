"""Files from elsewhere cannot make the program read others, exhaust memory or rewrite a screen."""

import zipfile

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from project import write_toml

from fem_seal import cli
from fem_seal.errors import InvalidInput, printable
from fem_seal.field_file import GAP_NAMES, Stated, read_map
from fem_seal.memory import within_available_memory
from fem_seal.mesh.files import GroupNames, read_triangles

GAP = np.linspace(1e-6, 2e-6, 12).reshape(4, 3)
SAID = Stated(unit="m", size=(4e-6, 3e-6))


@pytest.fixture
def secret(tmp_path):
    """A file of the reader's own that nothing must read, as HDF5 and as plain bytes."""
    (tmp_path / "secret").mkdir()
    with h5py.File(tmp_path / "secret" / "own.h5", "w") as file:
        file["gap"] = GAP
    GAP.tofile(tmp_path / "secret" / "own.bin")
    return tmp_path / "secret"


def external_link(file, secret):
    file["gap"] = h5py.ExternalLink(str(secret / "own.h5"), "/gap")


def soft_link_to_an_external_one(file, secret):
    file["inner/gap"] = h5py.ExternalLink(str(secret / "own.h5"), "/gap")
    file["gap"] = h5py.SoftLink("/inner/gap")


def external_folder(file, secret):
    file["inner"] = h5py.ExternalLink(str(secret / "own.h5"), "/")
    file["gap"] = h5py.SoftLink("/inner/gap")


def virtual(file, secret):
    layout = h5py.VirtualLayout(GAP.shape, GAP.dtype)
    layout[...] = h5py.VirtualSource(str(secret / "own.h5"), "gap", GAP.shape)
    file.create_virtual_dataset("gap", layout)


def raw(file, secret):
    file.create_dataset(
        "gap", GAP.shape, GAP.dtype, external=[(str(secret / "own.bin"), 0, GAP.nbytes)]
    )


ELSEWHERE = (external_link, soft_link_to_an_external_one, external_folder, virtual, raw)


@pytest.mark.parametrize("ending", ["h5", "nc"])
@pytest.mark.parametrize("put", ELSEWHERE)
def test_data_in_other_files(put, ending, secret, tmp_path):
    """Each would read the other file: h5py alone does."""
    path = tmp_path / f"stranger.{ending}"
    with h5py.File(path, "w") as file:
        put(file, secret)
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["gap"][()], GAP)
    with pytest.raises(InvalidInput, match=r"stranger.* other files, which is not followed"):
        read_map(path, GAP_NAMES, SAID)


def test_link_within_the_file(tmp_path):
    with h5py.File(tmp_path / "own.h5", "w") as file:
        file["inner/heights"] = GAP
        file["gap"] = h5py.SoftLink("/inner/heights")
    np.testing.assert_array_equal(read_map(tmp_path / "own.h5", GAP_NAMES, SAID).values, GAP)


XDMF = """<Xdmf Version="3.0"><Domain><Grid><Geometry GeometryType="XY">
<DataItem DataType="Float" Dimensions="4 3" Format="{}" Precision="8">{}</DataItem></Geometry>
<Topology TopologyType="Triangle"><DataItem DataType="Int" Dimensions="1 3" Format="XML"
Precision="8">0 1 2</DataItem></Topology></Grid></Domain></Xdmf>"""


@pytest.mark.parametrize(
    ("form", "place"), [("Binary", "secret/own.bin"), ("HDF", "secret/own.h5:/gap")]
)
def test_xdmf_of_other_folders(form, place, secret, tmp_path):
    path = tmp_path / "stranger.xdmf"
    for name in (place, str(tmp_path / place)):
        path.write_text(XDMF.format(form, name))
        with pytest.raises(InvalidInput, match=r"only an HDF5 file in the same folder is read"):
            read_triangles(path, 1.0, GroupNames())


def test_xdmf_beside_a_file_of_links(secret, tmp_path):
    with h5py.File(tmp_path / "beside.h5", "w") as file:
        external_link(file, secret)
    (tmp_path / "a.xdmf").write_text(XDMF.format("HDF", "beside.h5:/gap"))
    with pytest.raises(InvalidInput, match=r"gap in .*beside.h5 is a link to other files"):
        read_triangles(tmp_path / "a.xdmf", 1.0, GroupNames())


HUGE = (1 << 25, 1 << 25)  # 2^53 bytes as float64: no machine has 9 petabytes


def huge_npy(path):
    with path.open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": HUGE}
        np.lib.format.write_array_header_1_0(file, header)


def huge_npz(path):
    huge_npy(path.with_suffix(".npy"))
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(path.with_suffix(".npy"), "gap.npy")
    path.with_suffix(".npy").unlink()


def huge_hdf5(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("gap", HUGE, "f8", chunks=(64, 64))


def huge_mask(path):
    with h5py.File(path, "w") as file:
        file["gap"] = GAP
        file.create_dataset("mask", HUGE, "i1", chunks=(64, 64))


LARGE = {
    "a.npy": huge_npy,
    "a.npz": huge_npz,
    "a.h5": huge_hdf5,
    "a.nc": huge_hdf5,
    "mask.h5": huge_mask,
}


def too_large(name):
    return pytest.raises(InvalidInput, match=rf"reading .*{name} would take more than the .* GB of")


@pytest.mark.parametrize("name", LARGE)
def test_a_file_that_declares_more_than_the_memory(name, tmp_path):
    LARGE[name](tmp_path / name)
    with too_large(name):
        read_map(tmp_path / name, GAP_NAMES, SAID)


def test_libraries_that_believe_a_file(monkeypatch):
    """What they allocate beyond the memory there is fails at once, and only inside.

    A gigabyte, of which no earlier test has freed half: the C library would give that again.
    """
    monkeypatch.setattr("fem_seal.memory.available_memory", lambda: 1 << 30)
    with too_large(r"a\.dat"), within_available_memory("a.dat"):
        np.empty(3 << 29, dtype=np.uint8)
    with within_available_memory("a.dat"):
        np.empty(1 << 29, dtype=np.uint8)
    np.empty(3 << 29, dtype=np.uint8)


@given(st.text())
def test_printable(text):
    """Nothing that a terminal obeys is left; what can be printed is as it was."""
    shown = printable(text)
    assert all(letter.isprintable() or letter == "\n" for letter in shown)
    assert printable(shown) == shown
    if text.isprintable():
        assert shown == text


EVIL = "\x1b]0;owned\x07\x1b[2J\r\u202e\x9b31m"


# Name of a file, its arrays, and options of the command.
WHOLE = {"gap": GAP, "spacing": (1, 1)}
HOSTILE = {
    "name": (f"a{EVIL}\n.npz", {"gap": GAP}, []),
    "array": ("a.npz", {f"gap{EVIL}": GAP}, []),
    "unit": ("a.npz", WHOLE | {"unit": EVIL}, []),
    "option": ("a.npz", WHOLE, ["--sides", EVIL]),
    "number": ("a.npz", WHOLE, ["--rtol", EVIL]),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_terminal_obeys_no_file(case, tmp_path, refused):
    name, arrays, options = HOSTILE[case]
    with (tmp_path / name).open("wb") as file:
        np.savez(file, **arrays)
    said = refused("leak", tmp_path / name, *options)
    assert said.removesuffix("\n").isprintable()
    assert "\\x1b]0;owned\\x07" in said


def test_output_obeys_no_file(tmp_path, capsys):
    """What ends well is printed by another way."""
    path = tmp_path / f"a{EVIL}.npz"
    np.savez(path, gap=GAP, spacing=(1e-6, 1e-6))
    out = tmp_path / f"out{EVIL}"
    options = ["--method", "finite-difference", "--out", str(out)]
    assert cli.main(["leak", str(path), *options]) == 0
    said = capsys.readouterr().out
    assert "\\x1b]0;owned" in said
    assert said.replace("\n", "").isprintable()


DEEP = ".".join(["a"] * 50_000)
SCENES = {
    "half a table": "[surface\n",
    "no text": "\udcff\udcfe\0",
    "key": f"{DEEP} = 1\n",
    "table": f"[{DEEP}]\n",
    "quoted": ".".join(['"="'] * 50_000) + " = 1\n",
    "inline table": f"x = {{ {DEEP} = 1 }}\n",
    "tables inside each other": "x = " + "{a = " * 200 + "1" + "}" * 200,
    "lists inside each other": "x = " + "[" * 3000 + "]" * 3000,
    "digits": "x = " + "1" * 5000,
}


@pytest.mark.parametrize("case", SCENES)
def test_what_is_no_scene(case, tmp_path, refused):
    (tmp_path / "scene.toml").write_text(SCENES[case], errors="surrogateescape")
    assert "scene.toml is not a TOML scene file" in refused("run", tmp_path / "scene.toml")


def test_a_file_of_another_kind(small_scene, tmp_path, refused):
    """The message names the command that takes it."""
    scene = write_toml(tmp_path / "scene.toml", small_scene)
    (tmp_path / "result.json").write_text("{}")
    np.savez(tmp_path / "gap.npz", gap=GAP, spacing=(1e-6, 1e-6))
    assert "fem-seal run" in refused("leak", scene)
    assert "fem-seal report" in refused("run", tmp_path / "result.json")
    assert "fem-seal leak" in refused("surface", tmp_path / "gap.npz")


@pytest.mark.parametrize(
    ("command", "option", "setting", "words"),
    [
        ("run", "--set", f"flow.rtol={'[' * 3000}", ""),
        ("run", "--set", f"flow.rtol={'1' * 5000}", ""),
        ("run", "--set", f"{DEEP}=1", "is not of the form section.key=value"),
        ("sweep", "--vary", f"{DEEP}=1", "is not of the form section.key=value"),
    ],
    ids=["nested", "digits", "key", "varied key"],
)
def test_settings_that_choke_a_parser(command, option, setting, words, scene_file, refused):
    said = refused(command, scene_file, option, setting)
    assert words in said
    assert len(said) < 2500 or not words  # one sentence, not 50 000 parts of one
