"""Reading a user's mesh: .msh of gmsh, .vtu and .xdmf, with groups inlet, outlet and wall.

A group is a set of boundary edges ("line" cells). In .msh it is a physical curve, found by its
name. The other formats have no names for groups: there it is either a cell array of the group's
name, not zero on its edges, or a number in the one integer cell array of the file. A name or a
number may be used for any format.
"""

import contextlib
import io
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.field_file.containers import BROKEN_PARSED, refuse_data_elsewhere
from fem_seal.memory import within_available_memory

if TYPE_CHECKING:
    import meshio

TAGS = "gmsh:physical"
FLAT = 1e-9  # largest distance of points from a plane of constant z, over the extent of the mesh
_PLANE_CELLS = {"triangle", "line", "vertex"}
_GROUPS = ("inlet", "outlet", "wall")
# Commands of gmsh that read another file, with its name.
_OTHER_FILE = re.compile(rb'\b(?:Include|Merge|Open|ShapeFromFile)\b[\s(]*"([^"\x00-\x1f]+)"')


@dataclass(frozen=True, eq=False)
class Triangles:
    """A mesh as its file describes it; only the format has been checked."""

    xy: np.ndarray  #: (V, 2), coordinates of the points [m]
    cells: np.ndarray  #: (C, 3) int, corners of the triangles
    inlet: np.ndarray  #: (n, 2) int, ends of the boundary edges of the group, as of the two below
    outlet: np.ndarray
    wall: np.ndarray


@dataclass(frozen=True)
class GroupNames:
    """Names of the boundary groups in a mesh file."""

    inlet: str | int = "inlet"  #: name of the group, or number of its tag, as of the two below
    outlet: str | int = "outlet"
    wall: str | int = "wall"


def read_triangles(
    path: Path, unit: float, names: GroupNames, source: Path | None = None
) -> Triangles:
    """Read a .msh, .vtu or .xdmf mesh whose length unit is `unit` [m]; none of the formats has one.

    Messages name `source`, the file that the mesh was made from, in place of the path.
    """
    source = source or path
    return triangles_of(read_file(path, source), source, unit, names)


def triangles_of(mesh: "meshio.Mesh", source: Path, unit: float, names: GroupNames) -> Triangles:
    """Triangles and groups of a mesh that has been read; see `read_triangles`."""
    types = {block.type for block in mesh.cells if len(block.data)}
    if types & {"triangle6", "line3", "triangle7", "triangle10", "line4"}:
        raise InvalidInput(
            f"{source} has curved triangles ({', '.join(sorted(types))}); the bounds need straight "
            "ones: mesh again with order 1 (in gmsh, Mesh.ElementOrder = 1)"
        )
    if types - _PLANE_CELLS:
        strange = ", ".join(sorted(types - _PLANE_CELLS))
        raise InvalidInput(
            f"{source} has cells of type {strange}; only plane triangles can be used"
        )
    if "triangle" not in types:
        raise InvalidInput(
            f"{source} has no triangles; in gmsh, generate the 2D mesh, and give the surface a "
            "physical group as well if its curves have some"
        )
    points, cells = mesh.points, mesh.get_cells_type("triangle").astype(np.int64)
    check_indices(source, len(points), [block.data for block in mesh.cells])
    xy = plane_points(source, points, cells) * unit
    edges = {group: _edges(source, mesh, getattr(names, group)) for group in _GROUPS}
    for group in ("inlet", "outlet"):
        if len(edges[group]) == 0:
            raise InvalidInput(
                f"{source} has no boundary edges in a group {getattr(names, group)!r}; "
                f"{_known_groups(mesh)}: name the group or give its number as shape.{group}"
            )
    return Triangles(xy, cells, edges["inlet"], edges["outlet"], edges["wall"])


def read_file(path: Path, source: Path | None = None) -> "meshio.Mesh":
    """Read a .msh, .vtu or .xdmf file, whatever cells it has; see `read_triangles`."""
    import meshio

    source = source or path
    readers: dict[str, Callable[[str], meshio.Mesh]] = {
        ".msh": meshio.gmsh.read,
        ".vtu": meshio.vtu.read,
        ".xdmf": meshio.xdmf.read,
    }
    ending = path.suffix.lower()
    if ending not in readers:
        raise InvalidInput(
            f"{source} is no mesh file that can be read; choose from {', '.join(readers)} or .geo"
        )
    try:
        # meshio prints warnings of its own; the message below replaces them.
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            within_available_memory(str(source)),
        ):
            if ending == ".xdmf":
                _refuse_other_files(path)
            return readers[ending](str(path))
    except ModuleNotFoundError as error:
        raise MissingPackage(
            f"{source} needs the package {error.name} (pip install {error.name}); "
            "a .msh or .vtu file does not"
        ) from None
    except OSError as error:
        raise InvalidInput(f"cannot read the mesh {source}: {error.strerror or error}") from None
    except (meshio.ReadError, *BROKEN_PARSED):
        raise InvalidInput(f"{source} is not a whole {ending} mesh; write it again") from None


def files_within(path: Path) -> set[Path]:
    """Files that an .xdmf takes its arrays from, or that a .geo reads by their names.

    Those that do not exist are left out, as are all of a file that cannot be read.
    """
    found: set[Path] = set()
    left = [path]
    with contextlib.suppress(*BROKEN_PARSED):
        while left:
            file = left.pop()
            names: list[str] = []
            if file.suffix.lower() == ".xdmf":
                names = [name for form, name in _data_items(file) if form == "HDF"]
            elif file.suffix.lower() == ".geo":
                named = _OTHER_FILE.findall(file.read_bytes())
                names = [name.decode(errors="replace") for name in named]
            inner = {(file.parent / name).resolve() for name in names} - found - {path}
            new = [file for file in inner if file.is_file()]
            found.update(new)
            left += new
    return found


def _data_items(path: Path) -> Iterator[tuple[str | None, str]]:
    """Formats of the arrays of an .xdmf, and the files that hold them."""
    for item in ElementTree.parse(path).iter("DataItem"):
        yield item.get("Format"), (item.text or "").strip().partition(":")[0]


def _refuse_other_files(path: Path) -> None:
    """Refuse an .xdmf whose arrays are neither in it nor in an HDF5 file beside it.

    Otherwise it could name any file of the reader's machine.
    """
    for form, name in _data_items(path):
        if form == "Binary" or (form == "HDF" and name != Path(name).name):
            raise InvalidInput(
                f"{path} takes data from {name}; only an HDF5 file in the same folder is read"
            )
        if form == "HDF" and (path.parent / name).is_file():
            import h5py

            with h5py.File(path.parent / name, "r") as file:
                refuse_data_elsewhere(file, path.parent / name)


def check_indices(source: Path, count: int, blocks: list[np.ndarray]) -> None:
    """Refuse cells that name points which the file does not have."""
    for data in blocks:
        missing = data[(data < 0) | (data >= count)]
        if missing.size:
            raise InvalidInput(
                f"{source} names point {missing[0]} but holds only {count} points; "
                "it is not whole: write it again"
            )


def plane_points(source: Path | str, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Coordinates (V, 2) of points in a plane z = const."""
    used = points[np.unique(cells)]
    if bad := np.count_nonzero(~np.isfinite(used).all(axis=1)):
        raise InvalidInput(f"{source} has points that are not finite ({bad}); write it again")
    if used.shape[1] > 2:
        height, extent = np.ptp(used[:, 2]), np.ptp(used[:, :2], axis=0).max()
        if height > FLAT * extent:
            raise InvalidInput(
                f"{source} is not plane: z varies by {height:.3g} over an extent of "
                f"{extent:.3g}; give the mesh of the film in the plane z = 0"
            )
    return np.ascontiguousarray(points[:, :2], dtype=float)


def _edges(source: Path, mesh: "meshio.Mesh", name: str | int) -> np.ndarray:
    """Edges (n, 2) of a group, none if it does not exist."""
    edges = [np.empty((0, 2), dtype=np.int64)]
    array, tag = _array_and_tag(source, mesh, name)
    if array is not None:
        for block, values in zip(mesh.cells, mesh.cell_data[array], strict=True):
            if block.type == "line":
                in_group = values != 0 if tag is None else values == tag
                edges.append(block.data[in_group].astype(np.int64))
    return np.concatenate(edges)


def _array_and_tag(
    source: Path, mesh: "meshio.Mesh", name: str | int
) -> tuple[str | None, int | None]:
    """Cell array of a group, and the number of the group in it; None: any number but zero."""
    if isinstance(name, str):
        tag, dimension = mesh.field_data.get(name, (None, None))
        if dimension == 1 and TAGS in mesh.cell_data:
            return TAGS, int(tag)
        return (name, None) if name in mesh.cell_data else (None, None)
    whole = sorted(
        key for key, parts in mesh.cell_data.items() if all(p.dtype.kind in "iu" for p in parts)
    )
    arrays = [TAGS] if TAGS in whole else whole
    if len(arrays) > 1:
        raise InvalidInput(
            f"{source} has several integer cell arrays ({', '.join(arrays)}); group {name} could "
            "be in any of them: keep the one with the boundary tags"
        )
    return (arrays[0], name) if arrays else (None, None)


def _known_groups(mesh: "meshio.Mesh") -> str:
    """End of a message: names of the groups of edges of a mesh, with the numbers of their tags."""
    known = [name for name, (_, dimension) in mesh.field_data.items() if dimension == 1]
    for key, parts in mesh.cell_data.items():
        blocks = zip(mesh.cells, parts, strict=True)
        tags = [part for block, part in blocks if block.type == "line" and part.dtype.kind in "iu"]
        numbers = ", ".join(
            map(str, sorted({int(tag) for part in tags for tag in part.flat if tag}))
        )
        if not key.startswith("gmsh:"):
            known.append(f"{key} ({numbers})" if numbers else key)
        elif key == TAGS and numbers and not known:
            known.append(f"the numbers {numbers}")
    return f"it has {', '.join(known) or 'no group of edges, such as a physical curve of gmsh'}"
