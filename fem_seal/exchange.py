"""For Python prompts and notebooks: pictures of a patch; its fields for xarray and PyVista."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.arguments import require_kind
from fem_seal.contact.state import ContactState, GapState
from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.files import atomic_write, temporary_folder
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.render.patch import draw_patch
from fem_seal.solved import Solved

if TYPE_CHECKING:
    import pyvista as pv
    import xarray as xr


@dataclass(frozen=True)
class Picture:
    """A picture; a notebook shows it if it is the value of a cell."""

    name: str  #: name of the picture, such as "gap"
    png: bytes  #: the picture as the content of a PNG file

    def __repr__(self) -> str:
        return f"Picture({self.name!r}, {len(self.png) / 1000:.0f} kB)"

    def _repr_png_(self) -> bytes:
        return self.png

    def save(self, path: str | Path) -> Path:
        """Write the picture into a PNG file and return its path."""
        path = Path(path)
        with atomic_write(path) as file:
            file.write_bytes(self.png)
        return path


def pictures(of: Solved | Patch) -> dict[str, Picture]:
    """Draw the pictures of an answer or a patch, as `run` draws those of its scene.

    They are named "contact", "gap", "flow" and others (docs/guide/pictures.md). The flow is drawn
    if the scene's products need it and contain "pictures" or "mesh": only then its field is kept.
    """
    require_kind((Solved, Patch), of=of)
    with temporary_folder() as folder:
        patch, seal = (of.patch, of.seal) if isinstance(of, Solved) else (of, None)
        draw_patch(patch, folder, seal)
        drawn = sorted(folder.iterdir())
        return {path.stem: Picture(path.stem, path.read_bytes()) for path in drawn}


def to_xarray(fields: GridField | GapState) -> "xr.Dataset":
    """Fields on their grid as an xarray.Dataset with coordinates x and y [m].

    A field becomes the variable "values"; a contact the variables "gap" [m] and, if it is elastic,
    "pressure" [Pa]. The attribute "periodic" is 0 or 1.

    Raises
    ------
    MissingPackage
        If xarray is not installed.
    InvalidInput
        If `fields` is neither a field nor a contact.
    """
    try:
        import xarray as xr
    except ImportError:
        raise MissingPackage("to_xarray needs xarray: pip install xarray") from None
    variables: dict[str, tuple[np.ndarray, dict[str, str]]]
    if isinstance(fields, GridField):
        grid, variables = fields, {"values": (fields.values, {})}
    elif isinstance(fields, GapState):
        grid, variables = fields.gap, {"gap": (fields.gap.values, {"units": "m"})}
        if isinstance(fields, ContactState):
            variables["pressure"] = (fields.pressure.values, {"units": "Pa"})
    else:
        raise InvalidInput(
            "to_xarray takes a contact, such as solved.contact, or a field on a grid, not a "
            f"{type(fields).__name__}"
        )
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    metres = {"units": "m"}
    return xr.Dataset(
        {name: (("x", "y"), values, attrs) for name, (values, attrs) in variables.items()},
        coords={"x": ("x", dx * np.arange(nx), metres), "y": ("y", dy * np.arange(ny), metres)},
        attrs={"periodic": int(grid.periodic)},
    )


def to_pyvista(leak: LeakRate) -> "pv.PolyData":
    """The flow on its last mesh as a PyVista mesh of triangles in the plane z = 0.

    Point data are "gap" [m] and "pressure" [Pa], cell data "flux" [m^2/s]. The leak rate must have
    its field: that of a patch whose scene has the product "pictures" or "mesh".

    Raises
    ------
    InvalidInput
        If it is no leak rate, or one without a field.
    """
    if not isinstance(leak, LeakRate):
        raise InvalidInput(
            f"to_pyvista takes a leak rate, such as solved.leak_rate, not a {type(leak).__name__}"
        )
    field = leak.field
    if field is None:
        raise InvalidInput(
            "the leak rate holds no field of the flow: add 'mesh' to output.products of the scene"
        )
    import pyvista as pv

    points = np.pad(field.points, ((0, 0), (0, 1)))
    grid = pv.PolyData.from_regular_faces(points, np.asarray(field.cells))
    grid.point_data["gap"], grid.point_data["pressure"] = field.gap, field.pressure
    grid.cell_data["flux"] = np.pad(field.flux, ((0, 0), (0, 1)))
    return grid
