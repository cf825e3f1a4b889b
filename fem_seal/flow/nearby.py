"""The flow through one film, as a start for films of nearly the same gap, and as a bound of them.

The pressure p of a film is admissible in any film with a smaller gap, and the stream function ψ in
any film with a larger one. So, without another solve,

    Q[g] <= ∫ K(g)|∇p|²  for g <= g_0,      Q[g] >= 1/∫ |∇ψ|²/K(g)  for g >= g_0,

on the mesh of g_0, with the same bubble functions (`hierarchical.py`). Along a straight line of
gaps the cube root of the first bound is convex, that of the second concave
(docs/theory/scales-apart.md).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput, narrowed
from fem_seal.film import GridFilm
from fem_seal.flow.cell_data import ISOTROPIC, CellData
from fem_seal.flow.energy import Energy
from fem_seal.flow.gap_on_mesh import LinearGap
from fem_seal.flow.hierarchical import Correction, Drops, energy_drops
from fem_seal.flow.level import LevelProblem, LevelSolution
from fem_seal.flow.linear import Minimum
from fem_seal.flow.solution import Start
from fem_seal.grid import GridField


@dataclass(frozen=True, eq=False)
class MeshedFlow:
    """The flow through a film on the last mesh of its refinement."""

    film: GridFilm  #: film on a grid; bounds of others ask for one that is linear between samples
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
        (psi,), (own,), other = stream.at_vertices, stream.totals, self._in_gap_of(film, 1)
        energies = own, other.energy_of_stream(psi)
        correction = self.solution.problem.stream_correction([psi])
        return other.upper_bounds(energies, correction, corrected.raised)

    def conductances_below(self, film: GridFilm) -> np.ndarray:
        """Upper bounds (2,) of conductances: of this film, and of one whose gap is nowhere larger.

        In units of the conductance of a square with the largest gap of this film.
        """
        (pressure,), corrected = self.solution.pressure.minima, self.solution.corrected
        other = self._in_gap_of(film, -1)
        energies = pressure.total, other.energy_of_pressure(pressure)
        if corrected is None:
            return np.array([energy.upper_bound() for energy in energies])
        correction = self.solution.problem.pressure_correction([pressure.corners])
        return other.upper_bounds(energies, correction, corrected.lowered)

    def _in_gap_of(self, film: GridFilm, sign: int) -> "_OtherGap":
        """The gap of another film on this mesh, nowhere smaller (sign 1) or larger (sign -1)."""
        kinds = [
            (f.representation, f.sides, f.samples.shape, f.gap.spacing) for f in (self.film, film)
        ]
        if kinds[0] != kinds[1] or film.representation != "linear":
            raise InvalidInput("bounds from the flow of another film need both linear on one grid")
        wrong = np.count_nonzero(sign * film.samples < sign * self.film.samples)
        if wrong:
            raise InvalidInput(
                f"the gap is {'smaller' if sign == 1 else 'larger'} than that of the flow at "
                f"{wrong} of {film.samples.size} samples: the flow does not bound it"
            )
        problem = self.solution.problem
        gap = narrowed(problem.gap, LinearGap, "linear gap")
        # Fill the pockets of this film in all gaps, so that the gaps stay on a straight line.
        scaled = np.where(self.film.carrying, film.samples / self.film.largest_gap, 0.0)
        other = gap.with_samples(GridField(scaled, film.gap.spacing))
        values = other.vertex_values(problem.mesh)
        data = other.cell_data(problem.mesh, values).subset(problem.kept)
        return _OtherGap(problem, other, values, data)


@dataclass(frozen=True, eq=False)
class _OtherGap:
    """Another gap on the mesh of a problem, for the energies of that problem's functions in it."""

    problem: LevelProblem
    gap: LinearGap
    values: np.ndarray  #: (V, 2), this gap at the vertices, raised and lowered
    data: CellData  #: averages of this gap on the cells that carry flow in the problem

    def energy_of_pressure(self, pressure: Minimum) -> Energy:
        """∫K|∇p|²."""
        K = np.where(pressure.numbering.constant(), 0.0, self.data.K)
        return self.problem.space.energy(lambda cells: K[cells, None] * ISOTROPIC, pressure.corners)

    def energy_of_stream(self, psi: np.ndarray) -> Energy:
        """∫ ∇ψ·R·∇ψ of the true dual, of ψ (V,) at the vertices."""
        cells_of = self.problem.cells
        return self.problem.space.energy(
            lambda cells: self.data.resistivity[cells], lambda cells: psi[cells_of[cells]]
        )

    def upper_bounds(
        self,
        energies: tuple[Energy, Energy],
        correction: Correction,
        own_drop: Drops,
    ) -> np.ndarray:
        """Upper bounds (2,) of energies of one function, in the problem's own gap and in this one.

        The same bubble functions lower both. The bounds are widened for rounding errors.
        """
        problem = self.problem
        (drop,) = energy_drops(
            self.gap, problem.mesh, self.values, [correction], problem.space.comm, own_drop
        )
        return np.array(
            [
                energy.upper_bound() - drop.energies.item() + energy.error_of_drop(*drop.terms[0])
                for energy, drop in zip(energies, (own_drop, drop), strict=True)
            ]
        )
