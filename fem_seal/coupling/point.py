"""A fluid pressure that lifts the solid, with the contact under it, and Newton's step from there.

With the gap G(p) of the contact under a fluid pressure p and the pressure R(g) of the flow through
a gap, an equilibrium is a zero of F(p) = R(G(p)) - p. One step solves

    (I - R' G') δ = F

by GMRES (`linearised`); a plain pass, p = R(G(p)), would compute contact and flow in turn.

A solid that floats on its fluid has no contact that fixes its separation t from the counter-face,
the mean of g + h. It is then an unknown of its own, G(p, t) = S p - h + t, and the load its
equation: mean(p) = P₀.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.contact.tangent import ContactTangent
from fem_seal.coupling.krylov import LinearSolution
from fem_seal.coupling.linearised import Linearised, summed_by_parts
from fem_seal.coupling.problem import LOAD_ROUNDING, LiftProblem
from fem_seal.coupling.state import LARGEST_CHANGE
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.leak_rate import log_ratio
from fem_seal.network.film_pressure import FilmPressure
from fem_seal.network.network import Network

STEP_TOLERANCE = 0.1  # part of F that GMRES leaves in Newton's step
# The same for λ: no later step corrects an error of λ, and next to closing λ is large. What GMRES
# leaves of its right side, times the step, is an error of λ·F.
ADJOINT_TOLERANCE = 0.01
MOST_GMRES = 20  # iterations; most scenes need two to six
# Part of the network's error that the triangles hold which are halved.
HALVED_SHARE = 0.9
# Least gap of a solid that floats, over ε: the flow hardly tells a smaller one from contact.
LEAST_GAP = 0.1
# Part of the allowed error of ln Q by which a channel along diagonals may change it: many may open.
DIAGONAL_CHANGE = 0.01


@dataclass(frozen=True, eq=False)
class NewtonStep:
    """Newton's step from a point."""

    pressure: np.ndarray  #: δ (nx, ny) [Pa]
    gap: np.ndarray  #: change (nx, ny) of the gap [m]
    #: size of the change of ln Q, to first order; infinite if GMRES has not reached its tolerance
    log_rate: float
    #: whether it leads away from a state that contact and flow in turn would leave
    unstable: bool = False


@dataclass(frozen=True, eq=False)
class LiftPoint:
    """A fluid pressure, the contact under it, and the pressure of the flow through its gap."""

    problem: LiftProblem
    network: Network  #: for the flow
    epsilon: float  #: gap that conducts in contact [m]
    pressure: np.ndarray  #: p (nx, ny) above ambient [Pa]
    contact: ContactState  #: under that pressure

    @cached_property
    def flow(self) -> FilmPressure:
        """Flow through the gap."""
        return self.problem.film_pressure(self.contact.gap.values, self.network, self.epsilon)

    @cached_property
    def sealed(self) -> bool:
        """Whether no open path leads through the gap."""
        return self.problem.film(self.contact.gap).sealed

    @cached_property
    def critical(self) -> float:
        """Gap of the critical constriction, ε at least [m]; 0 unless the fluid slips."""
        if self.problem.settings.slip is None:
            return 0.0
        constriction = self.problem.film(self.contact.gap).constriction
        return max(constriction.gap if constriction else 0.0, self.epsilon)

    @cached_property
    def residual(self) -> np.ndarray:
        """F (nx, ny) [Pa]."""
        return self.problem.pressure_of(self.flow.on_samples, self.critical) - self.pressure

    @property
    def lacking(self) -> float:
        """Load that neither the solid nor the fluid carries [Pa]."""
        return 0.0

    @cached_property
    def residual_size(self) -> float:
        """Root mean square of F, with the load that is lacking, over the pressure drop."""
        of_flow, problem = float(np.sqrt(np.mean(self.residual**2))), self.problem
        return float(np.hypot(of_flow, self.lacking)) / (problem.inlet - problem.outlet)

    @cached_property
    def pressure_by_u(self) -> np.ndarray:
        """Derivative (nx, ny) [Pa] of the fluid's pressure by the solution u of the network."""
        return self.problem.pressure_by(self.flow.on_samples, self.critical)

    @cached_property
    def gap_change(self) -> Callable[[np.ndarray, float], np.ndarray]:
        """G', see `Linearised`."""
        problem, opened = self.problem, self.contact.gap.values > 0
        held = problem.prescribed.kind == "mean_gap"
        # No method of this point: a point that refers to itself would outlive its use.
        return ContactTangent(problem.half_space, problem.stiffness, opened, held).change

    @cached_property
    def linear(self) -> Linearised:
        """Contact and flow to first order."""
        gap, by_critical = self.contact.gap.values, np.zeros_like(self.pressure)
        tightest = (gap > 0) & (gap == self.critical)
        count = np.count_nonzero(tightest)
        if count:
            by_critical = self.problem.pressure_by_critical(self.flow.on_samples, self.critical)
        weights = tightest / max(count, 1)
        return Linearised(self.gap_change, self.flow, self.pressure_by_u, by_critical, weights)

    def thinned_to(self, problem: LiftProblem) -> "LiftPoint":
        """The point on the samples of a thinned problem, with the contact of all samples there."""
        stride = self.problem.stride_of(problem.height.values)
        gap, pressure = (
            problem.field(field.values[::stride, ::stride])
            for field in (self.contact.gap, self.contact.pressure)
        )
        contact = ContactState(gap, pressure, problem.solid.contact_modulus)
        below = self.pressure[::stride, ::stride]
        return LiftPoint(problem, problem.first_network, self.epsilon, below, contact)

    def conducts_like(self, other: "LiftPoint") -> bool:
        """Whether ln Q of both differ so little that λ of one may be used for the other."""
        return log_ratio(self.flow.conductance, other.flow.conductance) <= LARGEST_CHANGE

    @cached_property
    def _adjoint(self) -> LinearSolution:
        """λ of the thinned problem with the fewest samples whose film conducts like this one.

        It may be unstable with fewer samples and stable with all: then more samples are taken.
        """
        for thinned in self.problem.chain[:-1]:
            point = self.thinned_to(thinned)
            if point.conducts_like(self):
                adjoint = point.linear.adjoint(ADJOINT_TOLERANCE, MOST_GMRES)
                if not adjoint.unstable:
                    return adjoint
        return self.linear.adjoint(ADJOINT_TOLERANCE, MOST_GMRES)

    @cached_property
    def step(self) -> NewtonStep:
        """Newton's step."""
        solution, gap = self.linear.solved(
            self.residual, STEP_TOLERANCE, MOST_GMRES, to_stable=True
        )
        return NewtonStep(
            pressure=solution.x,
            gap=gap,
            log_rate=self.linear.log_rate_change(gap) if solution.converged else np.inf,
            unstable=solution.unstable,
        )

    @property
    def keeps_load(self) -> bool:
        """Whether F changes the solid's load by at most `allowed` of it.

        ln Q alone would end the steps too early where the solid is stiff: it hardly depends on the
        fluid's pressure there.
        """
        gained = float(self.residual.mean())
        return abs(gained) <= self.problem.allowed * self.problem.solid_load(self.pressure)

    @cached_property
    def by_epsilon(self) -> float:
        """Part of the leak rate that is due to ε; where it is small, p_f depends on ε even less."""
        return self.flow.lost_with(np.cbrt(self.problem.cubes(self.contact.gap.values)))

    def finer(self, problem: LiftProblem) -> tuple[Network, float]:
        """Network and ε of the next stage: smaller triangles where errors change ln Q most.

        The network is on the samples of a problem, which are those of this point or more.
        """
        epsilon, allowed = self.epsilon, problem.allowed
        if self.by_epsilon > allowed / 2:
            epsilon /= 4  # halved triangles have a quarter of the error
        # λ of a thinned problem weighs the pressure at its samples alone.
        weight, of_samples = np.zeros_like(self.pressure), self._adjoint.x
        stride = self.problem.stride_of(of_samples)
        weight[::stride, ::stride] = of_samples
        by_links, by_diagonals = self.flow.by_parts(self.pressure_by_u * weight, ADJOINT_TOLERANCE)
        anyway = by_diagonals > DIAGONAL_CHANGE * allowed
        varies, film = self.flow.varies, problem.touching_film
        return self.network.refined(by_links, HALVED_SHARE, varies, anyway, film), epsilon

    def at_stage(self, problem: LiftProblem, network: Network, epsilon: float) -> "LiftPoint":
        """The point with another network and ε, on the samples of a problem."""
        if problem is self.problem:
            return replace(self, network=network, epsilon=epsilon)
        pressure = problem.interpolated(self.pressure)
        # From this start a contact takes two thirds of the iterations that it takes without one.
        start = np.maximum(problem.interpolated(self.contact.pressure.values), 0.0)
        return LiftPoint(
            problem, network, epsilon, pressure, problem.contact_under(pressure, start)
        )

    def log_rate_error(self, other: "LiftPoint") -> float:
        """Error of ln Q by the flow of another point, here or on more samples.

        It is λ·F of the other point; infinite if λ is not known.
        """
        return self._log_rate_by(other, other.residual)

    def log_rate_change_to(self, other: "LiftPoint") -> float:
        """Change of ln Q from the flow of this point to that of another, as of `log_rate_error`."""
        stride = other.problem.stride_of(self.residual)
        moved = other.residual.copy()
        moved[::stride, ::stride] -= self.residual
        return self._log_rate_by(other, moved)

    def _log_rate_by(self, other: "LiftPoint", pressure: np.ndarray) -> float:
        """Change of ln Q by a pressure on the samples of another point."""
        here = other.problem is self.problem
        if not (self._adjoint.converged and (here or self.conducts_like(other))):
            return np.inf
        stride = other.problem.stride_of(self._adjoint.x)
        return summed_by_parts(self._adjoint.x * pressure[::stride, ::stride])

    @property
    def unstable(self) -> bool:
        """Whether contact and flow in turn would leave this state."""
        return self._adjoint.unstable

    def in_equilibrium(self, tolerance: float) -> bool:
        """Whether a step changes ln Q by at most a tolerance, and the load by at most its limit."""
        little = self.log_rate_error(self) <= tolerance and self.keeps_load
        return little and not self.unstable

    def leaks_like(self, other: "LiftPoint") -> bool:
        """Whether both have the same ln Q, of which each may err by what is allowed."""
        apart = self.linear.log_rate_change(self.contact.gap.values - other.contact.gap.values)
        apart += log_ratio(self.flow.conductance, other.flow.conductance)
        return apart <= 2 * self.problem.allowed

    @cached_property
    def opened(self) -> GridFilm | None:
        """The film that the most fluid pressure opens; None if it stays sealed."""
        problem, pressure = self.problem, self.problem.highest_pressure(self.contact)
        if problem.solid_load(pressure) <= 0:
            return problem.touching_film
        film = problem.film(problem.contact_under(pressure, self.contact).gap)
        return None if film.sealed else film

    @property
    def stays_sealed(self) -> bool:
        """Whether the film is sealed, and stays so under the most fluid pressure."""
        return self.sealed and self.opened is None

    def after(self, step: NewtonStep, fraction: float = 1.0) -> "LiftPoint | None":
        """The point a fraction of a step further on; None if that leaves nothing to the solid.

        Its contact starts from its pressure to first order: that takes two thirds of the iterations
        from the contact before the step.
        """
        problem, contact = self.problem, self.contact
        pressure = np.clip(self.pressure + fraction * step.pressure, problem.outlet, problem.inlet)
        if problem.solid_load(pressure) <= 0:
            return None
        change = problem.half_space.pressure(step.gap) * problem.stiffness - step.pressure
        start = np.where(contact.contact, contact.pressure.values + fraction * change, 0.0)
        pressed = problem.contact_under(pressure, np.maximum(start, 0.0))
        return replace(self, pressure=pressure, contact=pressed)


@dataclass(frozen=True, eq=False)
class FloatingPoint(LiftPoint):
    """A fluid pressure that carries the solid alone, at a distance from the counter-face.

    Without contact G' is that at a fixed separation.
    """

    @classmethod
    def leaving(cls, point: LiftPoint) -> Self:
        """The point at which the solid has just left the counter-face."""
        problem, pressure = point.problem, point.pressure
        touching = problem.displacement(pressure) - problem.height.values
        floating = cls.at_gap(point, pressure, touching - touching.min() + point.epsilon)
        return present(floating, "gap")

    @classmethod
    def high(cls, point: LiftPoint) -> Self:
        """The point with a film that is higher than the counter-face is rough."""
        problem, pressure = point.problem, point.problem.uniform_pressure
        touching = problem.displacement(pressure) - problem.height.values
        above = touching - touching.min() + np.ptp(touching)
        return present(cls.at_gap(point, pressure, above), "gap")

    @classmethod
    def at_gap(cls, point: LiftPoint, pressure: np.ndarray, gap: np.ndarray) -> Self | None:
        """The point of another pressure and a gap; None if the solid touches the counter-face."""
        if not gap.min() > LEAST_GAP * point.epsilon:  # a NaN is no gap either
            return None
        problem = point.problem
        contact = ContactState.without_load(problem.field(gap), problem.solid.contact_modulus)
        return cls(problem, point.network, point.epsilon, pressure, contact)

    @property
    def lacking(self) -> float:
        """What the fluid does not carry of the load [Pa]: no contact carries the rest."""
        return self.problem.solid_load(self.pressure)

    @property
    def keeps_load(self) -> bool:
        """Whether the fluid carries the load, to rounding, as after each whole step."""
        return abs(self.lacking) <= LOAD_ROUNDING * (self.problem.inlet - self.problem.outlet)

    @property
    def unstable(self) -> bool:
        """Whether a solid a little higher would rise on, or contact and flow leave this state."""
        return self.step.unstable

    def log_rate_error(self, other: LiftPoint) -> float:
        """What the first step of the other point changes: the separation is an unknown as well."""
        return other.step.log_rate

    def log_rate_change_to(self, other: LiftPoint) -> float:
        """The same, with what the steps of this point have left."""
        return self.log_rate_error(other)

    @cached_property
    def step(self) -> NewtonStep:
        """Newton's step: that at a fixed separation, and the rise that restores the load.

        Where the fluid carries more as the solid rises, no state lasts: the solid goes where the
        load drives it, away from such a state.
        """
        linear = self.linear
        fixed, by_pressure = linear.solved(
            self.residual, STEP_TOLERANCE, MOST_GMRES, to_stable=True
        )
        by_rise = linear.response(np.ones_like(self.pressure), ADJOINT_TOLERANCE)
        lifted, displaced = linear.solved(by_rise, STEP_TOLERANCE, MOST_GMRES)
        load_by_rise = float(lifted.x.mean())
        # Under a rigid solid with grooves along the flow p_f is the same at all separations.
        excess = float(fixed.x.mean()) - self.lacking
        rise = excess / abs(load_by_rise) if load_by_rise else 0.0
        gap = by_pressure + rise * (1 + displaced)
        solved = fixed.converged and lifted.converged
        return NewtonStep(
            pressure=fixed.x + rise * lifted.x,
            gap=gap,
            log_rate=self.linear.log_rate_change(gap) if solved else np.inf,
            unstable=fixed.unstable or load_by_rise > 0,
        )

    def after(self, step: NewtonStep, fraction: float = 1.0) -> Self | None:
        """The point a fraction of a step further on; None if the solid would touch.

        The film at most doubles, and a quarter of it is left everywhere: p_f hardly depends on a
        large separation, whose step may therefore be as long as one likes.
        """
        gap = self.contact.gap.values
        longest = max(float(step.gap.mean() / gap.mean()), float((-step.gap / gap).max()) / 0.75)
        fraction = min(fraction, 1 / longest) if longest > 0 else fraction
        pressure = self.pressure + fraction * step.pressure
        return self.at_gap(self, pressure, gap + fraction * step.gap)
