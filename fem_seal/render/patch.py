"""The pictures of one patch, and of the seal that it is a part of."""

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
from fem_seal.render.seal import seal_picture
from fem_seal.results.arrays import ContactArrays
from fem_seal.results.records import SealRecord
from fem_seal.upscaling.seal import SealLeak

Pictures = dict[str, Callable[[Path], Path]]  # by the stems of their files
# Pictures that a run may draw: of a contact that the fluid lifts, and of other scenes.
OF_LIFTED_CONTACT = ("contact.png", "contact_pressure.png", "flow.png", "gap.png", "lift.png")
PICTURES = (*OF_LIFTED_CONTACT, "seal.png", "sensitivity.png", "shape.png")


def draw_patch(patch: Patch, folder: Path, seal: SealLeak | None = None) -> tuple[str, ...]:
    """Draw the pictures of a patch, and of its seal, into a folder; see `draw_pictures`."""
    lifted_off = patch.lifted_off or (seal is not None and seal.state == "lifted off")
    field = patch.leak_rate.field if patch.scene.needs_flow else None
    record = None if seal is None else SealRecord.of(seal)
    film = None if lifted_off else patch.film
    return draw_pictures(film, field, folder, ContactArrays.of(patch), record)


def draw_pictures(
    film: GridFilm | MeshFilm | None,
    field: FlowField | None,
    folder: Path,
    contact: ContactArrays | None = None,
    seal: SealRecord | None = None,
) -> tuple[str, ...]:
    """Draw contact and gap, and what else is given; return the names of the files.

    Without a film, as of a patch that is lifted off, only the seal is drawn: the arrays are those
    of a dry contact then. For the film of a shape its mesh is drawn in place of the contact.
    """
    if isinstance(film, MeshFilm):
        from fem_seal.render.shape import draw_shape

        return draw_shape(film, field, folder)
    pictures: Pictures = {} if seal is None else {"seal": partial(seal_picture, seal)}
    if film is None:
        return _draw(pictures, folder)
    pictures |= {"contact": partial(contact_picture, film), "gap": partial(gap_picture, film)}
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
