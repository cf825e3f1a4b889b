"""What the products of a scene need and write: packages before any work, files after it."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from fem_seal.errors import MissingPackage
from fem_seal.files import names_in, writing
from fem_seal.film import MeshFilm
from fem_seal.installed import how_to_get_fenicsx
from fem_seal.patch import Patch
from fem_seal.render.patch import PICTURES, draw_patch
from fem_seal.results.arrays import (
    CONTACT_FILE,
    FLOW_FILE,
    MESH_FILE,
    ContactArrays,
    write_contact,
    write_flow,
    write_mesh,
)
from fem_seal.scene import Scene
from fem_seal.scene.scene import require_scene
from fem_seal.upscaling.seal import SealLeak


def require_packages(scene: Scene, *, flow: bool = True, pictures: bool = False) -> None:
    """Refuse what is no Scene, and with MissingPackage work that needs a missing package."""
    require_scene(scene)
    by_elements = scene.flow.method != "finite-difference"
    # Flow by finite elements and shapes are drawn with OpenGL, pictures of a grid without it.
    drawn = flow and by_elements and scene.needs_leak_rate
    if pictures and (drawn or scene.shape is not None):
        from fem_seal.render.offscreen import require_gl

        require_gl()
    if scene.shape is not None and scene.shape.needs_gmsh and not find_spec("gmsh"):
        from fem_seal.mesh.geometry import NO_GMSH

        raise MissingPackage(NO_GMSH)
    tensor = flow and "conductivity_tensor" in scene.output.products
    solved = flow and by_elements and scene.solves_any_flow
    if (tensor or solved) and not find_spec("dolfinx"):
        differences = not tensor and scene.takes({"flow.method": "finite-difference"})
        without = "; flow.method = 'finite-difference' works without" if differences else ""
        needed = f"flow.method = {scene.flow.method!r} needs FEniCSx ({how_to_get_fenicsx()})"
        raise MissingPackage(f"{needed}{without}")


def file_names(scene: Scene) -> Iterator[str]:
    """Names of the files that a run of the scene may write, beside result.json."""
    if scene.contact is not None:
        yield CONTACT_FILE
    if scene.shape is not None:
        yield MESH_FILE
    if "mesh" in scene.output.products:
        yield FLOW_FILE
    if "pictures" in scene.output.products:
        yield from PICTURES


def write_products(patch: Patch, seal: SealLeak | None, folder: Path) -> tuple[str, ...]:
    """Write arrays and pictures into an empty folder, and return the names of the files."""
    products, film = patch.scene.output.products, patch.film
    contact = ContactArrays.of(patch)
    leak = patch.leak_rate if patch.scene.needs_leak_rate else None
    with writing(folder.parent):
        if contact is not None:
            write_contact(folder, contact)
        if isinstance(film, MeshFilm):
            write_mesh(folder, film)
        if "mesh" in products and leak is not None and leak.field is not None:
            write_flow(folder, leak.field)
        if "pictures" in products:
            with patch.timed("pictures"):
                draw_patch(patch, folder, seal)
    return names_in(folder)
