"""The flow through one film, as a start for films of nearly the same gap, and as a bound of them.

The pressure p of a film is admissible in any film with a smaller gap, and the stream function ψ in
any film with a larger one. So, without another solve,

    Q[g] <= ∫ K(g)|∇p|²  for g <= g_0,      Q[g] >= 1/∫ |∇ψ|²/K(g)  for g >= g_0,

on the mesh of g_0, with the same bubble functions (`hierarchical.py`). Along a straight line of
gaps the cube root of the first bound is convex, that of the second concave
(docs/theory/scales-apart.md).
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_seal.errors import InvalidInput, narrowed
from fem_seal.film import GridFilm
from fem_seal.flow.cell_data import ISOTROPIC
from fem_seal.flow.energy import Energy
from fem_seal.flow.gap_on_mesh import LinearGap
from fem_seal.flow.hierarchical import Correction, drops_of_one_function
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

    def resistances_above(self, films: Sequence[GridFilm]) -> np.ndarray:
        """Upper bounds (n,) of resistances: `films[0]` is this film, other gaps nowhere smaller.

        In units of the resistance of a square with the largest gap of this film; infinite if the
        stream function is not known.
        """
        stream = self.solution.stream
        if stream is None:
            return np.full(len(films), np.inf)
        problems = self._problems(films)
        (psi,), (own,) = stream.psi, stream.totals
        others = [_energy_of_stream(problem, psi) for problem in problems[1:]]
        correction = self.solution.problem.stream_correction([psi])
        return self._bounds(problems, [own, *others], correction)

    def conductances_below(self, films: Sequence[GridFilm]) -> np.ndarray:
        """Upper bounds (n,) of conductances: `films[0]` is this film, other gaps nowhere larger.

        In units of the conductance of a square with the largest gap of this film.
        """
        (pressure,), problems = self.solution.pressure.minima, self._problems(films)
        others = [_energy_of_pressure(problem, pressure) for problem in problems[1:]]
        correction = self.solution.problem.pressure_correction([pressure.corners])
        return self._bounds(problems, [pressure.total, *others], correction)

    def _problems(self, films: Sequence[GridFilm]) -> list[LevelProblem]:
        problem = self.solution.problem
        gap = narrowed(problem.gap, LinearGap, "linear gap")
        others = []
        for film in films[1:]:
            # Fill the pockets of this film in all gaps, so that the gaps stay on a straight line.
            scaled = np.where(self.film.carrying, film.samples / self.film.largest_gap, 0.0)
            others.append(_with_gap(problem, gap.with_samples(GridField(scaled, film.gap.spacing))))
        return [problem, *others]

    def _bounds(
        self, problems: Sequence[LevelProblem], energies: Sequence[Energy], correction: Correction
    ) -> np.ndarray:
        """Upper bounds of energies of the same function, widened for rounding errors."""
        own = problems[0]
        gaps = [(problem.gap, problem.values) for problem in problems]
        drops = drops_of_one_function(gaps, own.mesh, correction, own.space.comm)
        return np.array(
            [
                energy.least_upper() - drop.energies.item() + energy.error_of_drop(*drop.terms[0])
                for energy, drop in zip(energies, drops, strict=True)
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
