"""Bounds of the leak rate of a gas that slips, on the mesh of a refinement.

The mesh is refined for the film at the mean pressure, one linear problem. What the pressure at each
place does to the slip is enclosed on that mesh: by the pressure of the film with the largest
conductivity, and by the stream function of that with the smallest one (`film.law.bounding_law`).
"""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import present
from fem_seal.film.law import FilmLaw, bounding_law, mean_pressure_law
from fem_seal.flow.adapt import Bracket
from fem_seal.flow.gap_on_mesh import ConstantGap, LinearGap, VertexGap
from fem_seal.flow.level import LevelProblem
from fem_seal.fluid import Slip

# Gaps of a table in units of the largest one, and s in units of that of the critical constriction.
# Both choose which of many valid bounds is computed.
_GAPS = np.geomspace(1e-12, 1.0, 1200)
_FACTORS = 2.0 ** (np.arange(-40, 41) / 4)


@dataclass(frozen=True)
class SlipBounds:
    """Bounds of the conductance, in the units of the film at the mean pressure.

    Attributes
    ----------
    lower, upper : float
    """

    lower: float
    upper: float


class SlippingFilm:
    """A film with a gas that slips, whose bounds are computed on given meshes.

    Parameters
    ----------
    slip : Slip
        Slip of the gas between the two pressures.
    highest, critical : float
        Largest gap and gap of the critical constriction [m].
    """

    def __init__(self, slip: Slip, highest: float, critical: float):
        self._slip, self._highest = slip, highest
        self._mean = mean_pressure_law(slip, highest).above.of_gap(_GAPS)
        candidates = slip.pressure_at(critical) * _FACTORS
        if slip.outlet_pressure > 0:
            candidates = np.append(candidates, 0.0)
        laws = [bounding_law(slip, highest, s, s) for s in candidates]
        self._candidates = candidates
        self._more = np.array([law.above.of_gap(_GAPS) for law in laws]) / self._mean
        self._resists = self._mean / np.array([law.below.of_gap(_GAPS) for law in laws])
        self._largest_ratio = _largest_ratio(slip, highest, slip.pressure_at(critical))
        self._chosen: tuple[float, float] | None = None
        self._gap: LinearGap | ConstantGap | VertexGap | None = None
        self._best = SlipBounds(0.0, np.inf)

    @property
    def mean_law(self) -> FilmLaw:
        """The law for which the mesh is refined: that at the mean pressure."""
        return mean_pressure_law(self._slip, self._highest)

    @property
    def gain(self) -> float:
        """What the largest gap conducts at the mean pressure, over what it would without slip."""
        return 1 + self._slip.pressure_at(self._highest) / self._slip.mean_pressure

    def on_mesh_of(self, bracket: Bracket) -> SlipBounds:
        """Best bounds so far, with those on the mesh of a bracket.

        Before the true dual is solved there is an upper bound only, from that at the mean pressure.
        """
        if bracket.stream is None:
            return self._improved(0.0, bracket.level.upper * self._largest_ratio)
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
        return self._improved(lower, upper)

    def _improved(self, lower: float, upper: float) -> SlipBounds:
        self._best = SlipBounds(max(lower, self._best.lower), min(upper, self._best.upper))
        return self._best

    def _under_bounding_law(
        self, problem: LevelProblem, above: float, below: float
    ) -> LinearGap | ConstantGap | VertexGap:
        """The gap of a problem under the law of two values of s, kept for the next mesh."""
        if self._gap is None or self._chosen != (above, below):
            law = bounding_law(self._slip, self._highest, above, below)
            self._gap, self._chosen = problem.gap.with_law(law), (above, below)
        return self._gap

    def _best_choice(self, bracket: Bracket) -> tuple[float, float]:
        """Values of s [Pa] with probably the least upper and the greatest lower bound.

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


def _largest_ratio(slip: Slip, highest: float, s: float) -> float:
    """Largest ratio of the largest conductivity to that at the mean pressure, over all gaps.

    Of either form of the former the ratio is monotone in the gap, from 0 to the largest gap.
    """
    law = bounding_law(slip, highest, s, s).above
    cubic, square = mean_pressure_law(slip, highest).above.narrow
    forms = [law.narrow] if law.wide is None else [law.narrow, law.wide]
    return max(max(beta / square, (alpha + beta) / (cubic + square)) for alpha, beta in forms)
