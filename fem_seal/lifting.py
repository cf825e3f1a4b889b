"""The coupled problem of contact and flow in a scene whose fluid lifts the solid."""

from dataclasses import replace
from functools import partial

import numpy as np

from fem_seal import parallel
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.coupling import LiftProblem, most_claimed
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.progress import Report, silent
from fem_seal.scene import Scene
from fem_seal.scene.contents import FlowSettings
from fem_seal.steps import FLOWS, elastic_contact, finite_elements

UNKNOWNS_ON_THE_WAY = 20000  # smallest limit on the unknowns of the flows of the passes
FEWEST_TO_HALVE = 128  # fewest samples along a side for a start on every second one


def lifting_problem(
    scene: Scene,
    load: Load,
    settings: FlowSettings,
    surface: GridField,
    report: Report,
    comm: parallel.Comm = None,
) -> LiftProblem:
    """Coupled problem of a scene with `flow.lift`; fluid pressures are above ambient.

    Parameters
    ----------
    scene
        Its solids, fluid and sides are those of the problem.
    load, settings
        Load of the contact, and settings of the last flow.
    surface
        Heights [m] of the counter-face.
    report
        Called with the progress of the last flow.
    comm
        The processes that solve together; all of this run if None.
    """
    contact, solid = present(scene.contact, "[contact]"), present(scene.solid, "[solid]").elastic
    arithmetic, flows = contact.arithmetic, SceneFlows(settings, report, comm)
    half_space = HalfSpace(
        surface.shape, surface.spacing, solid.layer, arithmetic.threads, arithmetic.precision
    )
    length = (surface.spacing[0] * surface.spacing[1]) ** 0.5

    def displacement(pressure: np.ndarray) -> np.ndarray:
        """Displacement [m] under a pressure [Pa] on the samples."""
        return half_space.displacement(pressure) * (2 * length / solid.contact_modulus)

    def press(
        heights: GridField,
        pressure: float | None,
        start: ContactState | np.ndarray | None,
        tolerance: float = 0.0,
    ) -> ContactState:
        """Contact of heights under a load [Pa], or under that of the scene."""
        target = load if pressure is None else Load("pressure", pressure)
        return parallel.on_root(
            lambda: elastic_contact(scene, heights, start, target, tolerance=tolerance), comm
        )

    inlet, outlet = scene.gauge_pressures
    return LiftProblem(
        height=surface,
        displacement=displacement,
        press=press,
        film=lambda gap: GridFilm(
            gap, scene.flow.sides_of(gap.periodic), scene.flow.representation
        ),
        flow=flows.to,
        flow_on_kept_mesh=None if flows.kept is None else flows.on_kept_mesh,
        fluid_pressure=partial(fluid_pressure, scene),
        inlet=inlet,
        outlet=outlet,
        load=load.value if load.kind == "pressure" else None,
        comm=comm,
    )


class SceneFlows:
    """The flows of the passes, each begun on the mesh of the flow before it.

    Parameters
    ----------
    settings
        Settings of the last flow.
    report
        Called with the progress of the last flow.
    comm
        The processes that solve together; all of this run if None.
    """

    def __init__(self, settings: FlowSettings, report: Report, comm: parallel.Comm):
        from fem_seal.flow import KeptMesh

        # The solid needs the pressure of every flow.
        self.settings = replace(settings, field=True)
        self.report, self.comm = report, comm
        #: Mesh of the last flow; None for a method that does not refine a mesh.
        self.kept = KeptMesh() if settings.method == "adaptive" else None

    def to(self, film: GridFilm, tolerance: float | None, new: bool = False) -> LeakRate:
        """Leak rate to the tolerance of a pass, or to that of the scene; see `LiftProblem.flow`."""
        if film.sealed:
            return LeakRate.sealed(self.settings.method)
        if self.kept is not None and new:
            self.kept.start = None
        if tolerance is None:
            return self._solve(self.settings, film, self.report)
        return self._solve(_on_the_way(self.settings, film, tolerance), film, silent)

    def _solve(self, settings: FlowSettings, film: GridFilm, report: Report) -> LeakRate:
        if settings.method == "finite-difference":
            return FLOWS[settings.method](settings, film, report, self.comm)
        margin = most_claimed(self.settings.rtol)
        return finite_elements(settings, film, report, self.comm, self.kept, margin)

    def on_kept_mesh(self, film: GridFilm) -> LeakRate:
        """Leak rate on the mesh of the last flow, which is not refined."""
        from fem_seal.flow import pressure_on_kept

        return pressure_on_kept(
            film,
            present(self.kept, "kept mesh"),
            viscosity=self.settings.viscosity,
            pressure_drop=self.settings.pressure_drop,
            slip=self.settings.slip,
            comm=parallel.communicator(self.comm),
        )


def _on_the_way(settings: FlowSettings, film: GridFilm, tolerance: float) -> FlowSettings:
    """Settings for the flow of a pass, which decides nothing and has a limit on the unknowns.

    The gap of an early pass may have constrictions that take very many unknowns to resolve; the gap
    of the result may not have them.
    """
    most = max(UNKNOWNS_ON_THE_WAY, film.samples.size)
    limits = replace(settings.limits, unknowns=min(most, settings.limits.unknowns or most))
    return replace(settings, rtol=tolerance, limits=limits, decide=None)


def fluid_pressure(scene: Scene, film: GridFilm, leak: LeakRate) -> np.ndarray:
    """Pressure of the fluid above ambient [Pa] on the sites of a film that leaks.

    Parameters
    ----------
    scene : Scene
        Scene; its [fluid] and [flow] are used.
    film : GridFilm
    leak : LeakRate
        Leak rate of the film. If it has no field, as from finite differences, the pressure is
        solved again.
    """
    flow, drive = scene.flow, scene.drive
    # Search for the constriction only if there is slip: the search takes a while.
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


def every_second(surface: GridField) -> GridField | None:
    """Every second sample of heights [m]; None for few or an odd number of samples."""
    nx, ny = surface.shape
    if min(nx, ny) < FEWEST_TO_HALVE or nx % 2 or ny % 2:
        return None
    values = np.ascontiguousarray(surface.values[::2, ::2])
    dx, dy = surface.spacing
    return GridField(values, (2 * dx, 2 * dy), surface.periodic)
