"""The pictures of one patch."""

from collections.abc import Sequence
from pathlib import Path

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, Level
from fem_seal.patch import Patch
from fem_seal.render.bounds import bounds_plot, close_in
from fem_seal.render.contact import contact_picture
from fem_seal.render.flow import flow_picture, mesh_picture, pressure_picture
from fem_seal.render.gap import gap_picture
from fem_seal.render.pressures import (
    contact_pressure_picture,
    lift_picture,
    sensitivity_picture,
)
from fem_seal.render.relief import relief_picture
from fem_seal.results.arrays import Lift, by_height_of, lift_of

SEAL_PICTURE = "seal.png"
# Pictures that a run may draw.
PICTURES = (
    *("contact.png", "contact_pressure.png", "flow.png", "gap.png", "lift.png"),
    *(SEAL_PICTURE, "sensitivity.png", "shape.png"),
)


def draw_patch(patch: Patch, folder: Path) -> tuple[str, ...]:
    """Draw the pictures of a patch into a folder; see `draw_pictures`. None if lifted off."""
    if patch.lifted_off:
        return ()
    leak = patch.leak_rate if patch.scene.needs_flow else None
    pressure = getattr(patch.film_contact, "pressure", None)
    lift = None if pressure is None else lift_of(patch)
    return draw_pictures(patch.film, leak, folder, pressure, lift, by_height_of(patch))


def draw_pictures(
    film: GridFilm | MeshFilm,
    leak: LeakRate | None,
    folder: Path,
    pressure: GridField | None = None,
    lift: Lift | None = None,
    by_height: GridField | None = None,
) -> tuple[str, ...]:
    """Draw contact and gap, and what else is given; return the names of the files.

    `leak` is drawn if it has its field. `pressure` [Pa] is that of an elastic contact, `lift` of a
    lifted one, `by_height` ∂ ln Q/∂h [1/m] of the product "sensitivity". For the film of a shape
    its mesh is drawn in place of the contact.
    """
    if isinstance(film, MeshFilm):
        from fem_seal.render.shape import draw_shape

        return draw_shape(film, leak, folder)
    names = ["contact.png", "gap.png"]
    contact_picture(film, folder / "contact.png")
    gap_picture(film, folder / "gap.png")
    if pressure is not None:
        names.append("contact_pressure.png")
        contact_pressure_picture(film, pressure, folder / names[-1])
        if lift is not None:
            names.append("lift.png")
            dry = GridFilm(lift.dry_gap, film.sides, film.representation)
            lift_picture(film, dry, pressure, lift.fluid_pressure, folder / names[-1])
    if by_height is not None:
        names.append("sensitivity.png")
        sensitivity_picture(film, by_height, folder / names[-1])
    if leak is not None and leak.field is not None:
        names.append("flow.png")
        flow_picture(leak, film, folder / names[-1])
    return tuple(sorted(names))


def draw_details(
    film: GridFilm | MeshFilm, leak: LeakRate | None, levels: Sequence[Level], folder: Path
) -> tuple[str, ...]:
    """Draw pressure, mesh and relief of a flow on a grid, and the bounds of its levels."""
    names: list[str] = []
    if isinstance(film, GridFilm) and leak is not None and leak.field is not None:
        names += ["pressure.png", "mesh.png", "relief.png"]
        pressure_picture(leak, film, folder / names[0])
        mesh_picture(leak, film, folder / names[1])
        relief_picture(leak, film, folder / names[2])
    if close_in(levels):
        bounds_plot(levels, folder / "bounds.png")
        names.append("bounds.png")
    return tuple(names)
