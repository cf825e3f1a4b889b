"""The steps of a scene, each computed from its sections and the result of the step before."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fem_seal import parallel
from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput, present
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, Level
from fem_seal.memory import refuse_too_large
from fem_seal.progress import Report, silent
from fem_seal.scene import FileSurface, ProfileSurface, Scene, SelfAffineSurface

if TYPE_CHECKING:
    from fem_seal.contact.settings import Load
    from fem_seal.contact.state import BearingState, ContactState, GapState
    from fem_seal.coupling import LiftProblem
    from fem_seal.film import GridFilm, MeshFilm
    from fem_seal.flow import KeptMesh
    from fem_seal.surface import IsotropicSpectrum, PreparedSurface

UNKNOWNS_ON_THE_WAY = 20000  # smallest limit for the flows on the way to a lifted state
# Least peak memory of a surface, and of a surface with its elastic contact [bytes a sample],
# measured at 1024 x 1024 samples: 60, and 106 to 138 with the solver and its arithmetic.
SURFACE_BYTES, CONTACT_BYTES = 60, 106
FEWEST_TO_HALVE = 128  # samples along a side, to start a lift on every second one
LARGEST_RISE = 1e100  # m, of heights; its third power is still a number, and so is its inverse


def made_surface(surface: SelfAffineSurface | ProfileSurface) -> GridField:
    """Random heights [m] of a section.

    Raises
    ------
    InvalidInput
        If there is less memory than that takes, or the profiles cannot be read.
    """
    from fem_seal.surface import gaussian_surface, self_affine

    nx, ny = surface.shape
    refuse_too_large(SURFACE_BYTES * nx * ny, f"a surface of {nx} x {ny} samples")
    if isinstance(surface, ProfileSurface):
        spectrum = spectrum_of_profiles(surface)
        return gaussian_surface(spectrum, surface.shape, surface.size, seed=surface.seed)
    return self_affine(
        surface.spectrum,
        surface.shape,
        surface.size,
        rms_height=surface.rms_height,
        rms_slope=surface.rms_slope,
        scaling=surface.scaling,
        seed=surface.seed,
    )


def spectrum_of_profiles(surface: ProfileSurface) -> "IsotropicSpectrum":
    """Spectrum C(q) of the isotropic surface that the profiles of a section are taken from."""
    from fem_seal.field_file.profiles import read_profiles
    from fem_seal.surface import isotropic_spectrum, profile_spectrum

    read = read_profiles(
        surface.path, unit=surface.unit, step=surface.step, missing=surface.missing
    )
    try:
        profiles = profile_spectrum(read.heights, read.step, detrend=surface.detrend)
    except InvalidInput as error:
        raise InvalidInput(f"profiles in {surface.path[0]}: {error}") from None
    return isotropic_spectrum(profiles)


def prepared_surface(surface: FileSurface) -> "PreparedSurface":
    """Heights [m] of a file after the steps that a section names."""
    from fem_seal.surface import measured_surface

    return measured_surface(surface.path, surface.stated, surface.preparation)


def elastic_contact(
    scene: Scene,
    surface: GridField,
    start: "ContactState | np.ndarray | None",
    load: "Load",
    report: Report = silent,
    tolerance: float = 0.0,
) -> "ContactState":
    """Contact of a scene's solids under a load, which need not be that of the scene.

    Parameters
    ----------
    scene : Scene
        Its [solid] and [contact] say how it is solved.
    surface : GridField
        Heights [m].
    start : ContactState, array [Pa] or None
        Contact or pressure to start from.
    load : Load
    report : callable
        Called with the iteration and its residual.
    tolerance : float
        Tolerance of a contact on the way to another, if it is above that of the scene.

    Raises
    ------
    InvalidInput
        If the heights are beyond double precision, or the contact takes more memory than there is
        or than flow.max_memory allows.
    NotConverged
        If contact.tolerance is not reached.
    """
    from fem_seal.contact import contact_under

    def progress(iteration: int, residual: float) -> None:
        report("contact", f"iteration {iteration}, residual {residual:.1e}")

    rise = np.ptp(surface.values)
    if rise and not 1 / LARGEST_RISE < rise < LARGEST_RISE:
        raise InvalidInput(
            f"the heights of the surface differ by {rise:.1e} m, whose powers are beyond double "
            "precision; check their unit, or surface.rms_height or rms_slope"
        )
    nx, ny = surface.shape
    subject = f"the contact of {nx} x {ny} samples"
    refuse_too_large((CONTACT_BYTES - SURFACE_BYTES) * nx * ny, subject)
    if scene.flow is not None and scene.flow.max_memory is not None:
        refuse_too_large(CONTACT_BYTES * nx * ny, subject, scene.flow.max_memory)
    contact, solid = present(scene.contact, "[contact]"), present(scene.solid, "[solid]").elastic
    stopping = contact.stopping(progress)
    if tolerance > stopping.tolerance:
        stopping = replace(stopping, tolerance=tolerance, gap_tolerance=10 * tolerance)
    return contact_under(surface, solid, load, stopping, contact.arithmetic, start)


def _elastic(
    scene: Scene, surface: GridField, start: np.ndarray | None, report: Report
) -> "ContactState":
    return elastic_contact(scene, surface, start, scene.load, report)


def _bearing(
    scene: Scene, surface: GridField, start: np.ndarray | None, report: Report
) -> "BearingState":
    from fem_seal.contact import bearing

    contact = present(scene.contact, "[contact]")
    return bearing(surface, area_fraction=contact.area_fraction, mean_gap=contact.mean_gap)


ContactModel = Callable[[Scene, GridField, np.ndarray | None, Report], "GapState"]
CONTACTS: dict[str, ContactModel] = {"gfmd": _elastic, "bearing": _bearing}


def every_second(surface: GridField) -> GridField | None:
    """Every second sample of heights [m]; None for few or an odd number of samples."""
    nx, ny = surface.shape
    if min(nx, ny) < FEWEST_TO_HALVE or nx % 2 or ny % 2:
        return None
    values = np.ascontiguousarray(surface.values[::2, ::2])
    dx, dy = surface.spacing
    return GridField(values, (2 * dx, 2 * dy), surface.periodic)


def lifting_problem(
    scene: Scene, surface: GridField, report: Report, comm: parallel.Comm = None
) -> "LiftProblem":
    """The coupled problem of contact and flow that a scene with `flow.lift` poses.

    All fluid pressures in it are above ambient.
    """
    from fem_seal.contact.halfspace import HalfSpace
    from fem_seal.contact.settings import Load
    from fem_seal.coupling import LiftProblem
    from fem_seal.film import GridFilm
    from fem_seal.flow import KeptMesh, pressure_on_kept

    contact, flow, drive = present(scene.contact, "[contact]"), scene.flow, scene.drive
    inlet, outlet = scene.gauge_pressures
    solid, arithmetic = present(scene.solid, "[solid]").elastic, contact.arithmetic
    half_space = HalfSpace(
        surface.shape, surface.spacing, solid.layer, arithmetic.threads, arithmetic.precision
    )
    length = (surface.spacing[0] * surface.spacing[1]) ** 0.5

    def displacement(pressure: np.ndarray) -> np.ndarray:
        """Displacement [m] under a pressure [Pa] on the samples."""
        return half_space.displacement(pressure) * (2 * length / solid.contact_modulus)

    def press(
        heights: GridField,
        load: float | None,
        start: "ContactState | np.ndarray | None",
        tolerance: float = 0.0,
    ) -> "ContactState":
        """Contact of heights under a load [Pa], or under that of the scene."""
        target = contact.load if load is None else Load("pressure", load)
        return parallel.on_root(
            lambda: elastic_contact(scene, heights, start, target, tolerance=tolerance), comm
        )

    # Every flow must return its pressure field: the product "constriction" makes it do so.
    products = (*scene.output.products, "constriction")
    output = scene.output.model_copy(update={"products": products})
    scene_with_field = scene.model_copy(update={"output": output})

    kept = KeptMesh() if flow.method == "adaptive" else None

    def solve_flow(scene: Scene, film: GridFilm, report: Report) -> LeakRate:
        """Leak rate of a film, begun on the mesh of the flow before it."""
        if kept is not None:
            return _finite_elements(scene, film, report, comm, kept)
        return FLOWS[flow.method](scene, film, report, comm)

    def flow_to(film: GridFilm, tolerance: float | None, new: bool = False) -> LeakRate:
        """Leak rate to a tolerance of a pass, or to that of the scene; see `LiftProblem.flow`."""
        if film.sealed:
            return LeakRate.sealed(flow.method)
        if kept is not None and new:
            kept.start = None
        if tolerance is None:
            return solve_flow(scene_with_field, film, report)
        return solve_flow(_on_the_way(scene_with_field, film, tolerance), film, silent)

    def flow_on_kept_mesh(film: GridFilm) -> LeakRate:
        """Leak rate on the mesh of the last flow, which is not refined."""
        return pressure_on_kept(
            film,
            present(kept, "kept mesh"),
            viscosity=scene.viscosity,
            pressure_drop=drive.pressure_drop,
            slip=scene.slip,
            comm=parallel.communicator(comm),
        )

    return LiftProblem(
        height=surface,
        displacement=displacement,
        press=press,
        film=lambda gap: GridFilm(gap, flow.sides, flow.representation),
        flow=flow_to,
        flow_on_kept_mesh=None if kept is None else flow_on_kept_mesh,
        fluid_pressure=partial(fluid_pressure, scene),
        inlet=inlet,
        outlet=outlet,
        load=contact.pressure,
        comm=comm,
        decides=scene.deciding_rate is not None,
    )


def _on_the_way(scene: Scene, film: "GridFilm", tolerance: float) -> Scene:
    """The scene for the flow of a pass, which need not decide its limit.

    The unknowns are capped: the gap of an early pass may have constrictions that take very many
    unknowns to resolve, and that the gap of the result does not have.
    """
    most = max(UNKNOWNS_ON_THE_WAY, film.samples.size)
    most = min(most, scene.flow.max_unknowns or most)
    flow = scene.flow.model_copy(update={"rtol": tolerance, "max_unknowns": most})
    return scene.model_copy(update={"flow": flow, "limit": None})


def fluid_pressure(scene: Scene, film: "GridFilm", leak: LeakRate) -> np.ndarray:
    """Pressure of the fluid above ambient [Pa] on the sites of a film that leaks.

    Parameters
    ----------
    scene : Scene
        Its [fluid] and [flow].
    film : GridFilm
    leak : LeakRate
        Of the film; without a field, as from finite differences, the pressure is solved again.
    """
    flow, drive = scene.flow, scene.drive
    # The search for the constriction takes a while, and only slip needs it.
    critical = present(film.constriction, "constriction").gap if scene.slip else 0.0
    if leak.field is None:
        from fem_seal.finite_difference.node_pressure import node_pressure
        from fem_seal.finite_difference.slipping import film_without_slip

        if scene.slip is not None:
            film = film_without_slip(film, scene.slip, flow.links)
        solved = node_pressure(film, drive.pressure_drop, flow.links)
    else:
        from fem_seal.coupling.fluid_pressure import on_sites

        solved = on_sites(leak.field, film)
    at_sites, at_outlet = (
        drive.pressure(values, scene.slip, critical) for values in (solved, np.zeros(1))
    )
    return scene.gauge_pressures[1] + (at_sites - at_outlet)


def _finite_elements(
    scene: Scene,
    film: "GridFilm | MeshFilm",
    report: Report,
    comm: parallel.Comm,
    kept: "KeptMesh | None" = None,
) -> LeakRate:
    from fem_seal.flow import leak_rate

    flow = scene.flow

    def progress(level: Level) -> None:
        report("flow", f"{level.unknowns} unknowns, ±{per_cent(level.half_width)}")

    return leak_rate(
        film,
        viscosity=scene.viscosity,
        pressure_drop=scene.drive.pressure_drop,
        slip=scene.slip,
        method=flow.method,
        rtol=flow.rtol,
        decide=scene.deciding_rate,
        limits=flow.limits,
        progress=progress,
        field=scene.needs_field,
        kept=kept,
        comm=parallel.communicator(comm),
    )


def _finite_differences(
    scene: Scene, film: "GridFilm | MeshFilm", report: Report, comm: parallel.Comm
) -> LeakRate:
    from fem_seal.film import MeshFilm
    from fem_seal.finite_difference.solver import solve

    if isinstance(film, MeshFilm):
        raise InvalidInput("flow.method = 'finite-difference' needs a gap on a grid")
    flow = scene.flow
    return parallel.on_root(
        lambda: solve(
            film,
            viscosity=scene.viscosity,
            pressure_drop=scene.drive.pressure_drop,
            slip=scene.slip,
            links=flow.links,
        ),
        comm,
    )


Method = Callable[[Scene, "GridFilm | MeshFilm", Report, parallel.Comm], LeakRate]
FLOWS: dict[str, Method] = {
    "adaptive": _finite_elements,
    "uniform": _finite_elements,
    "finite-difference": _finite_differences,
}
