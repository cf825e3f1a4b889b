"""The arrays of a result folder: contact.npz and flow.vtu."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import read_numpy
from fem_seal.files import write_npz
from fem_seal.gap_file import load_gap
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowField
from fem_seal.patch import Patch

if TYPE_CHECKING:
    from fem_seal.film.mesh_film import MeshFilm

CONTACT_FILE = "contact.npz"
FLOW_FILE = "flow.vtu"
MESH_FILE = "mesh.vtu"
TAGS = "facet_tags"


@dataclass(frozen=True, eq=False)
class ContactArrays:
    """The fields of contact.npz on the samples of the contact; None where there is none."""

    gap: GridField  #: [m]
    pressure: GridField | None = None  #: between the solids [Pa]; a bearing contact has none
    dry_gap: GridField | None = None  #: of a lifted contact, without the fluid's pressure [m]
    fluid_pressure: GridField | None = None  #: of a lifted contact [Pa], above ambient
    #: ∂ ln Q/∂h [1/m] of the product "sensitivity"; None also if nothing leaks
    log_rate_by_height: GridField | None = None

    @classmethod
    def of(cls, patch: Patch) -> "ContactArrays | None":
        """Fields of a patch, of the dry contact if it is lifted off; None without a contact."""
        contact, lifted = patch.film_contact, None if patch.lifted_off else patch.lifted
        if contact is None:
            return None
        wanted = "sensitivity" in patch.scene.output.products
        sensitivity = patch.sensitivity if wanted else None
        return cls(
            contact.gap,
            contact.pressure if isinstance(contact, ContactState) else None,
            None if lifted is None else patch.elastic_state.gap,
            None if lifted is None else lifted.fluid_pressure,
            None if sensitivity is None else sensitivity.by_height,
        )


def write_contact(folder: Path, contact: ContactArrays) -> None:
    """Write contact.npz, which is a gap file as well."""
    gap = contact.gap
    arrays = {name: field.values for name, field in vars(contact).items() if field is not None}
    spacing = {"spacing": np.array(gap.spacing), "periodic": gap.periodic}
    write_npz(folder / CONTACT_FILE, arrays | spacing)


def read_contact(folder: str | Path) -> ContactArrays:
    """Fields of a result folder, to the last digit."""
    path = Path(folder) / CONTACT_FILE
    gap, names = load_gap(path), [field.name for field in fields(ContactArrays)[1:]]
    arrays = {name: part.values for name, part in read_numpy(path, names).variables.items()}
    values = {name: _array(arrays, name, gap.shape, path) for name in arrays}
    others = {name: GridField(x, gap.spacing, gap.periodic) for name, x in values.items()}
    return ContactArrays(gap, **others)


def write_flow(folder: Path, field: FlowField) -> None:
    """Write the flow on its mesh for ParaView, in the plane z = 0."""
    import meshio

    mesh = meshio.Mesh(
        _in_space(field.points),
        [("triangle", field.cells)],
        point_data={"gap": field.gap, "pressure": field.pressure},
        cell_data={"flux": [_in_space(field.flux)]},
    )
    if field.facet_tags is not None:
        mesh.cell_data[TAGS] = [field.facet_tags]
    meshio.write(folder / FLOW_FILE, mesh)


def write_mesh(folder: Path, film: "MeshFilm") -> None:
    """Write the mesh of a shape with its gap, which a scene can name as its own."""
    import meshio

    mesh = film.mesh
    # Join the vertices that a cut has doubled.
    used, cells = np.unique(mesh.twin[mesh.cells], return_inverse=True)
    groups = mesh.groups()
    edges = np.concatenate([ends for _, ends in groups])
    numbers = np.repeat(np.arange(1, len(groups) + 1), [len(ends) for _, ends in groups])
    data = {
        name: [np.zeros(len(mesh.cells), dtype=int), (numbers == k + 1).astype(int)]
        for k, (name, _) in enumerate(groups)
    }
    points = _in_space(mesh.xy[used])
    lines = np.searchsorted(used, mesh.twin[edges])
    blocks = [("triangle", cells.reshape(-1, 3)), ("line", lines)]
    written = meshio.Mesh(points, blocks, point_data={"gap": film.values[used]}, cell_data=data)
    meshio.write(folder / MESH_FILE, written)


def read_mesh(folder: str | Path) -> "MeshFilm":
    """Gap on the mesh of a shape, as `write_mesh` has left it in a folder."""
    from fem_seal.film.mesh_film import MeshFilm
    from fem_seal.mesh.checks import labelled
    from fem_seal.mesh.files import GroupNames, read_file, triangles_of
    from fem_seal.mesh.shape import shape_mesh_with_values

    path = Path(folder) / MESH_FILE
    file = read_file(path)
    triangles = triangles_of(file, path, 1.0, GroupNames())
    gap = _array(file.point_data, "gap", (len(triangles.xy),), path)
    # The file holds the mesh before it is cut open; points of no triangle are left out.
    at_vertex = gap[np.unique(triangles.cells)]
    return MeshFilm(*shape_mesh_with_values(*labelled(triangles, path.name), at_vertex))


def _array(
    arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...], path: Path
) -> np.ndarray:
    """Array of a shape, of finite real numbers."""
    values = arrays.get(name)
    if (
        values is None
        or values.dtype.kind not in "iuf"
        or values.shape != shape
        or not np.isfinite(values).all()
    ):
        raise InvalidInput(f"{path} is not as fem_seal writes it: no whole array {name!r}")
    return values.astype(float)


def read_flow(folder: str | Path) -> FlowField:
    """Flow of a result folder, to the last digit.

    InvalidInput if flow.vtu is damaged or missing, as `output.products` did not name "mesh".
    """
    from fem_seal.mesh.files import check_indices, read_file

    path = Path(folder) / FLOW_FILE
    if not path.is_file():
        raise InvalidInput(f"{path} does not exist; name 'mesh' in output.products to have it")
    mesh = read_file(path)
    cells = mesh.get_cells_type("triangle")
    check_indices(path, len(mesh.points), [cells])
    of_cells = {name: parts[0] for name, parts in mesh.cell_data.items()}
    tags = None  # earlier versions did not write them
    if TAGS in of_cells:
        tags = _array(of_cells, TAGS, (len(cells), 3), path).astype(np.int8)
    return FlowField(
        points=mesh.points[:, :2].astype(float),
        cells=cells,
        gap=_array(mesh.point_data, "gap", (len(mesh.points),), path),
        pressure=_array(mesh.point_data, "pressure", (len(mesh.points),), path),
        flux=_array(of_cells, "flux", (len(cells), 3), path)[:, :2],
        facet_tags=tags,
    )


def _in_space(vectors: np.ndarray) -> np.ndarray:
    """(n, 2) to (n, 3), as VTK requires."""
    return np.column_stack([vectors, np.zeros(len(vectors))])
