"""Which input matters, and where on the surface: derivatives of ln Q by one adjoint solve.

With the contact gap G of heights h under a load P and a fluid pressure p, the pressure R(g) of the
flow and the leak rate Q(g) of a network, the equilibrium is p = R(G(p)), and

    q = ∂ ln Q/∂g,    (I - G'ᵀ R'ᵀ) λ = G'ᵀ q,    w = q + R'ᵀ λ,    M z = w on the open samples
    ∂ ln Q/∂h = -M z,    ∂ ln Q/∂P = -1ᵀ z,    d ln Q/d ln E* = 1ᵀ z P - zᵀ p

with the stiffness M of the solid (docs/theory/mathematics.md, Newton's tangents). A dry contact has
p = 0 and λ = 0. The other inputs act through Q and R at a fixed gap; these two are differentiated
by central differences.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import log

import numpy as np

from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.coupling.krylov import gmres
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import LiftedState
from fem_seal.errors import InvalidInput, NotConverged, present
from fem_seal.finite_difference.film_pressure import FilmPressure
from fem_seal.grid import GridField
from fem_seal.lifting import lifting_problem
from fem_seal.progress import silent
from fem_seal.scene import Scene

TOLERANCE, MOST_ITERATIONS = 1e-6, 60  # of the adjoint solves
HALVED = 0.9  # part of the dissipation on the links that are halved
EPSILON = 1e-4  # gap that conducts in contact, in rms heights
STEP = 1e-4  # of the central differences, in ln of an input


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of the logarithm of the leak rate."""

    #: d ln Q/d ln of each input, named as in [tolerances]
    by_input: dict[str, float]
    #: ∂ ln Q/∂h (nx, ny) [1/m] by the height of the counter-face at a sample
    by_height: GridField


def sensitivity(
    scene: Scene,
    load: Load,
    height: GridField,
    contact: ContactState,
    lifted: LiftedState | None = None,
) -> Sensitivity:
    """Differentiate ln Q of an elastic contact, dry or lifted, under a pressure or a mean gap.

    The leak rate is that of a network of links: the one on which the lift has solved the fluid's
    pressure, or, dry, a coarse one whose links are halved where most is dissipated. The derivatives
    hold as long as no sample closes or opens.

    Parameters
    ----------
    height
        Heights [m] of the counter-face.
    contact
        Contact of these heights, at the equilibrium if it is lifted.
    lifted
        The equilibrium; None for a dry contact.
    """
    if load.kind == "area_fraction":
        raise InvalidInput(
            "the sensitivity needs contact.pressure or contact.mean_gap: the contact area is a "
            "step function of the load; name the pressure that the result of this scene has"
        )
    problem = lifting_problem(scene, load, scene.flow_settings, height, silent)
    if problem.film(contact.gap).sealed:
        raise InvalidInput("the sensitivity is that of a leak rate, and the patch is sealed")
    gap, epsilon = contact.gap.values, EPSILON * float(height.values.std())
    tangent = problem.contact_tangent(contact)
    grid = problem.first_grid if lifted is None else present(lifted.network, "network")
    flow = problem.film_pressure(gap, grid, epsilon)
    # The links that dissipate most are halved until they are half as long as the samples are apart.
    for _ in range(1 - problem.first_level if lifted is None and problem.refines else 0):
        grid = grid.refined(flow.dissipation, HALVED)
        flow = problem.film_pressure(gap, grid, epsilon)
    constriction = problem.film(contact.gap).constriction
    critical = constriction.gap if problem.slips and constriction is not None else 0.0
    q = flow.log_rate_by_gap
    adjoint, weight = np.zeros_like(gap), q
    if lifted is not None:
        by_u = _derivative_by_u(problem, flow, critical)
        solution = gmres(
            lambda one: one - tangent.change(flow.transposed(by_u * one, TOLERANCE), TOLERANCE),
            tangent.change(q, TOLERANCE),
            TOLERANCE,
            MOST_ITERATIONS,
        )
        if not solution.converged:
            raise NotConverged(
                f"the adjoint system of the sensitivity is not solved after {MOST_ITERATIONS} "
                "iterations of GMRES; leave it out of output.products"
            )
        adjoint = solution.x
        weight = q + flow.transposed(by_u * adjoint, TOLERANCE)
    z = tangent.change(weight, TOLERANCE)
    by_height = -problem.stiffness * problem.solid.pressure(z)
    by_input = {"heights": float(np.vdot(by_height, height.values))}
    solid = scene.solid
    modulus = "contact_modulus" if solid and solid.contact_modulus else "youngs_modulus"
    by_modulus = 0.0 if lifted is None else -float(np.vdot(z, lifted.fluid_pressure.values))
    if load.kind == "pressure":
        by_input["contact.pressure"] = -load.value * float(z.sum())
        by_modulus -= by_input["contact.pressure"]
    by_input[f"solid.{modulus}"] = by_modulus

    def at(other: Scene) -> tuple[float, np.ndarray]:
        """Ln Q and the fluid's pressure on the solid [Pa] in another fluid, at the same gap."""
        settings = other.flow_settings
        there = lifting_problem(other, load, settings, height, silent)
        through = there.film_pressure(gap, grid, epsilon) if there.slips else flow
        rate = through.conductance * settings.pressure_drop / settings.viscosity
        return log(rate), there.pressure_of(np.clip(through.on_samples, 0, 1), critical)

    for name in _of_fluid(scene):
        (more, above), (less, below) = (
            at(scene.scaled({name: 1 + step})) for step in (STEP, -STEP)
        )
        by_pressure = float(np.vdot(adjoint, above - below))
        by_input[name] = (more - less + by_pressure) / (2 * STEP)
    return Sensitivity(by_input, problem.field(by_height))


def _of_fluid(scene: Scene) -> Iterator[str]:
    """Inputs of [fluid] and [flow] that the scene gives and that are not 0."""
    yield "fluid.viscosity"
    for key in ("pressure_drop", "inlet_pressure", "outlet_pressure"):
        if getattr(scene.flow, key):
            yield f"flow.{key}"


def _derivative_by_u(problem: LiftProblem, flow: FilmPressure, critical: float) -> np.ndarray:
    """Derivative [Pa] of the fluid's pressure by the solution u of the linear problem."""
    u = np.clip(flow.on_samples, 0.0, 1.0)
    ends = np.clip(u - 1e-6, 0.0, 1.0), np.clip(u + 1e-6, 0.0, 1.0)
    low, high = (problem.pressure_of(end, critical) for end in ends)
    slope: np.ndarray = (high - low) / (ends[1] - ends[0])
    return slope
