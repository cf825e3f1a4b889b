"""The pictures of a result folder, drawn again (`draw`), and the mesh of a shape (`mesh`)."""

from pathlib import Path

from fem_seal import parallel
from fem_seal.errors import OTHER_FOLDER, InvalidInput, narrowed
from fem_seal.files import locked_folder, names_in, staging_folder, writing
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.patch import Patch
from fem_seal.products import require_packages
from fem_seal.progress import Report, silent
from fem_seal.render.patch import draw_details, draw_pictures
from fem_seal.results import Result, ResultFolder, read_contact, read_flow
from fem_seal.results.arrays import (
    CONTACT_FILE,
    FLOW_FILE,
    MESH_FILE,
    ContactArrays,
    read_mesh,
    write_mesh,
)
from fem_seal.results.folder import holds_another_scene
from fem_seal.results.result import Provenance
from fem_seal.scene import Scene


def draw(
    folder: str | Path, report: Report = silent, *, everything: bool = False
) -> tuple[str, ...]:
    """Draw the pictures of a result folder again, from its arrays; return their names.

    The flow is drawn if the folder holds it, and with `everything` what `draw_details` draws.
    """
    folder = Path(folder)
    if (folder / FLOW_FILE).is_file() or (folder / MESH_FILE).is_file():
        from fem_seal.render.offscreen import require_gl

        require_gl()
    with ResultFolder(folder, Result.from_folder(folder).provenance) as target:
        result = Result.from_folder(folder)  # again: another process may have replaced it
        contact = read_contact(folder) if (folder / CONTACT_FILE).is_file() else None
        film = _film_of(result, folder, contact)
        field = read_flow(folder) if (folder / FLOW_FILE).is_file() else None
        report("pictures", "")
        with writing(folder):
            shown = None if result.state == "lifted off" else film
            draw_pictures(shown, field, target.staged, contact, result.seal)
            if everything:
                draw_details(film, field, result.levels, target.staged)
        names = names_in(target.staged)
        files = tuple(sorted({*result.files, *names}))
        target.commit(result.model_copy(update={"files": files}))
    return names


def _film_of(result: Result, folder: Path, contact: ContactArrays | None) -> GridFilm | MeshFilm:
    """Film of a result, from the arrays in its folder or the gap that its scene names."""
    if (folder / MESH_FILE).is_file():
        return read_mesh(folder)
    if contact is not None:
        return result.flow().film_of(contact.gap)
    if not result.provenance.has_section("gap"):
        raise InvalidInput(f"{folder} holds neither {CONTACT_FILE} nor {MESH_FILE}; run it again")
    return Patch(result.scene()).film


def mesh(
    scene: Scene, out: str | Path, report: Report = silent, *, trust: bool = False
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Write and draw the mesh of a scene's shape: mesh.vtu, shape.png and gap.png in `out`.

    Returns lines of the summary of the mesh, and the names of the files.
    """
    require_packages(scene, flow=False, pictures=True)
    if scene.shape is None:
        raise InvalidInput(
            "the scene has no [shape]; the mesh of a gap on a grid is made while it is solved: "
            "name 'mesh' in output.products of fem-seal run"
        )
    film = narrowed(Patch(scene, report, trust=trust).film, MeshFilm, "mesh")
    folder, provenance = Path(out).absolute(), Provenance.of(scene)
    return film.summary(), parallel.on_root(lambda: _write_mesh(film, folder, provenance))


def _write_mesh(film: MeshFilm, out: Path, provenance: Provenance) -> tuple[str, ...]:
    with locked_folder(out), staging_folder(out) as staged, writing(out):
        if holds_another_scene(out, provenance):
            raise InvalidInput(f"{out} holds the result of another scene; {OTHER_FOLDER}")
        write_mesh(staged, film)
        draw_pictures(film, None, staged)
        names = names_in(staged)
        for name in names:
            (staged / name).replace(out / name)
    return names
