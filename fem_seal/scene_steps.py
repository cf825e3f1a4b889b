"""The steps of a scene, each computed from its sections and the result of the step before."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from fem_seal import parallel
from fem_seal.contact import bearing, press
from fem_seal.contact.settings import LEAST_BYTES, Load
from fem_seal.contact.state import BearingState, ContactState, GapState
from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput, present
from fem_seal.field_file import HEIGHT_NAMES, read_map
from fem_seal.field_file.profiles import read_profiles
from fem_seal.flow_settings import FlowSettings
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, LevelRecord
from fem_seal.memory import refuse_too_large
from fem_seal.progress import Report, silent
from fem_seal.scene import FileSurface, ProfileSurface, Scene
from fem_seal.surface import (
    IsotropicSpectrum,
    cropped,
    isotropic_spectrum,
    levelled_map,
    profile_spectrum,
    without_outliers,
)

if TYPE_CHECKING:
    from fem_seal.film import GridFilm, MeshFilm


def spectrum_of_profiles(surface: ProfileSurface) -> IsotropicSpectrum:
    """Spectrum C(q) of the isotropic surface that the profiles of a section are taken from."""
    read = read_profiles(
        surface.path, unit=surface.unit, step=surface.step, missing=surface.missing
    )
    try:
        heights = surface.height_factor * read.heights
        profiles = profile_spectrum(heights, read.step, detrend=surface.detrend)
    except InvalidInput as error:
        raise InvalidInput(f"profiles in {surface.path[0]}: {error}") from None
    return isotropic_spectrum(profiles)


def whole_map(surface: FileSurface) -> GridField:
    """Heights [m] of a file, after `surface.crop` and `surface.outliers`, without tilt and holes.

    The map is neither made periodic nor replaced by its twin; it is the one that windows are cut
    out of.
    """
    heights = read_map(surface.path, HEIGHT_NAMES, surface.stated, heights=True)
    if surface.crop is not None:
        heights = cropped(heights, surface.crop)
    return levelled_map(heights if surface.outliers is None else without_outliers(heights))


def elastic_contact(
    scene: Scene,
    surface: GridField,
    start: ContactState | np.ndarray | None,
    load: Load,
    report: Report = silent,
) -> ContactState:
    """Contact of a scene's solids with heights [m] under a load, not always that of the scene.

    It starts from a contact or a pressure [Pa].
    """

    def progress(iteration: int, certificate: float) -> None:
        report("contact", f"iteration {iteration}, certificate {certificate:.1e}")

    nx, ny = surface.shape
    subject = f"the contact of {nx} x {ny} samples"
    refuse_too_large(LEAST_BYTES * nx * ny - surface.values.nbytes, subject)
    if scene.flow.max_memory is not None:
        refuse_too_large(LEAST_BYTES * nx * ny, subject, scene.flow.max_memory)
    contact, solid = present(scene.contact, "[contact]"), present(scene.solid, "[solid]").elastic
    stopping = contact.stopping(progress)
    return press(surface, solid, load, stopping, contact.arithmetic, start)


def _bearing(
    scene: Scene, surface: GridField, start: np.ndarray | None, load: Load, report: Report
) -> BearingState:
    if load.kind == "pressure":
        raise InvalidInput(
            "contact.model = 'bearing' knows no pressure; give contact.area_fraction or mean_gap"
        )
    return bearing(surface, **{load.kind: load.value})


ContactModel = Callable[[Scene, GridField, np.ndarray | None, Load, Report], GapState]
CONTACTS: dict[str, ContactModel] = {"gfmd": elastic_contact, "bearing": _bearing}


def flow_progress(report: Report) -> Callable[[LevelRecord], None]:
    """Progress of a refinement, one line for each mesh."""
    return lambda level: report("flow", f"{level.unknowns} unknowns, ±{per_cent(level.half_width)}")


def _finite_elements(
    settings: FlowSettings, film: "GridFilm | MeshFilm", report: Report, comm: parallel.Comm
) -> LeakRate:
    if film.sealed:
        # Without FEniCSx.
        return LeakRate.sealed(settings.method)
    from fem_seal.flow import leak_rate

    return leak_rate(film, settings, progress=flow_progress(report), comm=comm)


def _finite_differences(
    settings: FlowSettings, film: "GridFilm | MeshFilm", report: Report, comm: parallel.Comm
) -> LeakRate:
    from fem_seal.film import MeshFilm
    from fem_seal.finite_difference.solver import by_differences

    if isinstance(film, MeshFilm):
        raise InvalidInput("flow.method = 'finite-difference' needs a gap on a grid")
    fluid = settings.viscosity, settings.pressure_drop, settings.slip
    return parallel.on_root(lambda: by_differences(film, *fluid, settings.link_rule), comm)


LeakMethod = Callable[[FlowSettings, "GridFilm | MeshFilm", Report, parallel.Comm], LeakRate]
FLOWS: dict[str, LeakMethod] = {
    "adaptive": _finite_elements,
    "uniform": _finite_elements,
    "finite-difference": _finite_differences,
}
