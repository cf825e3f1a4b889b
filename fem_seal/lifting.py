"""The coupled problem of contact and flow in a scene whose fluid lifts the solid."""

from dataclasses import dataclass, replace
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
from fem_seal.leak_rate import LeakRate
from fem_seal.network.film_pressure import eliminated
from fem_seal.progress import Report
from fem_seal.scene import Scene
from fem_seal.steps import FLOWS, elastic_contact


@dataclass(frozen=True, eq=False, kw_only=True)
class SceneLift(LiftProblem):
    """Contact and flow under the laws of a scene."""

    scene: Scene
    prescribed: Load  #: pressure, area or mean gap of the contact
    settings: FlowSettings

    def half_space(self, heights: GridField) -> HalfSpace:
        """Solid on the grid of a counter-face."""
        solid = present(self.scene.solid, "[solid]").elastic
        arithmetic = present(self.scene.contact, "[contact]").arithmetic
        return HalfSpace(
            heights.shape, heights.spacing, solid.layer, arithmetic.threads, arithmetic.precision
        )

    def press(
        self, heights: GridField, load: float | None, start: ContactState | np.ndarray | None
    ) -> ContactState:
        """Contact of heights under a load [Pa], or under what is prescribed."""
        target = self.prescribed if load is None else Load("pressure", load)
        return elastic_contact(self.scene, heights, start, target)

    def film(self, gap: GridField) -> GridFilm:
        """Film of a gap, with the sides and the representation of the scene."""
        return self.scene.flow.film_of(gap)

    def flow(self, film: GridFilm, error: float) -> LeakRate:
        """Leak rate of a film by the method of the scene."""
        settings = replace(self.settings, margin=error)
        return FLOWS[settings.method](settings, film, self.report, self.comm)

    def cubes(self, gap: np.ndarray) -> np.ndarray:
        """Cubes of gaps [m³], times the gain by slip at the mean pressure."""
        slip = self.settings.slip
        return gap**3 if slip is None else gap**2 * slip.per_square_gap(gap)

    def pressure_of(self, u: np.ndarray, critical: float) -> np.ndarray:
        """Pressure above ambient [Pa] where the linear problem has the part u of its drop."""
        drive = self.scene.drive
        both = np.append(u.ravel(), 0.0) * drive.pressure_drop
        absolute = drive.pressure(both, self.settings.slip, critical)
        return self.outlet + (absolute[:-1] - absolute[-1]).reshape(u.shape)


def lifting_problem(
    scene: Scene,
    load: Load,
    settings: FlowSettings,
    surface: GridField,
    report: Report,
    comm: parallel.Comm = None,
) -> SceneLift:
    """Coupled problem of a scene with `flow.lift` for heights [m] of the counter-face.

    Fluid pressures are above ambient. All processes of this run solve together without `comm`.
    """
    by_differences, solver = settings.method == "finite-difference", eliminated
    if not by_differences:
        # Finite differences do without FEniCSx.
        from fem_seal.flow.multigrid import by_multigrid

        solver = partial(by_multigrid, eliminated=eliminated, report=report)
    inlet, outlet = scene.flow.gauge_pressures
    return SceneLift(
        height=surface,
        contact_modulus=present(scene.solid, "[solid]").elastic.contact_modulus,
        slips=settings.slip is not None,
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
        scene=scene,
        prescribed=load,
        settings=settings,
        report=report,
    )
