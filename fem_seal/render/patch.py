"""The pictures of one patch, and of the seal that it is a part of."""

from collections.abc import Sequence
from pathlib import Path

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.leak_rate import FlowField, LevelRecord
from fem_seal.patch import Patch
from fem_seal.render.convergence import bounds_plot, close_in
from fem_seal.render.flow import flow_picture, mesh_picture, pressure_picture
from fem_seal.render.relief import relief_picture
from fem_seal.render.samples import (
    contact_picture,
    contact_pressure_picture,
    gap_picture,
    lift_picture,
    sensitivity_picture,
)
from fem_seal.render.seal import seal_picture
from fem_seal.results.arrays import ContactArrays
from fem_seal.results.records import SealRecord
from fem_seal.upscaling.seal import SealLeak

# Pictures of a contact that the fluid lifts.
OF_LIFTED_CONTACT = ("contact.png", "contact_pressure.png", "flow.png", "gap.png", "lift.png")
# All pictures that a run may draw.
PICTURES = (*OF_LIFTED_CONTACT, "seal.png", "sensitivity.png", "shape.png")


def draw_patch(patch: Patch, folder: Path, seal: SealLeak | None = None) -> None:
    """Draw the pictures of a patch, and of its seal, into a folder; see `draw_pictures`."""
    lifted_off = patch.lifted_off or (seal is not None and seal.state == "lifted off")
    field = patch.leak_rate.field if patch.scene.needs_leak_rate else None
    record = None if seal is None else SealRecord.of(seal)
    film = None if lifted_off else patch.film
    draw_pictures(film, field, folder, ContactArrays.of(patch), record)


def draw_pictures(
    film: GridFilm | MeshFilm | None,
    field: FlowField | None,
    folder: Path,
    contact: ContactArrays | None = None,
    seal: SealRecord | None = None,
) -> None:
    """Draw contact and gap, and what else is given, into a folder.

    Without a film, as of a patch that is lifted off, only the seal is drawn: the arrays are those
    of a dry contact then. For the film of a shape its mesh is drawn in place of the contact.
    """
    if isinstance(film, MeshFilm):
        from fem_seal.render.shape import draw_shape

        draw_shape(film, field, folder)
        return
    if seal is not None:
        seal_picture(seal, folder / "seal.png")
    if film is None:
        return
    contact_picture(film, folder / "contact.png")
    gap_picture(film, folder / "gap.png")
    if contact is not None and contact.pressure is not None:
        contact_pressure_picture(film, contact.pressure, folder / "contact_pressure.png")
        if contact.dry_gap is not None and contact.fluid_pressure is not None:
            dry = GridFilm(contact.dry_gap, film.sides, film.representation)
            fields = contact.pressure, contact.fluid_pressure
            lift_picture(film, dry, *fields, folder / "lift.png")
    if contact is not None and contact.log_rate_by_height is not None:
        sensitivity_picture(film, contact.log_rate_by_height, folder / "sensitivity.png")
    if field is not None:
        flow_picture(field, film, folder / "flow.png")


def draw_details(
    film: GridFilm | MeshFilm, field: FlowField | None, levels: Sequence[LevelRecord], folder: Path
) -> None:
    """Draw pressure, mesh and relief of a flow on a grid, and the bounds of its levels."""
    if close_in(levels):
        bounds_plot(levels, folder / "bounds.png")
    if isinstance(film, GridFilm) and field is not None:
        pressure_picture(field, film, folder / "pressure.png")
        mesh_picture(field, film, folder / "mesh.png")
        relief_picture(field, film, folder / "relief.png")
