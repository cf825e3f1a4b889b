"""The coupled problem of contact and flow in a scene whose fluid lifts the solid."""

from dataclasses import replace
from functools import partial

import numpy as np

from fem_seal import parallel
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.coupling import LiftProblem
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.flow_settings import FlowSettings
from fem_seal.grid import GridField
from fem_seal.network.film_pressure import eliminated
from fem_seal.progress import Report
from fem_seal.scene import Scene
from fem_seal.steps import FLOWS, elastic_contact


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
    contact, solid = present(scene.contact, "[contact]"), present(scene.solid, "[solid]").elastic
    arithmetic, slip = contact.arithmetic, settings.slip
    by_differences, solver = settings.method == "finite-difference", eliminated
    if not by_differences:
        # Finite differences do without FEniCSx.
        from fem_seal.flow.linear import by_multigrid

        solver = partial(by_multigrid, eliminated=eliminated, report=report)
    inlet, outlet = scene.gauge_pressures

    def press(
        heights: GridField, pressure: float | None, start: ContactState | np.ndarray | None
    ) -> ContactState:
        """Contact of heights under a load [Pa], or under that of the scene."""
        target = load if pressure is None else Load("pressure", pressure)
        return elastic_contact(scene, heights, start, target)

    def cubes(gap: np.ndarray) -> np.ndarray:
        """Cubes of gaps [m³], times the gain by slip at the mean pressure."""
        return gap**3 if slip is None else gap**2 * slip.per_square_gap(gap)

    def pressure_of(part: np.ndarray, critical: float) -> np.ndarray:
        """Pressure above ambient [Pa] where the linear problem has a part of its drop."""
        drive = scene.drive
        both = np.append(part.ravel(), 0.0) * drive.pressure_drop
        absolute = drive.pressure(both, slip, critical)
        return outlet + (absolute[:-1] - absolute[-1]).reshape(part.shape)

    return LiftProblem(
        height=surface,
        half_space=lambda heights: HalfSpace(
            heights.shape, heights.spacing, solid.layer, arithmetic.threads, arithmetic.precision
        ),
        contact_modulus=solid.contact_modulus,
        press=press,
        film=lambda gap: GridFilm(
            gap, scene.flow.sides_of(gap.periodic), scene.flow.representation
        ),
        flow=lambda film, error: FLOWS[settings.method](
            replace(settings, margin=error), film, report, comm
        ),
        cubes=cubes,
        pressure_of=pressure_of,
        slips=slip is not None,
        links=settings.links if by_differences else "linear-gap",
        solver=solver,
        refines=not by_differences,
        inlet=inlet,
        outlet=outlet,
        load=load.value if load.kind == "pressure" else None,
        mean_gap_held=load.kind == "mean_gap",
        limits=settings.limits,
        negligible=12 * settings.viscosity * settings.negligible / settings.pressure_drop,
        comm=comm,
    )
