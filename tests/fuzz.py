"""Broken scenes, gaps, heights, meshes and result folders, by the thousand.

    python tests/fuzz.py 10000      # all of it: figures in docs/measurements/limits.md

Whole files of every format are broken in a few places (bytes replaced, inserted or cut off; fields
of a scene or of result.json taken away, or replaced by values that do not belong there) and handed
to a command in this process. Required are: exit status 0, 2 or 3; one line of error for 2 and 3; no
exception that leaves the command; every file outside the output folder unchanged. The cases follow
from the seed of hypothesis, which is fixed.
"""

import contextlib
import io
import json
import os
import re
import sys
import tempfile
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

sys.path[:0] = [str(Path(__file__).parent / name) for name in ("", "field_file", "mesh")]

import layouts  # noqa: E402
import meshio  # noqa: E402
from mesh_files import CORNERS, scene_of, write_msh  # noqa: E402
from project import ROOT, scene_of_samples, toml, write_toml  # noqa: E402
from test_formats import LAYOUTS, in_um  # noqa: E402
from test_text import FILES, WHOLE  # noqa: E402

from fem_seal import cli  # noqa: E402

STATUSES = {0, 2, 3}

SCENE = scene_of_samples(16)
FLOW = {
    "fluid": {"viscosity": 1e-3},
    "flow": {"pressure_drop": 1e5, "method": "finite-difference"},
    "output": {"products": ["leak_rate", "constriction", "trapped_volume"]},
}
RING = {"kind": "face-seal", "inner_radius": 1, "outer_radius": 2, "mesh_size": 0.5, "gap": 1e-6}
OF_SHAPE = FLOW | {"shape": RING, "flow": {"pressure_drop": 1e5}}
OF_SHAPE |= {"output": {"products": ["leak_rate", "mesh"]}}
# A number of a scene becomes one of these. None of them makes a large problem of a small one.
ODD = [
    *(0, -1, 1, 2, 3.5, True, "", "x", "5 um", "5 kg", "-3 bar", "nan", "1e999 m", "µ", "5 5"),
    *(float("nan"), float("inf"), -float("inf"), 1e308, 1e-320, 10**30, -(10**30)),
    *([], [[]], [1], [1, 2, 3], ["1 um", "2 um"], [0, 0], [-1, 16], {}, {"a": {"b": 1}}),
    *("\x1b[2J", "a\nb", "a\x00b", "../../x", "/dev/null", "/etc/passwd", "x" * 5000, "$\\frac{$"),
    *("elastic", "bearing", "constant", "linear", "wall", "periodic", "gas", "liquid", "file"),
]
GONE = object()  # in the place of a value that is taken away

position = st.integers(0, 1 << 20)
# So many bytes from a place on become others; None: all to the end.
byte_edits = st.lists(
    st.tuples(position, st.sampled_from([0, 1, 1, 16, None]), st.binary(max_size=12)),
    min_size=1,
    max_size=3,
)
value = st.one_of(st.just(GONE), st.sampled_from(ODD))
value_edits = st.lists(st.tuples(position, value), min_size=1, max_size=2)


def broken_bytes(data, edits):
    """Bytes with a few places changed."""
    for place, count, new in edits:
        at = place % max(len(data), 1)
        data = data[:at] + new + (b"" if count is None else data[at + count :])
    return data


def places(value, path=()):
    """Paths of all values inside nested dicts and lists, tables and lists included."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else ()
    items = enumerate(value) if isinstance(value, list) else items
    for key, inner in items:
        yield from places(inner, (*path, key))


def broken_values(data, edits):
    """Nested dicts with a few values changed; `data` stays."""
    data = json.loads(json.dumps(data))
    for place, what in edits:
        paths = list(places(data))
        if not paths:
            return data
        *way, last = paths[place % len(paths)]
        parent = data
        for key in way:
            parent = parent[key]
        if what is GONE:
            del parent[last]
        else:
            parent[last] = json.loads(json.dumps(what))
    return data


def scene(folder, draw):
    """A scene with odd values, or with broken text."""
    gap = {"gap": {"path": "gap.npz"}} | FLOW
    whole = draw(st.sampled_from([SCENE, gap, OF_SHAPE | {"shape": RING | {"kind": "x"}}]))
    np.savez(folder / "gap.npz", gap=_gap(), spacing=(1e-6, 1e-6))
    text = toml(broken_values(whole, draw(value_edits)))
    if draw(st.integers(0, 3)) == 0:
        data = broken_bytes(text.encode(), draw(byte_edits))
    else:
        data = text.encode()
    (folder / "scene.toml").write_bytes(data)
    return ["run", "scene.toml", "--out", "out"]


def _gap():
    gap = 1e-6 * (1 + np.random.default_rng(1).random((6, 4)))
    gap[2:4, 1] = 0
    return gap


@cache
def _whole_fields():
    """Content of whole files of a gap by name, and what a scene must say of each."""
    found = {}
    with tempfile.TemporaryDirectory() as name:
        for layout in LAYOUTS:
            stated = in_um(Path(name, layout))
            said = {"unit": stated.unit, "size": stated.size and list(stated.size)}
            whole = Path(name, layout).read_bytes()
            found[layout] = whole, {key: value for key, value in said.items() if value}
        topography = layouts.topography_nc(Path(name, "b.nc"), _gap(), (6e-6, 4e-6), "m")
        found["b.nc"] = topography.read_bytes(), {"array": "heights"}
    return found


def map_file(folder, draw):
    """A broken file of a gap, or of heights that are prepared and cut by a plane."""
    name = draw(st.sampled_from(sorted(_whole_fields())))
    data, said = _whole_fields()[name]
    # Under a wrong ending other readers see the file.
    ending = draw(st.sampled_from([Path(name).suffix] * 12 + [".npz", ".h5", ".x3p", ".dat"]))
    path = folder / f"{Path(name).stem}{ending}"
    path.write_bytes(broken_bytes(data, draw(byte_edits)))
    said = {"path": path.name} | said
    if draw(st.booleans()):
        data = {"gap": said} | FLOW
    else:
        array = {"array": "gap"} if draw(st.booleans()) else {}
        steps = {"fill": "harmonic", "detrend": "plane", "make_periodic": "mirror"}
        data = {"surface": {"kind": "file"} | array | said | steps}
        data |= {"contact": {"model": "bearing", "area_fraction": 0.2}}
        data |= {"output": {"products": ["contact"]}}
    write_toml(folder / "scene.toml", data)
    return ["run", "scene.toml", "--out", "out"]


# A word of a text file becomes one of these.
ODD_WORDS = [
    *("", "nan", "inf", "-inf", "***", "BAD", "1e999", "1e-320", "-9999", "1e308", "1_0", "0x1F"),
    *("1,5", "1.5", ";", ",", "\t", "\n", "\r", "#", "%", '"', "µm", "nm", "um", "kg", "0", "-1"),
    *("\x00", "Width:", "x-step", "ncols", "NODATA_value 0", "z-unit: um", "x [um]", "\x1b[2J"),
    *("\ufeff", "é"),
]
# Texts of maps and of lists of points as instruments write them.
TEXTS = [*(text for text, _ in FILES.values()), *WHOLE.values()]
word_edits = st.lists(st.tuples(position, st.sampled_from(ODD_WORDS)), max_size=2)


def text_file(folder, draw):
    """A text of heights with odd words and broken bytes, looked at or made a scene of."""
    words = re.split(r"(\s+|[;:,#]+)", draw(st.sampled_from(TEXTS)))
    for place, word in draw(word_edits):
        words[place % len(words)] = word
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le"]))
    data = "".join(words).encode(encoding)
    if draw(st.integers(0, 2)) == 0:
        data = broken_bytes(data, draw(byte_edits))
    (folder / "a.txt").write_bytes(data)
    stated = ["--length-unit", "um", "--size", "6 um,4 um"] if draw(st.booleans()) else []
    new, look = ["new", "a.txt", "--out", "out/a.toml"], ["surface", "a.txt", "--csv", "out/a.csv"]
    return [*draw(st.sampled_from([new, look])), *stated]


@cache
def _whole_meshes():
    """Content of whole mesh files by name, the last of which only gmsh can read."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mesh = meshio.read(write_msh(folder / "a.msh"))
        points = np.column_stack([CORNERS, np.zeros(len(CORNERS))])
        groups = {}
        for k, name in enumerate(("inlet", "outlet", "wall")):
            of_lines = np.array([k == 0, k == 1, k == 2, k == 2], dtype=int)
            groups[name] = [
                of_lines if block.type == "line" else np.zeros(len(block.data), dtype=int)
                for block in mesh.cells
            ]
        whole = meshio.Mesh(points, mesh.cells, cell_data=groups)
        for ending in ("vtu", "xdmf"):
            meshio.write(folder / f"a.{ending}", whole)
        meshio.xdmf.write(folder / "b.xdmf", whole, data_format="XML")
        (folder / "a.geo").write_bytes((ROOT / "meshes" / "strip.geo").read_bytes())
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def mesh_file(folder, draw):
    """A broken mesh; of an .xdmf with its .h5 that is whole, and broken geometries never run."""
    meshes = _whole_meshes()
    name = draw(st.sampled_from(sorted(set(meshes) - {"a.h5"})))
    (folder / "a.h5").write_bytes(meshes["a.h5"])
    (folder / name).write_bytes(broken_bytes(meshes[name], draw(byte_edits)))
    write_toml(folder / "scene.toml", scene_of(name) | {"output": {"products": ["contact"]}})
    return ["run", "scene.toml", "--out", "out"]


@cache
def _whole_results():
    """Files of whole result folders: of a contact, and of a shape with its flow."""
    found = []
    for data in (SCENE, OF_SHAPE):
        with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()):
            path, out = write_toml(Path(name, "scene.toml"), data), Path(name, "out")
            assert cli.main(["run", str(path), "--out", str(out)]) == 0
            found.append({path.name: path.read_bytes() for path in out.iterdir()})
    return found


def result(folder, draw):
    """A result folder from elsewhere of which one file is broken."""
    contact, shape = _whole_results()
    files = draw(st.sampled_from([contact] * 5 + [shape]))
    name = draw(st.sampled_from(["result.json"] * 12 + sorted(files)))
    (folder / "out").mkdir()
    for other, data in files.items():
        (folder / "out" / other).write_bytes(data)
    if name == "result.json" and draw(st.integers(0, 3)):
        data = broken_values(json.loads(files[name]), draw(value_edits))
        (folder / "out" / name).write_text(json.dumps(data))
    else:
        (folder / "out" / name).write_bytes(broken_bytes(files[name], draw(byte_edits)))
    write_toml(folder / "scene.toml", SCENE)
    again = ["run", "scene.toml", "--out", "out"]
    if name != "result.json":
        return draw(st.sampled_from([["render", "out"], ["report", "out"], again]))
    return draw(st.sampled_from([["report", "out"]] * 4 + [again, [*again, "--overwrite"]]))


KINDS = {
    "scenes": scene,
    "maps": map_file,
    "texts": text_file,
    "meshes": mesh_file,
    "results": result,
}


def outside(folder):
    """Content of all files but those of the output folder."""
    return {
        path.relative_to(folder): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
        if path.relative_to(folder).parts[:2] != ("inner", "out")
    }


def check(kind, draw):
    """Break one case, run its command and judge the outcome; returns the exit status."""
    here = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name) / "inner"
        folder.mkdir()
        command = KINDS[kind](folder, draw)
        before = outside(Path(name))
        errors, output = io.StringIO(), io.StringIO()
        os.chdir(folder)
        try:
            with contextlib.redirect_stderr(errors), contextlib.redirect_stdout(output):
                status = cli.main(command)
        finally:
            os.chdir(here)
        after = outside(Path(name))
        said = errors.getvalue()
        assert status in STATUSES, (status, said)
        # One line, or one for each error of a scene below it.
        lines = said.splitlines()
        assert bool(lines) == (status != 0), said
        assert all(line.startswith("  ") for line in lines[1:]), said
        assert "Traceback" not in said
        assert (said + output.getvalue()).replace("\n", "").isprintable(), said
        changed = {path for path in {*before, *after} if before.get(path) != after.get(path)}
        assert not changed, changed
        if status == 2 and kind != "results":
            assert not (folder / "out").exists()
        return status


def campaign(examples, kinds=tuple(KINDS)):
    """Run the cases of each kind; gives how often each kind has ended with each status."""
    tally = Counter()
    repeated = settings(
        max_examples=examples,
        derandomize=True,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    for kind in kinds:

        @repeated
        @given(st.just(kind), st.data())
        def cases(kind, data):
            tally[kind, check(kind, data.draw)] += 1

        cases()
    return tally


if __name__ == "__main__":
    count, *kinds = sys.argv[1:]
    kinds = kinds or list(KINDS)
    for (kind, status), cases in sorted(campaign(int(count) // len(kinds), kinds).items()):
        print(f"{kind}: {cases} ended with status {status}")
