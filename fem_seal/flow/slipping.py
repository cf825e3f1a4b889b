"""Bounds of the leak rate of a gas that slips, on the mesh of a refinement.

The mesh is refined for the film at the mean pressure, one linear problem, in a unit in which the
critical constriction lets through what it does under both pressures. What the pressure at each
place does to the slip is enclosed on that mesh: by the pressure of the film with the largest
conductivity, and by the stream function of that with the smallest one (`film.law.bounding_law`).
"""

from dataclasses import replace

import numpy as np

from fem_seal.errors import present
from fem_seal.film.law import FilmLaw, bounding_law, conductivities, mean_pressure_law
from fem_seal.flow.adapt import Bracket
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap, VertexGap
from fem_seal.flow.level import LevelProblem
from fem_seal.fluid import Slip

# Gaps of a table in units of the largest one, gaps g₀ in units of the critical one, and a number of
# pressures. They choose which of many valid bounds is computed.
_GAPS = np.geomspace(1e-12, 1.0, 1200)
_FACTORS = 2.0 ** (np.arange(-40, 41) / 4)
_PRESSURES = 5


class SlipBounds(Bounds):
    """Bounds of the conductance, in the units of the film at the mean pressure."""

    def interval(self, mean: Bounds) -> tuple[float, float]:
        """Factors <= 1 and >= 1 by which they are wider than bounds at the mean pressure."""
        lower = min(self.lower / mean.lower, 1.0) if mean.lower > 0 else 1.0
        return lower, max(self.upper / mean.upper, 1.0)


class SlippingFilm:
    """A film with a gas that slips, whose bounds are computed on given meshes.

    Parameters
    ----------
    slip : Slip
        Slip of the gas between the two pressures.
    highest, critical : float
        Largest gap and gap of the critical constriction [m].

    Attributes
    ----------
    gain : float
        What the largest gap conducts in the law of the mesh, over what it would without slip.
    """

    def __init__(self, slip: Slip, highest: float, critical: float):
        self._slip, self._highest = slip, highest
        # At the critical constriction the law of the mesh is to let through what the gas does.
        most = highest * slip.mean_pressure / slip.product
        self._unit = float(slip.coefficient(most)) * slip.mean_gain(critical) / slip.gain(critical)
        self.gain = self._unit / most
        self._mean = self.mean_law.above.of_gap(_GAPS)
        candidates = critical / highest * _FACTORS
        if slip.outlet_pressure > 0:
            candidates = np.append(candidates, np.inf)
        pressures = np.linspace(*slip.pressures, _PRESSURES)[:, None]
        laws = np.array([conductivities(slip, highest, g, _GAPS, pressures) for g in candidates])
        self._candidates = candidates
        per_square = self._unit * self._mean / _GAPS**2
        self._more = laws.max(axis=1) / per_square
        self._resists = per_square / laws.min(axis=1)
        first = self._bounding_law(critical / highest, critical / highest)
        self._largest_ratio = _largest_ratio(first, self.mean_law)
        self._chosen: tuple[float, float] | None = None
        self._gap: LinearGap | ConstantGap | VertexGap | None = None
        self._best = SlipBounds()

    @property
    def mean_law(self) -> FilmLaw:
        """The law for which the mesh is refined: that at the mean pressure."""
        return mean_pressure_law(self._slip, self._highest)

    def widened(self, bracket: Bracket) -> Bracket:
        """The bracket with the best bounds so far for the gas that slips.

        Before the true dual is solved there is an upper bound only, from that at the mean pressure.
        """
        if bracket.stream is None:
            return self._improved(bracket, 0.0, bracket.level.bounds.upper * self._largest_ratio)
        problem = bracket.problem
        gap = self._under_bounding_law(problem, *self._best_choice(bracket))
        wide = LevelProblem(
            gap, problem.mesh, problem.values, problem.space.comm, problem.tolerance
        )
        guess = wide.primal_numbering.from_corners(bracket.pressure.corner_values)
        pressure = wide.pressure(guess)
        lower, upper = 0.0, pressure.total.least_upper()
        stream = wide.stream(bracket.stream.psi)
        if stream is not None:
            lower, sharper = wide.corrected(pressure, stream)
            upper = min(upper, sharper)
        return self._improved(bracket, lower, upper)

    def _bounding_law(self, above: float, below: float) -> FilmLaw:
        return bounding_law(self._slip, self._highest, above, below, self._unit)

    def _improved(self, bracket: Bracket, lower: float, upper: float) -> Bracket:
        self._best = SlipBounds(*self._best.tightened(Bounds(lower, upper)))
        return replace(bracket, slip=self._best)

    def _under_bounding_law(
        self, problem: LevelProblem, above: float, below: float
    ) -> LinearGap | ConstantGap | VertexGap:
        """The gap of a problem under the law of two values of g₀, kept for the next mesh."""
        if self._gap is None or self._chosen != (above, below):
            law = self._bounding_law(above, below)
            self._gap, self._chosen = problem.gap.with_law(law), (above, below)
        return self._gap

    def _best_choice(self, bracket: Bracket) -> tuple[float, float]:
        """Values of g₀ with probably the least upper and the greatest lower bound.

        The functions at the mean pressure have an energy under each law, which is estimated as if
        the gap of each cell were the one that conducts as much at the mean pressure.
        """
        problem = bracket.problem
        stream = present(bracket.stream, "stream function")
        primal, dual = problem.cell_energies(bracket.pressure, stream)

        def best(energy: np.ndarray, conductivity: np.ndarray, ratios: np.ndarray) -> float:
            place = np.searchsorted(self._mean, conductivity).clip(max=len(_GAPS) - 1)
            held = np.bincount(place, energy, len(_GAPS))
            return float(self._candidates[np.argmin(ratios @ held)])

        xx, _, yy = problem.data.resistivity.T
        conducts = 2 / np.where(problem.data.blocked, np.inf, xx + yy)
        choice = best(primal, problem.data.K, self._more), best(dual, conducts, self._resists)
        return problem.space.comm.bcast(choice)


def _largest_ratio(law: FilmLaw, mean: FilmLaw) -> float:
    """Largest ratio of the largest conductivity to that at the mean pressure, over all gaps.

    Between the kinks of either the ratio is monotone in the gap.
    """
    gaps = np.union1d(law.above.gaps, mean.above.gaps)
    return float(np.max(law.above.per_square(gaps) / mean.above.per_square(gaps)))
