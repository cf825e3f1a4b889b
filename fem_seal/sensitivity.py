"""Which input matters, and where on the surface: derivatives of ln Q by one adjoint solve.

With the contact gap G of heights h under a load P and a fluid pressure p, the pressure R(g) of the
flow and the leak rate Q(g) of a network, the equilibrium is p = R(G(p)), and

    q = ∂ ln Q/∂g,    (I - G'ᵀ R'ᵀ) λ = G'ᵀ q,    w = q + R'ᵀ λ,    M z = w on the open samples
    ∂ ln Q/∂h = -M z,    ∂ ln Q/∂P = -1ᵀ z,    d ln Q/d ln E* = 1ᵀ z P - zᵀ p

with the stiffness M of the solid (docs/theory/mathematics.md, proposition 12). A dry contact has
p = 0 and λ = 0. The other inputs act through Q and R at a fixed gap; these two are differentiated
by central differences.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import log

import numpy as np

from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.coupling.krylov import LinearSolution
from fem_seal.coupling.point import LiftPoint
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import LiftedState
from fem_seal.errors import InvalidInput, NotConverged, present
from fem_seal.grid import GridField
from fem_seal.lifting import lifting_problem
from fem_seal.network.network import Network
from fem_seal.progress import silent
from fem_seal.scene import Scene

TOLERANCE, ITERATIONS = 1e-6, 60  # of the adjoint solves
OF_DISSIPATION = 0.9  # part of the dissipation on the links that are halved
# Gap that conducts in contact: part of the rms height, and at most of the critical constriction.
EPSILON, OF_CRITICAL = 1e-4, 0.1
LOAD_TOLERANCE = 0.03  # tolerance of the linear solves of `ByLoad`
DIFFERENCE = 1e-4  # of the central differences, in ln of an input


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
    hold as long as no sample closes or opens. The contact is that of the counter-face's heights
    [m], at the equilibrium if there is one. InvalidInput if the load is an area, or the patch is
    sealed; NotConverged if GMRES leaves more of the adjoint equation than it may.
    """
    if load.kind == "area_fraction":
        raise InvalidInput(
            "the sensitivity needs contact.pressure or contact.mean_gap: the contact area is a "
            "step function of the load; name the pressure that the result of this scene has"
        )
    problem = lifting_problem(scene, load, scene.flow_settings, height, silent)
    film, gap = problem.film(contact.gap), contact.gap.values
    if film.sealed:
        raise InvalidInput("the sensitivity is that of a leak rate, and the patch is sealed")
    critical = present(film.constriction, "constriction").gap
    epsilon = _epsilon(problem, critical)
    point = _point(problem, epsilon, contact, lifted)
    flow, adjoint, weight = point.flow, np.zeros_like(gap), point.flow.log_rate_by_gap
    if lifted is not None:
        adjoint = _solution(point.linear.adjoint(TOLERANCE, ITERATIONS))
        weight = weight + point.linear.response_transposed(adjoint, TOLERANCE)
    z = point.gap_change(weight, TOLERANCE)
    by_height = -problem.stiffness * problem.half_space.pressure(z)
    by_input = {"heights": float(np.vdot(by_height, height.values))}
    solid = scene.solid
    modulus = "contact_modulus" if solid and solid.contact_modulus else "youngs_modulus"
    by_modulus = 0.0 if lifted is None else -float(np.vdot(z, lifted.fluid_pressure.values))
    if load.kind == "pressure":
        by_input["contact.pressure"] = -load.value * float(z.sum())
        by_modulus -= by_input["contact.pressure"]
    by_input[f"solid.{modulus}"] = by_modulus

    def at(name: str, factor: float) -> tuple[float, np.ndarray]:
        """Logarithm of Q and the fluid's pressure [Pa] of a changed input, at the same gap."""
        other = scene.scaled({name: factor})
        settings = other.flow_settings
        there = lifting_problem(other, load, settings, height, silent)
        through = there.film_pressure(gap, point.network, epsilon) if settings.slip else flow
        rate = through.conductance * settings.pressure_drop / settings.viscosity
        return log(rate), there.pressure_of(through.on_samples, point.critical)

    for name in _of_fluid(scene):
        (more, above), (less, below) = at(name, 1 + DIFFERENCE), at(name, 1 - DIFFERENCE)
        by_pressure = float(np.vdot(adjoint, above - below))
        by_input[name] = (more - less + by_pressure) / (2 * DIFFERENCE)
    return Sensitivity(by_input, problem.field(by_height))


def _point(
    problem: LiftProblem, epsilon: float, contact: ContactState, lifted: LiftedState | None
) -> LiftPoint:
    """The equilibrium, or the dry contact, with the network of its leak rate."""
    if lifted is not None:
        network, pressure = present(lifted.network, "network"), lifted.fluid_pressure.values
        return LiftPoint(problem, network, epsilon, pressure, contact)
    none = np.zeros(contact.gap.shape)
    point = LiftPoint(problem, problem.first_network, epsilon, none, contact)
    # Triangles are halved until those that dissipate most are at most half a sample wide.
    for _ in range(1 + problem.doublings):
        flow = point.flow
        finer = point.network.refined(flow.dissipation, OF_DISSIPATION, flow.varies)
        point = replace(point, network=finer)
    return point


def _solution(solved: LinearSolution) -> np.ndarray:
    if not solved.converged:
        raise NotConverged(
            "the linear system of the sensitivity of contact and flow is not solved: "
            f"{ITERATIONS} iterations of GMRES leave {solved.residuals[-1]:.1e} of it; try "
            "a smaller contact.tolerance, or leave out what asks for it"
        )
    return solved.x


@dataclass(frozen=True, eq=False)
class ByLoad:
    """Derivatives by the load P of a contact, dry or lifted, while no sample closes or opens.

    They are rough. With the tangent T of the contact and the response R' of the fluid's pressure p,
    on the network on which the lift was solved,

        ∂g/∂P = T (∂p/∂P - 1),    ∂p/∂P = R' ∂g/∂P,    ∂p_c/∂P = 1 + M ∂g/∂P - ∂p/∂P
    """

    problem: LiftProblem
    contact: ContactState
    lifted: LiftedState | None  #: None for a dry contact
    critical: float  #: gap of the critical constriction [m]; 0 if sealed: p then stays as it is

    @cached_property
    def gap(self) -> np.ndarray:
        """∂g/∂P (nx, ny) [m/Pa]."""
        return self._point.gap_change(self._fluid - 1, LOAD_TOLERANCE)

    @cached_property
    def pressure(self) -> np.ndarray:
        """∂p_c/∂P (nx, ny) of the contact pressure."""
        problem = self.problem
        return 1 + problem.stiffness * problem.half_space.pressure(self.gap) - self._fluid

    @cached_property
    def log_rate(self) -> float:
        """∂ ln Q/∂P [1/Pa] on the network; of a dry contact on a coarse one."""
        if self.lifted is not None:
            return float(np.vdot(self._point.flow.log_rate_by_gap, self.gap))
        problem, gap, stride = self.problem, self.contact.gap, 2**self.problem.doublings
        dx, dy = gap.spacing
        coarse = GridField(gap.values[::stride, ::stride], (stride * dx, stride * dy), gap.periodic)
        network = Network.uniform(problem.film(coarse), 1)
        flow = problem.film_pressure(coarse.values, network, self._point.epsilon)
        return float(np.vdot(flow.log_rate_by_gap, self.gap[::stride, ::stride]))

    @cached_property
    def _point(self) -> LiftPoint:
        problem, epsilon = self.problem, _epsilon(self.problem, self.critical)
        if self.lifted is None:
            none = np.zeros(self.contact.gap.shape)
            return LiftPoint(problem, problem.first_network, epsilon, none, self.contact)
        return _point(problem, epsilon, self.contact, self.lifted)

    @cached_property
    def _fluid(self) -> np.ndarray:
        """∂p/∂P (nx, ny)."""
        none = np.zeros(self.contact.gap.shape)
        if self.lifted is None or self.critical == 0:
            return none
        linear = self._point.linear
        at_fixed = linear.response(linear.gap_change(none - 1, LOAD_TOLERANCE), LOAD_TOLERANCE)
        return _solution(linear.solved(at_fixed, LOAD_TOLERANCE, ITERATIONS)[0])


def _epsilon(problem: LiftProblem, critical: float) -> float:
    """Gap that conducts in contact [m], beside a critical constriction [m]."""
    return min(EPSILON * problem.roughness, OF_CRITICAL * critical)


def _of_fluid(scene: Scene) -> Iterator[str]:
    """Inputs of [fluid] and [flow] that the scene gives and that are not 0."""
    yield "fluid.viscosity"
    for key in ("pressure_drop", "inlet_pressure", "outlet_pressure"):
        if getattr(scene.flow, key):
            yield f"flow.{key}"
