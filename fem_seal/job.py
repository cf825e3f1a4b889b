"""From a scene to its result folder (`run`), to its mesh (`mesh`), and to its pictures (`draw`)."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

from fem_seal import parallel
from fem_seal.accuracy import Choice, solved
from fem_seal.errors import InvalidInput, MissingPackage, present
from fem_seal.files import locked_folder, staging_folder, writing
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField
from fem_seal.installed import require_fenicsx
from fem_seal.leak_rate import LeakRate, Level
from fem_seal.patch import Patch
from fem_seal.points import Work
from fem_seal.progress import Report, silent
from fem_seal.results import Result, ResultFolder, read_contact, read_flow, summarise
from fem_seal.results.arrays import (
    CONTACT_FILE,
    FLOW_FILE,
    MESH_FILE,
    Lift,
    read_lift,
    read_mesh,
    write_contact,
    write_flow,
    write_mesh,
)
from fem_seal.results.folder import PATCHES
from fem_seal.results.result import Origin, Provenance
from fem_seal.results.seal import SealRecord
from fem_seal.scene import Scene
from fem_seal.upscaling.realizations import realizations
from fem_seal.upscaling.scene_profile import profile_of
from fem_seal.upscaling.seal import SealLeak, solve_seal

SEAL_PICTURE = "seal.png"


def run(
    scene: Scene,
    out: str | Path,
    *,
    overwrite: bool = False,
    report: Report = silent,
    trust: bool = False,
    comm: parallel.Comm = None,
    work: Work | None = None,
    origin: Origin | None = None,
) -> Result:
    """Compute the products of a scene and write them into a folder.

    Parameters
    ----------
    scene : the scene to compute
    out : result folder: result.json, contact.npz where a contact was solved, the pictures and
        the mesh where they are products
    overwrite : whether another scene's result may be replaced
    report : called with stage and detail
    trust : whether gmsh may run a .geo file that is not the package's own, with your rights
    comm : processes that call this together, all of this run if left out; with MPI.COMM_SELF each
        process runs a scene of its own
    work : how the patches of a scene with [seal] are shared among workers. Each solved patch is
        kept in a file of the folder `patches`; a later run continues from there
    origin : command and scene file, to be kept in result.json

    Returns
    -------
    Result; if a limit of the scene ended the flow, it has the best bounds so far and `converged`
    is False.

    Raises
    ------
    InvalidInput
        If the scene cannot be computed here, or the folder cannot be written; nothing is written
        then.
    NotConverged
        If the contact does not reach its tolerance; nothing is written then.
    """
    start = perf_counter()
    if work is not None and work.jobs > 1 and scene.seal is None:
        raise InvalidInput(
            f"--jobs = {work.jobs} distributes the patches of a [seal], which this scene has not; "
            "leave it out, or start the command by mpirun"
        )
    with _reserved(scene, out, overwrite, comm) as folder:
        patch, choice = solved(scene, report, trust=trust, comm=comm)
        return _written(patch, folder, start, choice, work, origin)


def save(patch: Patch, out: str | Path, *, overwrite: bool = False) -> Result:
    """Write the products of a patch's scene into a folder, as `run` does.

    Parameters
    ----------
    patch : its computed steps are used; others that the products need are computed
    out, overwrite : as of `run`

    Returns
    -------
    Result, as of `run`.

    Raises
    ------
    InvalidInput, NotConverged
        As `run`.
    """
    with _reserved(patch.scene, out, overwrite, patch.comm) as folder:
        return _written(patch, folder, None, None)


@contextmanager
def _reserved(
    scene: Scene, out: str | Path, overwrite: bool, comm: parallel.Comm
) -> Iterator[ResultFolder]:
    """Check scene and folder before any work, and hold the folder until the result is written."""
    require_packages(scene)
    if scene.seal is not None:
        # Refuse a table that cannot be read, or windows that do not fit, before the work.
        profile_of(scene)
        realizations(scene)
    folder = ResultFolder(out, Provenance.of(scene, comm), overwrite, _names(scene))
    with ExitStack() as held:
        # `and None`: the open folder of the first process must not be sent to the others.
        parallel.on_root(lambda: held.enter_context(folder) and None, comm)
        yield folder


def _written(
    patch: Patch,
    folder: ResultFolder,
    start: float | None,
    choice: Choice | None,
    work: Work | None = None,
    origin: Origin | None = None,
) -> Result:
    """Compute the products of a patch's scene and write them."""
    scene = patch.scene
    # All processes compute before the first one writes.
    if scene.needs_flow:
        patch.leak_rate  # noqa: B018
    patch.film  # noqa: B018
    seal = None
    if scene.seal is not None:
        with patch.timed("seal"):
            seal = solve_seal(patch, folder.path / PATCHES, work)
    files = parallel.on_root(lambda: _write_products(patch, folder.staged, seal), patch.comm)
    result = summarise(patch, files, start, choice=choice, seal=seal, origin=origin)
    parallel.on_root(lambda: folder.commit(result), patch.comm)
    return result


def draw(
    folder: str | Path, report: Report = silent, *, everything: bool = False
) -> tuple[str, ...]:
    """Draw the pictures of a result folder again, from its arrays.

    Parameters
    ----------
    folder : result folder of `run`; the flow is drawn if the folder holds it
    report : called with stage and detail
    everything : whether to draw those of `draw_details` too

    Returns
    -------
    Names of the pictures, in the folder.

    Raises
    ------
    InvalidInput
        If the folder holds no result, or the file of its gap no longer exists.
    """
    folder = Path(folder)
    if (folder / FLOW_FILE).is_file() or (folder / MESH_FILE).is_file():
        from fem_seal.render.offscreen import require_gl

        require_gl()
    with ResultFolder(folder, Result.from_folder(folder).provenance) as target:
        result = Result.from_folder(folder)
        film = _film_of(result, folder)
        leak = _drawable(result, folder) if (folder / FLOW_FILE).is_file() else None
        pressure, lift = None, None
        if isinstance(film, GridFilm) and (folder / CONTACT_FILE).is_file():
            pressure, lift = read_contact(folder)[1], read_lift(folder)
        report("pictures", "")
        with writing(folder):
            names: tuple[str, ...] = ()
            # The arrays of a result that is lifted off are those of a dry contact: not its state.
            if result.state != "lifted off":
                names = draw_pictures(film, leak, target.staged, pressure, lift)
            if result.seal is not None:
                from fem_seal.render.seal import seal_picture

                names += (seal_picture(result.seal, target.staged / SEAL_PICTURE).name,)
            if everything:
                names += draw_details(film, leak, result.levels, target.staged)
        files = tuple(sorted({*result.files, *names}))
        target.commit(result.model_copy(update={"files": files}))
    return names


def _film_of(result: Result, folder: Path) -> GridFilm | MeshFilm:
    """Film of a result, from the arrays in its folder or the gap that its scene names."""
    if (folder / MESH_FILE).is_file():
        from fem_seal.mesh.gap_source import Formula

        shape = result.provenance.scene.get("shape", {})
        text, middle = shape.get("gap_expression"), shape.get("angle", 0.0) / 2
        return replace(read_mesh(folder), formula=None if text is None else Formula(text, middle))
    if (folder / CONTACT_FILE).is_file():
        flow = result.flow()
        return GridFilm(read_contact(folder)[0], flow.sides, flow.representation)
    if "gap" not in result.provenance.scene:
        raise InvalidInput(f"{folder} holds neither {CONTACT_FILE} nor {MESH_FILE}; run it again")
    return Patch(result.scene()).film


def mesh(
    scene: Scene, out: str | Path, report: Report = silent, *, trust: bool = False
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Write and draw the mesh of a scene's shape.

    Parameters
    ----------
    scene : scene with [shape]
    out : folder of mesh.vtu, shape.png and gap.png
    report : called with stage and detail
    trust : whether gmsh may run a .geo file that is not the package's own, with your rights

    Returns
    -------
    Lines of the summary of the mesh, and the names of the files.

    Raises
    ------
    InvalidInput
        If the mesh cannot be made, or the folder cannot be written; nothing is written then.
    """
    pictures = scene.output.model_copy(update={"products": ("pictures",)})
    require_packages(scene.model_copy(update={"output": pictures}))
    film = Patch(scene, report, trust=trust).film
    if not isinstance(film, MeshFilm):
        raise InvalidInput("the scene has no [shape] to mesh")
    return film.summary(), parallel.on_root(lambda: _write_mesh(film, Path(out).absolute()))


def _write_mesh(film: MeshFilm, out: Path) -> tuple[str, ...]:
    with locked_folder(out), staging_folder(out) as staged, writing(out):
        names = tuple(sorted((write_mesh(staged, film), *draw_pictures(film, None, staged))))
        for name in names:
            (staged / name).replace(out / name)
    return names


def draw_pictures(
    film: GridFilm | MeshFilm,
    leak: LeakRate | None,
    folder: Path,
    pressure: GridField | None = None,
    lift: Lift | None = None,
) -> tuple[str, ...]:
    """Draw contact and gap, and of contact pressure, lift and flow those that are given.

    Parameters
    ----------
    film : for the film of a shape its mesh is drawn in place of the contact
    leak : leak rate with its field, or None
    folder : folder of the PNG files
    pressure : contact pressure [Pa] of an elastic contact
    lift : dry gap and fluid pressure of a lifted contact

    Returns
    -------
    Names of the files.
    """
    if isinstance(film, MeshFilm):
        from fem_seal.render.shape import draw_shape

        return draw_shape(film, leak, folder)
    from fem_seal.render.contact import contact_picture
    from fem_seal.render.gap import gap_picture

    names = ["contact.png", "gap.png"]
    contact_picture(film, folder / "contact.png")
    gap_picture(film, folder / "gap.png")
    if pressure is not None:
        from fem_seal.render.pressures import contact_pressure_picture, lift_picture

        names.append("contact_pressure.png")
        contact_pressure_picture(film, pressure, folder / names[-1])
        if lift is not None:
            names.append("lift.png")
            dry = GridFilm(lift.dry_gap, film.sides, film.representation)
            lift_picture(film, dry, pressure, lift.fluid_pressure, folder / names[-1])
    if leak is not None and leak.field is not None:
        from fem_seal.render.flow import flow_picture

        names.append("flow.png")
        flow_picture(leak, film, folder / names[-1])
    return tuple(sorted(names))


def draw_details(
    film: GridFilm | MeshFilm, leak: LeakRate | None, levels: Sequence[Level], folder: Path
) -> tuple[str, ...]:
    """Draw pressure, mesh and relief of a flow on a grid, and the bounds of each level.

    Parameters
    ----------
    film, leak, folder : as in `draw_pictures`
    levels : levels of the flow; drawn if two have an upper bound above zero

    Returns
    -------
    Names of the files.
    """
    names: list[str] = []
    if isinstance(film, GridFilm) and leak is not None and leak.field is not None:
        from fem_seal.render.flow import mesh_picture, pressure_picture
        from fem_seal.render.relief import relief_picture

        names += ["pressure.png", "mesh.png", "relief.png"]
        pressure_picture(leak, film, folder / names[0])
        mesh_picture(leak, film, folder / names[1])
        relief_picture(leak, film, folder / names[2])
    from fem_seal.render.bounds import bounds_plot, close_in

    if close_in(levels):
        from fem_seal.render.animation import bounds_animation

        bounds_plot(levels, folder / "bounds.png")
        bounds_animation(levels, folder / "bounds.gif")
        names += ["bounds.png", "bounds.gif"]
    return tuple(names)


def require_packages(scene: Scene) -> None:
    """Raise MissingPackage before any work if a package is missing that the work needs later.

    Raises
    ------
    MissingPackage
        If the scene needs FEniCSx, OpenGL or gmsh and it is not installed.
    """
    # Flow by finite elements and shapes are drawn with OpenGL, pictures of a grid without it.
    by_elements = scene.needs_rates and scene.flow.method != "finite-difference"
    if "pictures" in scene.output.products and (by_elements or scene.shape is not None):
        from fem_seal.render.offscreen import require_gl

        require_gl()
    if scene.shape is not None and scene.shape.needs_gmsh and not find_spec("gmsh"):
        from fem_seal.mesh.geometry import NO_GMSH

        raise MissingPackage(NO_GMSH)
    tensor = "conductivity_tensor" in scene.output.products
    if by_elements or tensor:
        without = "; flow.method = 'finite-difference' works without" if not tensor else ""
        require_fenicsx(f"flow.method = {scene.flow.method!r}", without)


def draw_patch(patch: Patch, folder: Path) -> tuple[str, ...]:
    """Draw the pictures of a patch into a folder; see `draw_pictures`. None if lifted off."""
    if patch.lifted_off:
        return ()
    leak = patch.leak_rate if patch.scene.needs_flow else None
    pressure = getattr(patch.film_contact, "pressure", None)
    lift = None if pressure is None else _lift_of(patch)
    return draw_pictures(patch.film, leak, folder, pressure, lift)


def _write_products(patch: Patch, folder: Path, seal: SealLeak | None) -> tuple[str, ...]:
    names: list[str] = []
    leak = patch.leak_rate if patch.scene.needs_flow else None
    film, contact = patch.film, patch.film_contact
    with writing(folder.parent):
        if contact is not None:
            names.append(write_contact(folder, contact, _lift_of(patch)))
        if isinstance(film, MeshFilm):
            names.append(write_mesh(folder, film))
        field = None if leak is None else leak.field
        if "mesh" in patch.scene.output.products and field is not None:
            names.append(write_flow(folder, field))
        if "pictures" in patch.scene.output.products:
            with patch.timed("pictures"):
                if seal is None or seal.state != "lifted off":
                    names.extend(draw_patch(patch, folder))
                if seal is not None:
                    from fem_seal.render.seal import seal_picture

                    names.append(seal_picture(SealRecord.of(seal), folder / SEAL_PICTURE).name)
    return tuple(sorted(names))


def _lift_of(patch: Patch) -> Lift | None:
    """Dry gap and fluid pressure of a lifted contact; None if dry or lifted off."""
    if patch.lifted is None or patch.lifted_off:
        return None
    return Lift(patch.elastic.gap, patch.lifted.fluid_pressure)


def _names(scene: Scene) -> Iterator[str]:
    """Names of the files that a run of the scene may write, beside result.json."""
    if scene.contact is not None:
        yield CONTACT_FILE
    if scene.shape is not None:
        yield MESH_FILE
    if "mesh" in scene.output.products:
        yield FLOW_FILE
    if "pictures" in scene.output.products:
        yield from ("contact.png", "contact_pressure.png", "flow.png", "gap.png", "lift.png")
        yield from (SEAL_PICTURE, "shape.png")


def _drawable(result: Result, folder: Path) -> LeakRate:
    """Leak rate of a result, with the field from its folder."""
    leak = present(result.leak_rate, "leak rate")
    return LeakRate(
        state=result.state,
        method=present(result.method, "flow method"),
        value=leak.value,
        lower=leak.lower,
        upper=leak.upper,
        field=read_flow(folder),
    )
