"""The flow through one film, as a start for films of nearly the same gap, and as a bound of them.

The pressure p of a film is admissible in any film with a smaller gap, and the stream function ψ in
any film with a larger one. So, without another solve,

    Q[g] <= ∫ K(g)|∇p|²  for g <= g_0,      Q[g] >= 1/∫ |∇ψ|²/K(g)  for g >= g_0,

on the mesh of g_0, with the same bubble functions (`hierarchical.py`). Along a straight line of
gaps the cube root of the first bound is convex, that of the second concave
(docs/theory/scales-apart.md).
"""

from copy import copy
from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_seal.errors import InvalidInput, narrowed
from fem_seal.film import GridFilm
from fem_seal.flow.cell_data import ISOTROPIC
from fem_seal.flow.energy import Energy
from fem_seal.flow.gap_on_mesh import LinearGap
from fem_seal.flow.hierarchical import AppliedBubbles, Correction, Drops, energy_drops
from fem_seal.flow.level import LevelProblem, LevelSolution
from fem_seal.flow.linear import Minimum
from fem_seal.flow.solution import Start
from fem_seal.grid import GridField
from fem_seal.mesh.nested import NestedMesh


@dataclass(frozen=True, eq=False)
class MeshedFlow:
    """The flow through a film on the last mesh of its refinement."""

    film: GridFilm  #: film on a grid, linear between samples
    solution: LevelSolution  #: solution on the last mesh
    #: conductivity of the film's largest gap, over its conductivity without slip
    slip_factor: float = 1.0

    @property
    def start(self) -> Start:
        """Start for films on the same grid: this mesh, the pressure and the stream function."""
        return self.solution.problem.start(self.solution.pressure, self.solution.stream)

    def resistances_above(self, film: GridFilm) -> np.ndarray:
        """Upper bounds (2,) of resistances: of this film, and of one whose gap is nowhere smaller.

        In units of the resistance of a square with the largest gap of this film; infinite if the
        stream function is not known.
        """
        stream, corrected = self.solution.stream, self.solution.corrected
        if stream is None or corrected is None:
            return np.full(2, np.inf)
        problem, (psi,), (own,) = self._problem(film), stream.at_vertices, stream.totals
        correction = problem.stream_correction([psi])
        other = _energy_of_stream(problem, psi)
        return _bounds(problem, (own, other), correction, corrected.raised, corrected.bubbles.of(0))

    def conductances_below(self, film: GridFilm) -> np.ndarray:
        """Upper bounds (2,) of conductances: of this film, and of one whose gap is nowhere larger.

        In units of the conductance of a square with the largest gap of this film.
        """
        (pressure,), corrected = self.solution.pressure.minima, self.solution.corrected
        problem, own = self._problem(film), pressure.total
        other = _energy_of_pressure(problem, pressure)
        if corrected is None:
            return np.array([own.least_upper(), other.least_upper()])
        correction = problem.pressure_correction([pressure.corners])
        return _bounds(
            problem, (own, other), correction, corrected.lowered, corrected.bubbles.of(1)
        )

    def _problem(self, film: GridFilm) -> LevelProblem:
        """The problem of this mesh with the gap of another film."""
        gap = narrowed(self.solution.problem.gap, LinearGap, "linear gap")
        # Fill the pockets of this film in all gaps, so that the gaps stay on a straight line.
        scaled = np.where(self.film.carrying, film.samples / self.film.largest_gap, 0.0)
        other = gap.with_samples(GridField(scaled, film.gap.spacing))
        return _with_gap(self.solution.problem, other)


def _bounds(
    other: LevelProblem,
    energies: tuple[Energy, Energy],
    correction: Correction,
    own_drop: Drops,
    bubbles: AppliedBubbles,
) -> np.ndarray:
    """Upper bounds (2,) of energies of one function, in its own gap and in another one.

    The same bubble functions lower both. The bounds are widened for rounding errors.
    """
    (drop,), _ = energy_drops(
        other.gap, other.mesh, other.values, [correction], other.space.comm, bubbles
    )
    return np.array(
        [
            energy.least_upper() - drop.energies.item() + energy.error_of_drop(*drop.terms[0])
            for energy, drop in zip(energies, (own_drop, drop), strict=True)
        ]
    )


def _with_gap(problem: LevelProblem, gap: LinearGap) -> LevelProblem:
    """The same problem with another gap, for the energies of its functions in that gap."""
    if not isinstance(problem.mesh, NestedMesh):
        raise InvalidInput(
            "bounds of other films need the flow through a film on a grid, got one on a "
            f"{type(problem.mesh).__name__}: pass a GridFilm to leak_rate"
        )
    other = copy(problem)
    other.gap, other.values = gap, gap.values_at(problem.mesh)
    other.data = gap.cell_data(problem.mesh, other.values).subset(problem.kept)
    return other


def _energy_of_pressure(problem: LevelProblem, pressure: Minimum) -> Energy:
    """∫K|∇p|² of a pressure on the mesh of a problem."""
    K = np.where(pressure.numbering.constant(), 0.0, problem.data.K)
    return problem.space.energy(lambda cells: K[cells, None] * ISOTROPIC, pressure.corners)


def _energy_of_stream(problem: LevelProblem, psi: np.ndarray) -> Energy:
    """∫ ∇ψ·R·∇ψ of the true dual, of ψ (V,) at the vertices of the mesh of a problem."""
    return problem.space.energy(
        partial(problem.resistivity, 0.0), lambda cells: psi[problem.cells[cells]]
    )
