"""The coupled problem of contact and flow in a scene whose fluid lifts the solid."""

from functools import partial

from fem_seal import parallel
from fem_seal.contact.settings import Load
from fem_seal.coupling import LiftProblem
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.flow_settings import FlowSettings
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.network.film_pressure import eliminated
from fem_seal.progress import Report
from fem_seal.scene import Scene
from fem_seal.scene_steps import FLOWS, elastic_contact

# Nodes of the last network of a lift, at about 2 and 1 kB each, the network's own 1 kB included.
MOST_ELIMINATED, MOST_BY_MULTIGRID = 500_000, 2_000_000


def lifting_problem(
    scene: Scene,
    load: Load,
    settings: FlowSettings,
    surface: GridField,
    report: Report,
    comm: parallel.Comm = None,
) -> LiftProblem:
    """Coupled problem of a scene with `flow.lift` for heights [m] of the counter-face.

    Fluid pressures are above ambient. All processes of this run solve together without `comm`.
    """
    solver, most_nodes = eliminated, MOST_ELIMINATED
    if settings.method != "finite-difference":
        # Finite differences do without FEniCSx.
        from fem_seal.coupling.multigrid import by_multigrid

        solver, most_nodes = partial(by_multigrid, report=report), MOST_BY_MULTIGRID

    def leak_rate(settings: FlowSettings, film: GridFilm) -> LeakRate:
        return FLOWS[settings.method](settings, film, report, comm)

    inlet, outlet = scene.flow.gauge_pressures
    return LiftProblem(
        height=surface,
        solid=present(scene.solid, "[solid]").elastic,
        arithmetic=present(scene.contact, "[contact]").arithmetic,
        prescribed=load,
        settings=settings,
        drive=scene.drive,
        inlet=inlet,
        outlet=outlet,
        press=partial(elastic_contact, scene),
        film=scene.flow.film_of,
        leak_rate=leak_rate,
        solver=solver,
        most_nodes=most_nodes,
        report=report,
        comm=comm,
    )
