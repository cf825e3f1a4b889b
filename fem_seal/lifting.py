"""The coupled problem of contact and flow in a scene whose fluid lifts the solid."""

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
from fem_seal.steps import FLOWS, elastic_contact, finite_elements

UNKNOWNS_ON_THE_WAY = 20000  # smallest limit on the unknowns of the flows of the passes
FEWEST_TO_HALVE = 128  # fewest samples along a side for a start on every second one


def lifting_problem(
    scene: Scene, surface: GridField, report: Report, comm: parallel.Comm = None
) -> LiftProblem:
    """Coupled problem of a scene with `flow.lift`; fluid pressures are above ambient.

    Parameters
    ----------
    scene : Scene
    surface : GridField
        Heights [m] of the counter-face.
    report : callable
        Called with the progress of the last flow.
    comm : MPI.Comm or None
        The processes that solve together; all of this run if None.
    """
    contact, solid = present(scene.contact, "[contact]"), present(scene.solid, "[solid]").elastic
    arithmetic, flows = contact.arithmetic, SceneFlows(scene, report, comm)
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
        start: ContactState | np.ndarray | None,
        tolerance: float = 0.0,
    ) -> ContactState:
        """Contact of heights under a load [Pa], or under that of the scene."""
        target = contact.load if load is None else Load("pressure", load)
        return parallel.on_root(
            lambda: elastic_contact(scene, heights, start, target, tolerance=tolerance), comm
        )

    inlet, outlet = scene.gauge_pressures
    return LiftProblem(
        height=surface,
        displacement=displacement,
        press=press,
        film=lambda gap: GridFilm(gap, scene.flow.sides, scene.flow.representation),
        flow=flows.to,
        flow_on_kept_mesh=None if flows.kept is None else flows.on_kept_mesh,
        fluid_pressure=partial(fluid_pressure, scene),
        inlet=inlet,
        outlet=outlet,
        load=contact.pressure,
        comm=comm,
    )


class SceneFlows:
    """The flows of the passes, each begun on the mesh of the flow before it.

    Parameters
    ----------
    scene : Scene
    report : callable
        Called with the progress of a flow that is solved to the tolerance of the scene.
    comm : MPI.Comm or None
        The processes that solve together; all of this run if None.

    Attributes
    ----------
    kept : KeptMesh or None
        Mesh of the last flow; None for a method that does not refine a mesh.
    """

    def __init__(self, scene: Scene, report: Report, comm: parallel.Comm):
        from fem_seal.flow import KeptMesh

        # Every flow must return its pressure field: the product "constriction" makes it do so.
        products = (*scene.output.products, "constriction")
        output = scene.output.model_copy(update={"products": products})
        self.scene = scene.model_copy(update={"output": output})
        self.report, self.comm = report, comm
        self.kept = KeptMesh() if scene.flow.method == "adaptive" else None

    def to(self, film: GridFilm, tolerance: float | None, new: bool = False) -> LeakRate:
        """Leak rate to the tolerance of a pass, or to that of the scene; see `LiftProblem.flow`."""
        if film.sealed:
            return LeakRate.sealed(self.scene.flow.method)
        if self.kept is not None and new:
            self.kept.start = None
        if tolerance is None:
            return self._solve(self.scene, film, self.report)
        return self._solve(_on_the_way(self.scene, film, tolerance), film, silent)

    def _solve(self, scene: Scene, film: GridFilm, report: Report) -> LeakRate:
        if scene.flow.method == "finite-difference":
            return FLOWS[scene.flow.method](scene, film, report, self.comm)
        margin = most_claimed(self.scene.flow.rtol)
        return finite_elements(scene, film, report, self.comm, self.kept, margin)

    def on_kept_mesh(self, film: GridFilm) -> LeakRate:
        """Leak rate on the mesh of the last flow, which is not refined."""
        from fem_seal.flow import pressure_on_kept

        return pressure_on_kept(
            film,
            present(self.kept, "kept mesh"),
            viscosity=self.scene.viscosity,
            pressure_drop=self.scene.drive.pressure_drop,
            slip=self.scene.slip,
            comm=parallel.communicator(self.comm),
        )


def _on_the_way(scene: Scene, film: GridFilm, tolerance: float) -> Scene:
    """Scene for the flow of a pass, without a limit to decide and with a limit on the unknowns.

    The gap of an early pass may have constrictions that take very many unknowns to resolve; the gap
    of the result may not have them.
    """
    most = max(UNKNOWNS_ON_THE_WAY, film.samples.size)
    most = min(most, scene.flow.max_unknowns or most)
    flow = scene.flow.model_copy(update={"rtol": tolerance, "max_unknowns": most})
    return scene.model_copy(update={"flow": flow, "limit": None})


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
