"""Mesh files: complete ones are read in every format, others are refused in one sentence."""

import meshio
import numpy as np
import pytest
from mesh_files import CELLS, CORNERS, EDGES, scene_of, write_msh
from nested_meshes import side_lengths

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.scene import Scene
from fem_seal.shaped import shaped_film


def gap_of(path, **fields):
    return shaped_film(Scene.from_mapping(scene_of(path, **fields)).shape, None)


WHOLE = {"inlet": 1.0, "outlet": 1.0, "wall": 2.0}


NUMBERS = np.array([1, 2, 3, 3])
NUMBERED = {"inlet": 1, "outlet": 2, "wall": 3}


def by_meshio(path, arrays, **options):
    """The square with numbers of its edges in cell arrays."""
    lines = np.concatenate([EDGES[name] for name in EDGES])
    blocks = [("triangle", np.array(CELLS)), ("line", lines)]
    data = {name: [np.zeros(4, dtype=int), numbers.astype(int)] for name, numbers in arrays.items()}
    meshio.write(path, meshio.Mesh(CORNERS, blocks, cell_data=data), **options)
    return path


def xdmf(path):
    """With its numbers in the file itself."""
    return by_meshio(path, {"boundary": NUMBERS}, data_format="XML")


# How a file is written, and the groups of its edges where they have no names.
FILES = {
    "a.msh": (write_msh, {}),
    "A.MSH": (write_msh, {}),
    "arrays.vtu": (
        lambda path: by_meshio(path, {name: k + 1 == NUMBERS for k, name in enumerate(EDGES)}),
        {},
    ),
    "numbers.vtu": (lambda path: by_meshio(path, {"boundary": NUMBERS}), NUMBERED),
    "a.xdmf": (xdmf, NUMBERED),
}


@pytest.mark.parametrize("name", FILES)
def test_whole_files(name, tmp_path):
    write, groups = FILES[name]
    write(tmp_path / name)
    gap = gap_of(tmp_path / name, **groups)
    assert side_lengths(gap.mesh) == WHOLE
    assert gap.mesh.doubled_areas().sum() == 2.0


def test_unit_of_the_file(tmp_path):
    """Formats of meshes have no unit: the scene must say it."""
    path = write_msh(tmp_path / "a.msh", points=1000 * CORNERS)
    assert side_lengths(gap_of(path, unit="mm").mesh) == pytest.approx(WHOLE, rel=1e-15)
    scene = scene_of(path)
    del scene["shape"]["unit"]
    with pytest.raises(InvalidInput, match=r"shape.unit is missing .unit of its lengths"):
        Scene.from_mapping(scene)


def test_numbers_of_groups_must_be_told(tmp_path):
    path = by_meshio(tmp_path / "a.vtu", {"boundary": NUMBERS})
    with pytest.raises(InvalidInput, match=r"a group 'inlet'; it has boundary \(1, 2, 3\): name"):
        gap_of(path)
    path = by_meshio(path, {"boundary": NUMBERS, "part": NUMBERS})
    with pytest.raises(InvalidInput, match=r"several integer cell arrays \(boundary, part\)"):
        gap_of(path, **NUMBERED)


@pytest.mark.parametrize("point", [11, -1])
def test_a_point_that_the_file_does_not_hold(point, tmp_path, monkeypatch):
    monkeypatch.setattr(f"{__name__}.CELLS", [*CELLS[:3], [3, 0, point]])
    path = by_meshio(tmp_path / "a.vtu", {"boundary": NUMBERS})
    with pytest.raises(InvalidInput, match=f"names point {point} but holds only 5 points"):
        gap_of(path, **NUMBERED)


def test_what_a_mesh_takes_from_other_files_is_an_input(tmp_path):
    """A point is named by the content of all files; a geometry may name one that names another."""
    mesh = by_meshio(tmp_path / "a.xdmf", {"boundary": NUMBERS})
    (tmp_path / "a.geo").write_text('Include "b.geo"; Merge("gone.msh");')
    (tmp_path / "b.geo").write_text('Include "a.geo"; Merge "c.geo"; Merge "x\0y";')
    (tmp_path / "c.geo").write_text("r = 1;")
    for path, within in ((mesh, {"a.h5"}), (tmp_path / "a.geo", {"b.geo", "c.geo"})):
        scene = Scene.from_mapping(scene_of(path))
        assert {file.name for _, file in scene.input_files} == {path.name} | within
        names = {scene.fingerprint()}
        for name in within:
            with (tmp_path / name).open("ab") as file:
                file.write(b" ")
            names.add(scene.fingerprint())
        assert len(names) == 1 + len(within)


def test_xdmf_needs_h5py(tmp_path, monkeypatch):
    path = xdmf(tmp_path / "a.xdmf")
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(MissingPackage, match=r"needs the package h5py \(pip install h5py\)"):
        gap_of(path, **NUMBERED)


@pytest.mark.parametrize("clockwise", [4, 1])
def test_clockwise_triangles_are_turned(clockwise, tmp_path):
    """A mesh may be right and only its points in another order."""
    cells = [c[::-1] if k < clockwise else c for k, c in enumerate(CELLS)]
    assert side_lengths(gap_of(write_msh(tmp_path / "a.msh", cells=cells)).mesh) == WHOLE


HANGING = {
    "points": np.vstack([CORNERS, [0.75, 0.75]]),
    "cells": [CELLS[0], CELLS[1], [2, 3, 5], [5, 3, 4], CELLS[3]],
}
DOUBLED = {
    "points": np.vstack([CORNERS, CORNERS[4] + 1e-12]),
    "cells": [CELLS[0], CELLS[1], [2, 3, 5], [3, 0, 5]],
}
# The last cell, halved at a point next to a corner.
HARDLY = {
    "points": np.vstack([CORNERS, [1e-13, 1.0]]),
    "cells": [*CELLS[:3], [3, 5, 4], [5, 0, 4]],
}
MIDDLES = np.array([[0.5, 0], [0.75, 0.25], [0.25, 0.25]])
CURVED = {"points": np.vstack([CORNERS, MIDDLES]), "cells": [[0, 1, 4, 5, 6, 7]]}
FOLDED = np.array([[0, 0], [1, 0], [0, 1], [0.2, 0.9]])
BROKEN = {
    "no groups": ({"edges": {}}, "it has no group of edges, such as a physical curve of gmsh"),
    "no inlet": ({"edges": {"outlet": [[1, 2]], "wall": [[0, 1], [2, 3], [3, 0]]}}, "'inlet'"),
    "no wall": (
        {"edges": {"inlet": [[3, 0]], "outlet": [[1, 2]]}},
        "the boundary has 2 edges in none of the groups inlet, outlet and wall",
    ),
    "edge in two groups": (
        {"edges": EDGES | {"wall": [[0, 1], [2, 3], [3, 0]]}},
        "the group wall shares 1 edge of the boundary with another group",
    ),
    "group inside": (
        {"edges": EDGES | {"wall": [[0, 1], [2, 3], [0, 4]]}},
        "the group wall has 1 edge off the boundary",
    ),
    "second order": (CURVED | {"kind": "triangle6"}, r"curved triangles \(line, triangle6\)"),
    "quadrilaterals": ({"cells": [[0, 1, 2, 3]], "kind": "quad"}, "cells of type quad"),
    "no triangles": ({"cells": []}, "no triangles"),
    "three sheets": (
        {"points": np.vstack([CORNERS, [2, 0.5]]), "cells": [*CELLS, [0, 5, 4]]},
        "more than two triangles share 1 edge",
    ),
    "hanging node": (HANGING, r"has 3 edges in none of .*a node in the middle of its edge"),
    "points nearly twice": (DOUBLED, r"has 4 edges in none of .*merge points that stand twice"),
    "hardly an area": (HARDLY, "1 of 5 triangles have no area"),
    "not plane": ({"heights": [0, 0, 0, 0, 0.1]}, "is not plane: z varies by 0.1"),
    # Both counterclockwise, and on the same side of their common edge, whichever way that runs.
    **{
        f"folded at the edge {first} {second}": (
            {
                "points": FOLDED[[first, second, 2, 3]],
                "cells": [[first, second, k] for k in (2, 3)],
            },
            "the mesh is folded: two triangles lie on the same side",
        )
        for first, second in ((0, 1), (1, 0))
    },
    "point missing": ({"cells": [*CELLS, [0, 1, 11]]}, "is not a whole .msh mesh; write"),
    "not finite": ({"points": np.where(CORNERS == 0.5, np.nan, CORNERS)}, "not finite"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_meshes(name, tmp_path):
    fields, words = BROKEN[name]
    path = write_msh(tmp_path / "bad.msh", **fields)
    with pytest.raises(InvalidInput, match=words) as error:
        gap_of(path)
    assert "bad.msh" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["a.msh", "numbers.vtu", "a.xdmf"])
def test_files_cut_off_anywhere(name, tmp_path):
    """Any prefix of a file either is refused in one sentence, or still holds the whole mesh."""
    (write, groups), path = FILES[name], tmp_path / name
    write(path)
    data, refused = path.read_bytes(), 0
    ends = range(0, len(data), max(1, len(data) // 60))
    for end in ends:
        path.write_bytes(data[:end])
        said = refusal(path, groups)
        assert "\n" not in said
        refused += bool(said)
    assert refused >= len(ends) - 3  # only the end mark of a section may be missing


@pytest.mark.parametrize("name", ["a.vtu", "a.xdmf"])
def test_an_encoding_that_nobody_knows(name, tmp_path):
    (tmp_path / name).write_text('<?xml version="1.0" encoding="x-nobody"?><VTKFile/>')
    assert f"{name} is not a whole {name[1:]} mesh" in refusal(tmp_path / name, {})


def refusal(path, numbers) -> str:
    """What is said of a file, nothing if it is whole."""
    try:
        assert side_lengths(gap_of(path, **numbers).mesh) == WHOLE
    except InvalidInput as error:
        return str(error)
    return ""


def test_written_mesh_is_read_back(tmp_path):
    """mesh.vtu of one shape is the file of another, also where a cut has doubled vertices."""
    from fem_seal.results.arrays import write_mesh

    ring = {"kind": "face-seal", "inner_radius": 1, "outer_radius": 2, "mesh_size": 0.5}
    scene = scene_of(tmp_path) | {"shape": ring | {"gap": 1e-6}}
    gap = shaped_film(Scene.from_mapping(scene).shape, None)
    write_mesh(tmp_path, gap)
    again = gap_of(tmp_path / "mesh.vtu")
    assert again.mesh.periodic
    assert len(again.mesh.xy) == len(gap.mesh.xy)
    assert side_lengths(again.mesh) == pytest.approx(side_lengths(gap.mesh), rel=1e-15)
