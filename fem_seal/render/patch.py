"""The pictures of one patch."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.leak_rate import FlowField, Level
from fem_seal.patch import Patch
from fem_seal.render.bounds import bounds_plot, close_in
from fem_seal.render.flow import flow_picture, mesh_picture, pressure_picture
from fem_seal.render.relief import relief_picture
from fem_seal.render.samples import (
    contact_picture,
    contact_pressure_picture,
    gap_picture,
    lift_picture,
    sensitivity_picture,
)
from fem_seal.results.arrays import ContactArrays

Pictures = dict[str, Callable[[Path], Path]]  # by the stems of their files
SEAL_PICTURE = "seal.png"
# Pictures that a run may draw: of a contact that the fluid lifts, and of other scenes.
OF_LIFTED_CONTACT = ("contact.png", "contact_pressure.png", "flow.png", "gap.png", "lift.png")
PICTURES = (*OF_LIFTED_CONTACT, SEAL_PICTURE, "sensitivity.png", "shape.png")


def draw_patch(patch: Patch, folder: Path) -> tuple[str, ...]:
    """Draw the pictures of a patch into a folder; see `draw_pictures`.

    No picture is drawn of a patch that is lifted off.
    """
    if patch.lifted_off:
        return ()
    field = patch.leak_rate.field if patch.scene.needs_flow else None
    return draw_pictures(patch.film, field, folder, ContactArrays.of(patch))


def draw_pictures(
    film: GridFilm | MeshFilm,
    field: FlowField | None,
    folder: Path,
    contact: ContactArrays | None = None,
) -> tuple[str, ...]:
    """Draw contact and gap, and what else is given; return the names of the files.

    For the film of a shape its mesh is drawn in place of the contact.
    """
    if isinstance(film, MeshFilm):
        from fem_seal.render.shape import draw_shape

        return draw_shape(film, field, folder)
    pictures: Pictures = {
        "contact": partial(contact_picture, film),
        "gap": partial(gap_picture, film),
    }
    if contact is not None and contact.pressure is not None:
        pictures["contact_pressure"] = partial(contact_pressure_picture, film, contact.pressure)
        if contact.dry_gap is not None and contact.fluid_pressure is not None:
            dry = GridFilm(contact.dry_gap, film.sides, film.representation)
            fields = contact.pressure, contact.fluid_pressure
            pictures["lift"] = partial(lift_picture, film, dry, *fields)
    if contact is not None and contact.log_rate_by_height is not None:
        by_height = contact.log_rate_by_height
        pictures["sensitivity"] = partial(sensitivity_picture, film, by_height)
    if field is not None:
        pictures["flow"] = partial(flow_picture, field, film)
    return _draw(pictures, folder)


def draw_details(
    film: GridFilm | MeshFilm, field: FlowField | None, levels: Sequence[Level], folder: Path
) -> tuple[str, ...]:
    """Draw pressure, mesh and relief of a flow on a grid, and the bounds of its levels."""
    pictures: Pictures = {"bounds": partial(bounds_plot, levels)} if close_in(levels) else {}
    if isinstance(film, GridFilm) and field is not None:
        of_flow = {"pressure": pressure_picture, "mesh": mesh_picture, "relief": relief_picture}
        pictures |= {name: partial(picture, field, film) for name, picture in of_flow.items()}
    return _draw(pictures, folder)


def _draw(pictures: Pictures, folder: Path) -> tuple[str, ...]:
    return tuple(draw(folder / f"{name}.png").name for name, draw in sorted(pictures.items()))
