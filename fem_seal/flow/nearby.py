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
from fem_seal.flow.level import LevelSolution
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
        problem, stream = self.solution.problem, self.solution.stream
        if stream is None or self.solution.corrected is None:
            return np.full(2, np.inf)
        (psi,), (own,) = stream.at_vertices, stream.totals
        gap, values, data = self._gap_of(film, 1)
        energy = problem.space.energy(
            lambda cells: data.resistivity[cells], lambda cells: psi[problem.cells[cells]]
        )
        correction, drop = problem.stream_correction([psi]), self.solution.corrected.of_streams
        return self._upper_bounds((own, energy), correction, drop, gap, values)

    def conductances_below(self, film: GridFilm) -> np.ndarray:
        """Upper bounds (2,) of conductances: of this film, and of one whose gap is nowhere larger.

        In units of the conductance of a square with the largest gap of this film.
        """
        problem, (pressure,) = self.solution.problem, self.solution.pressure.minima
        gap, values, data = self._gap_of(film, -1)
        K = np.where(pressure.numbering.constant(), 0.0, data.K)
        energy = problem.space.energy(lambda cells: K[cells, None] * ISOTROPIC, pressure.corners)
        energies, corrected = (pressure.total, energy), self.solution.corrected
        if corrected is None:
            return np.array([energy.upper_bound() for energy in energies])
        correction = problem.pressure_correction([pressure.corners])
        return self._upper_bounds(energies, correction, corrected.of_pressures, gap, values)

    def _gap_of(self, film: GridFilm, sign: int) -> tuple[LinearGap, np.ndarray, CellData]:
        """Another film on this mesh, its gap nowhere smaller (sign 1) or larger (sign -1).

        Returns its gap, the gap (V, 2) at the vertices, and the averages on the cells that carry
        the flow of this film.
        """
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
        own = narrowed(problem.gap, LinearGap, "linear gap")
        # Fill the pockets of this film in all gaps, so that the gaps stay on a straight line.
        scaled = np.where(self.film.carrying, film.samples / self.film.largest_gap, 0.0)
        gap = own.with_samples(GridField(scaled, film.gap.spacing))
        values = gap.vertex_values(problem.mesh)
        return gap, values, gap.cell_data(problem.mesh, values).subset(problem.kept)

    def _upper_bounds(
        self,
        energies: tuple[Energy, Energy],
        correction: Correction,
        own_drop: Drops,
        gap: LinearGap,
        values: np.ndarray,
    ) -> np.ndarray:
        """Upper bounds (2,) of energies of one function, in the gap of this film and in another.

        The same bubble functions lower both. The bounds are widened for rounding errors.
        """
        problem = self.solution.problem
        comm = problem.space.comm
        bubbles = own_drop.sides, own_drop.coefficients
        (drop,) = energy_drops(gap, problem.mesh, values, [correction], comm, *bubbles)
        return np.array(
            [
                energy.upper_bound() - drop.energies.item() + energy.error_of_drop(*drop.terms[0])
                for energy, drop in zip(energies, (own_drop, drop), strict=True)
            ]
        )
