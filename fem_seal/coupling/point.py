"""A fluid pressure that lifts the solid, with the contact under it, and Newton's step from there.

With the gap G(p) of the contact under a fluid pressure p and the pressure R(g) of the flow through
a gap, an equilibrium is a zero of F(p) = R(G(p)) - p. One step solves

    (I - R' G') δ = F

by GMRES; a plain pass, p = R(G(p)), would compute contact and flow in turn. G' is the tangent of
the contact (`contact.tangent`), R' that of the flow (`network.film_pressure`).

A solid that floats on its fluid has no contact that fixes its level. The level t is then an unknown
of its own, G(p, t) = S p - h + t, and the load its equation: mean(p) = P₀.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.contact.tangent import ContactTangent
from fem_seal.coupling.constants import FORCING, LEAST, MARKED, MOST_NODES, MOST_STEPS, PARTS
from fem_seal.coupling.krylov import LinearSolution, gmres, weighted_sum
from fem_seal.coupling.problem import LiftProblem
from fem_seal.film import GridFilm
from fem_seal.network.film_pressure import FilmPressure
from fem_seal.network.pressure_grid import PressureGrid


def not_by_chance(changes: np.ndarray) -> float:
    """Sum of changes (nx, ny) in size, over parts of the patch.

    Changes in several places may cancel by chance, and those of the next stage need not.
    """
    rows, columns = (np.arange(PARTS) * n // PARTS for n in changes.shape)
    parts = np.add.reduceat(np.add.reduceat(changes, rows, axis=0), columns, axis=1)
    return float(np.abs(parts).sum())


@dataclass(frozen=True)
class Stage:
    """How exactly the fluid's pressure is solved."""

    grid: PressureGrid  #: network for the flow
    epsilon: float  #: gap that conducts in contact [m]


@dataclass(frozen=True, eq=False)
class NewtonStep:
    """Newton's step from a point."""

    pressure: np.ndarray  #: δ (nx, ny) [Pa]
    gap: np.ndarray | None  #: change (nx, ny) of the gap [m], if known
    log_rate: float  #: size of the change of the logarithm of the leak rate, to first order
    iterations: int  #: most iterations of GMRES
    solved: bool  #: whether GMRES has reached its tolerance
    negative: np.ndarray | None  #: direction (nx, ny) in which plain passes leave the point
    level: float = 0.0  #: change of the level of a solid that floats [m]


@dataclass(frozen=True, eq=False)
class LiftPoint:
    """A fluid pressure, the contact under it, and the pressure of the flow through its gap."""

    problem: LiftProblem
    stage: Stage
    pressure: np.ndarray  #: p (nx, ny) above ambient [Pa]
    contact: ContactState  #: under that pressure

    @staticmethod
    def under(
        problem: LiftProblem,
        stage: Stage,
        pressure: np.ndarray,
        start: ContactState | np.ndarray | None,
    ) -> "LiftPoint":
        """The point with the contact under a pressure (nx, ny) [Pa]."""
        return LiftPoint(problem, stage, pressure, problem.contact_under(pressure, start))

    def on(self, problem: LiftProblem, allowed: float) -> "LiftPoint":
        """The point on a grid of more samples, from the pressures of the coarse one at each.

        It begins a stage, on a finer network if the errors of this one may change ln Q by more
        than what is allowed.
        """
        stage = Stage(problem.first_grid, self.stage.epsilon)
        same_triangles = problem.refines and self.problem.first_level == 0
        if same_triangles and float((self._by_parts[0] * self.flow.varies).sum()) > allowed:
            stage = self._finer(stage.grid, allowed)
        every = problem.height.shape[0] // self.pressure.shape[0]
        pressure, start = (
            values.repeat(every, axis=0).repeat(every, axis=1)
            for values in (self.pressure, self.contact.pressure.values)
        )
        return LiftPoint.under(problem, stage, pressure, start)

    @cached_property
    def flow(self) -> FilmPressure:
        """Flow through the gap."""
        stage, gap = self.stage, self.contact.gap.values
        return self.problem.film_pressure(gap, stage.grid, stage.epsilon)

    @property
    def sealed(self) -> bool:
        """Whether no open path leads through the gap."""
        return self.problem.film(self.contact.gap).sealed

    @cached_property
    def critical(self) -> float:
        """Gap of the critical constriction, ε at least [m]; 0 unless the fluid slips."""
        if not self.problem.slips:
            return 0.0
        constriction = self.problem.film(self.contact.gap).constriction
        return max(constriction.gap if constriction else 0.0, self.stage.epsilon)

    @cached_property
    def residual(self) -> np.ndarray:
        """F (nx, ny) [Pa]."""
        return self.problem.pressure_of(self.flow.on_samples, self.critical) - self.pressure

    @cached_property
    def size(self) -> float:
        """Root mean square of F over the pressure drop."""
        return float(np.sqrt(np.mean(self.residual**2))) / self.problem.drop

    @cached_property
    def _by_u(self) -> np.ndarray:
        return self.problem.pressure_by(self.flow.on_samples, self.critical)

    @cached_property
    def _tangent(self) -> ContactTangent:
        return self.problem.contact_tangent(self.contact)

    def _gap_change(self, pressure: np.ndarray, tolerance: float = FORCING**2) -> np.ndarray:
        """Change of the gap [m] with a change of the pressure; this operator is symmetric."""
        return self._tangent.change(pressure, tolerance)

    def _response(self, gap: np.ndarray) -> np.ndarray:
        """R' of a change of the gap."""
        return self._by_u * self.flow.change(gap, FORCING**2)

    def _response_transposed(self, weight: np.ndarray, tolerance: float) -> np.ndarray:
        """R'ᵀ of weights of the pressure."""
        return self.flow.transposed(self._by_u * weight, tolerance)

    @property
    def adjoint(self) -> np.ndarray:
        """λ (nx, ny) [1/Pa]: a flow whose pressure differs by d changes ln Q by λ·d in the end."""
        return self._adjoint.x

    @property
    def linear_systems_solved(self) -> bool:
        """Whether GMRES has reached its tolerance for the step and for λ."""
        return self.step.solved and self._adjoint.converged

    @cached_property
    def _adjoint(self) -> LinearSolution:
        """Solution λ of (I - G'ᵀ R'ᵀ) λ = ∂ln Q/∂p_f.

        Solved more exactly than Newton's step, which the next step mends. λ is large next to
        closing: what GMRES leaves of the right side, times the step, is an error of λ·F.
        """
        exact = FORCING**3
        return gmres(
            lambda weight: (
                weight - self._gap_change(self._response_transposed(weight, exact), exact)
            ),
            self._gap_change(self.flow.log_rate_by_gap, exact),
            FORCING**2,
            MOST_STEPS,
        )

    def _solved(self, right_side: np.ndarray) -> tuple[LinearSolution, np.ndarray]:
        """Solution δ of (I - R' G') δ = right side, and G' δ."""
        moved: list[np.ndarray] = []

        def applied(change: np.ndarray) -> np.ndarray:
            moved.append(self._gap_change(change))
            return change - self._response(moved[-1])

        solution = gmres(applied, right_side, FORCING, MOST_STEPS)
        gap = weighted_sum(solution.parts, moved) if moved else np.zeros_like(right_side)
        return solution, gap

    def log_rate_change(self, gap: np.ndarray) -> float:
        """Size of the change of the logarithm of the leak rate with the gap, to first order."""
        return not_by_chance(self.flow.log_rate_by_gap * gap)

    @cached_property
    def step(self) -> NewtonStep:
        """Newton's step."""
        solution, gap = self._solved(self.residual)
        return NewtonStep(
            pressure=solution.x,
            gap=gap,
            log_rate=self.log_rate_change(gap),
            iterations=solution.iterations,
            solved=solution.converged,
            negative=solution.negative,
        )

    def keeps_load(self, tolerance: float) -> bool:
        """Whether F changes the solid's load by at most a part of it.

        Asked beside ln Q, which hardly changes with the fluid's pressure where the solid is stiff.
        """
        gained = float(self.residual.mean())
        return abs(gained) <= tolerance * self.problem.solid_load(self.pressure)

    @cached_property
    def by_epsilon(self) -> float:
        """Part of the leak rate that ε adds: where it is small, p_f feels ε less than this."""
        return self.flow.beyond(np.cbrt(self.problem.cubes(self.contact.gap.values)))

    def finer(self, allowed: float) -> Stage | None:
        """The next stage: less ε, and smaller triangles where errors of the flow change ln Q most.

        None if the network would be too large.
        """
        stage = self._finer(self.stage.grid, allowed)
        return stage if len(stage.grid.free) <= MOST_NODES else None

    def _finer(self, grid: PressureGrid, allowed: float) -> Stage:
        """The next stage; `grid` has the triangles of this one's."""
        epsilon = self.stage.epsilon
        if self.by_epsilon > allowed / 2 or not self.problem.refines:
            epsilon /= 4  # as half as wide triangles lessen the error of linear elements
        if self.problem.refines:
            by_links, past_legs = self._by_parts
            also = past_legs > LEAST**2 * allowed  # many may open together
            grid = grid.refined(by_links, MARKED, self.flow.varies, also)
        return Stage(grid, epsilon)

    @cached_property
    def _by_parts(self) -> tuple[np.ndarray, np.ndarray]:
        """What parts of the network may change of ln Q in the end, see `FilmPressure.by_parts`."""
        return self.flow.by_parts(self._by_u * self.adjoint, FORCING**2)

    def is_that_of(self, other: "LiftPoint", allowed: float) -> bool:
        """Whether ln Q is another point's, but for a little and what both next steps change."""
        apart = self.log_rate_change(self.contact.gap.values - other.contact.gap.values)
        apart += abs(math.log(self.flow.conductance / other.flow.conductance))
        return apart <= allowed + self.step.log_rate + other.step.log_rate

    @cached_property
    def opened(self) -> GridFilm | None:
        """The film that the most fluid pressure opens; None if it stays sealed."""
        problem, pressure = self.problem, self.problem.highest_pressure(self.contact)
        if problem.solid_load(pressure) <= 0:
            return problem.film(problem.touching_gap)
        film = problem.film(problem.contact_under(pressure, self.contact).gap)
        return None if film.sealed else film

    def error(self, adjoint: np.ndarray) -> float:
        """Estimated error of ln Q at this point: λ·F, with the λ of the stage before."""
        return not_by_chance(adjoint * self.residual)

    def after(self, step: NewtonStep, part: float = 1.0) -> "LiftPoint | None":
        """The point a part of a step further on; None if that leaves nothing to the solid."""
        pressure = self.problem.between_ends(self.pressure + part * step.pressure)
        if self.problem.solid_load(pressure) <= 0:
            return None
        return LiftPoint.under(self.problem, self.stage, pressure, self._start(step, part))

    def _start(self, step: NewtonStep, part: float) -> ContactState | np.ndarray:
        """Contact pressure [Pa] after a part of a step, to first order; or the contact before it.

        As a start it takes two thirds of the iterations that the contact before the step takes.
        """
        if step.gap is None:
            return self.contact
        change = self.problem.solid.pressure(step.gap) * self.problem.stiffness - step.pressure
        pressure = np.where(self.contact.contact, self.contact.pressure.values + part * change, 0.0)
        return np.maximum(pressure, 0.0)


@dataclass(frozen=True, eq=False)
class FloatingPoint(LiftPoint):
    """A fluid pressure that carries the solid alone, at a level above the counter-face."""

    level: float  #: t [m]

    @classmethod
    def at(
        cls, problem: LiftProblem, stage: Stage, pressure: np.ndarray, level: float
    ) -> Self | None:
        """The point at a level; None if the solid touches the counter-face there."""
        gap = problem.displacement(pressure) - problem.height.values + level
        if gap.min() <= 0:
            return None
        return cls(problem, stage, pressure, problem.floating(gap), level)

    @cached_property
    def size(self) -> float:
        """Root mean square of F over the pressure drop, with the error of the load."""
        return float(np.hypot(super().size, self._lacking / self.problem.drop))

    @property
    def _lacking(self) -> float:
        return self.problem.solid_load(self.pressure)

    def keeps_load(self, tolerance: float) -> bool:
        """Whether the fluid carries the load."""
        return abs(self._lacking) <= LEAST * tolerance * self.problem.drop

    def error(self, adjoint: np.ndarray) -> float:
        """Estimated error of ln Q at this point."""
        return self.step.log_rate

    def _gap_change(self, pressure: np.ndarray, tolerance: float = 0.0) -> np.ndarray:
        return self.problem.displacement(pressure)

    @cached_property
    def step(self) -> NewtonStep:
        """Newton's step: that at a fixed level, and the level that restores the load."""
        fixed, by_pressure = self._solved(self.residual)
        lifted, by_level = self._solved(self._response(np.ones_like(self.pressure)))
        level = (self._lacking - float(fixed.x.mean())) / float(lifted.x.mean())
        gap = by_pressure + level * (1 + by_level)
        return NewtonStep(
            pressure=fixed.x + level * lifted.x,
            gap=gap,
            log_rate=self.log_rate_change(gap),
            iterations=max(fixed.iterations, lifted.iterations),
            solved=fixed.converged and lifted.converged,
            negative=None,
            level=level,
        )

    def after(self, step: NewtonStep, part: float = 1.0) -> Self | None:
        """The point a part of a step further on; None if the solid would touch.

        The film at most doubles: p_f hardly depends on the level of a high one, whose step may
        therefore be as long as one likes.
        """
        rise, most = part * step.level, float(self.contact.gap.values.mean())
        if rise > most:
            part *= most / rise
        pressure = self.problem.between_ends(self.pressure + part * step.pressure)
        return self.at(self.problem, self.stage, pressure, self.level + part * step.level)
