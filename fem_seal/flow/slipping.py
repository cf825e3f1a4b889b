"""Bounds of the leak rate of a gas that slips, on the mesh of a refinement.

Slip depends on the local pressure, so that the flow of a gas is a nonlinear problem. The mesh is
refined for a linear one, with the slip at the mean pressure. Its unit makes the conductance of the
critical constriction exact. Two more linear problems on that mesh enclose the effect of the local
pressure: the pressure in a film of the largest conductivities gives the upper bound, the stream
function in a film of the smallest ones the lower bound (`film.slip_bounds.bounding_law`).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from fem_seal.errors import present
from fem_seal.film import Film
from fem_seal.film.law import FilmLaw, mean_pressure_law
from fem_seal.film.slip_bounds import PressureWeight, bounding_law
from fem_seal.flow.bounds import Bounds
from fem_seal.flow.energy import gradients
from fem_seal.flow.families import Pressures, Streams
from fem_seal.flow.gap_on_mesh import GapOnMesh
from fem_seal.flow.level import LevelProblem, LevelSolution
from fem_seal.fluid import Slip

# Parameters of the choice of a weight. Every choice gives valid bounds; these give narrow ones.
_GAPS = np.geomspace(1e-12, 1.0, 1200)  # gaps of the table, in units of the largest gap
_FACTORS = 2.0 ** (np.arange(-40, 41) / 4)  # candidates for g₀, in units of the critical gap
_BIN = 8  # neighbouring gaps of the table that count as one in an estimate
_PRESSURES = 24  # number of pressures from outlet to inlet
_LEAST_PRESSURE = 1e-3  # lowest of these above a vacuum at the outlet, over that at the inlet
_SHARPNESS = (30.0, 100.0, 300.0, 1000.0)  # of smooth maxima, minimised one after the other
_WORTHWHILE = 1e-3  # smallest relative gain of a bound for which the weight is changed
_GAIN = 1e-6  # relative gain of a step of the search below which it ends


class SlippingFilm:
    """A film with a gas that slips, whose bounds are computed on given meshes.

    `slip_factor` is the conductivity of the largest gap in the law of the mesh, over that without
    slip.
    """

    def __init__(self, slip: Slip, film: Film):
        largest_gap, critical = film.largest_gap, present(film.constriction, "constriction").gap
        self._slip, self._largest_gap = slip, largest_gap
        # The unit makes the conductance of the critical constriction exact in the law of the mesh.
        self.slip_factor = slip.gain(largest_gap) * slip.mean_gain(critical) / slip.gain(critical)
        self._unit = self.slip_factor * largest_gap * slip.mean_pressure / slip.product
        self._mean = self.mean_law.upper.of_gap(_GAPS)
        candidates = critical / largest_gap * _FACTORS
        if slip.outlet_pressure > 0:
            candidates = np.append(candidates, np.inf)
        self._candidates = [PressureWeight.of_gap(slip, largest_gap, g_0) for g_0 in candidates]
        p_out, p_in = slip.outlet_pressure, slip.inlet_pressure
        above_vacuum = np.geomspace(max(p_out, _LEAST_PRESSURE * p_in), p_in, _PRESSURES)
        self._pressures = np.union1d(p_out, above_vacuum)
        per_pascal = _GAPS[:, None] * (largest_gap / slip.product)
        self._ratio = np.log(slip.coefficient(per_pascal * self._pressures))
        self._ratio -= np.log(self._unit * self._mean / _GAPS**2)[:, None]
        at_constriction = PressureWeight.of_gap(slip, largest_gap, critical / largest_gap)
        first = self._bounding_law(at_constriction, at_constriction)
        self._largest_ratio = _largest_ratio(first, self.mean_law)
        self._chosen: tuple[PressureWeight, PressureWeight] | None = None
        self._gap: GapOnMesh | None = None
        self._best: Bounds | None = None

    @property
    def mean_law(self) -> FilmLaw:
        """The law for which the mesh is refined: that at the mean pressure."""
        return mean_pressure_law(self._slip, self._largest_gap)

    def widened(self, solution: LevelSolution) -> LevelSolution:
        """The solution with the best bounds so far for the gas that slips.

        Before the true dual is solved there is an upper bound only, from that at the mean pressure.
        """
        if solution.stream is None:
            upper = solution.level.bounds.upper * self._largest_ratio
            return self._improved(solution, Bounds(np.zeros((1, 1)), upper))
        problem = solution.problem
        gap = self._under_bounding_law(solution)
        wide = LevelProblem(
            gap, problem.mesh, problem.values, problem.space.comm, problem.tolerance
        )
        guesses = wide.guesses(problem.start(solution.pressure, solution.stream))
        pressure, stream = wide.pressure(guesses), wide.stream(solution.stream.psi)
        bounds = wide.upper_bound(pressure)
        if stream is not None:
            bounds = wide.corrected(pressure, stream).tightened(bounds)
        return self._improved(solution, bounds)

    def _bounding_law(self, upper: PressureWeight, lower: PressureWeight) -> FilmLaw:
        return bounding_law(self._slip, self._largest_gap, upper, lower, self._unit)

    def _improved(self, solution: LevelSolution, bounds: Bounds) -> LevelSolution:
        self._best = bounds if self._best is None else bounds.tightened(self._best)
        return replace(solution, slip=self._best)

    def _under_bounding_law(self, solution: LevelSolution) -> GapOnMesh:
        """The gap under the law of two weights, kept for the next mesh unless others gain there."""
        # All choose from the same numbers: where rounding differs, the choice of the first counts.
        chosen = solution.problem.space.comm.bcast(self._choice(solution))
        if self._gap is None or chosen is not None:
            self._chosen = present(chosen, "weights")
            self._gap = solution.problem.gap.with_law(self._bounding_law(*self._chosen))
        return self._gap

    def _choice(self, solution: LevelSolution) -> tuple[PressureWeight, PressureWeight] | None:
        """Weights with probably the least upper and the greatest lower bound; None: the last ones.

        The energies of the solution at the mean pressure are estimated under each law. For this the
        gap of each cell counts as the uniform gap that conducts as much at the mean pressure.
        """
        problem = solution.problem
        stream = present(solution.stream, "stream function")
        primal, dual = _cell_energies(problem, solution.pressure, stream)
        xx, _, yy = problem.data.resistivity.T
        conducts = 2 / np.where(problem.data.blocked, np.inf, xx + yy)
        upper = self._estimate(primal, problem.data.K, 1)
        lower = self._estimate(dual, conducts, -1)
        weights = self._best_weight(upper), self._best_weight(lower)
        if self._chosen is not None:
            pairs = zip((upper, lower), weights, self._chosen, strict=True)
            if all(self._least(e, last) < self._least(e, w) + _WORTHWHILE for e, w, last in pairs):
                return None
        return weights

    def _estimate(self, energy: np.ndarray, conductivity: np.ndarray, sign: int) -> "_Estimate":
        """Estimate of a bound from the energies (C,) of cells and their conductivities (C,)."""
        place = np.searchsorted(self._mean, conductivity).clip(max=len(_GAPS) - 1)
        held = np.bincount(place, energy, len(_GAPS))
        ratio = (held[:, None] * self._ratio).reshape(-1, _BIN, len(self._pressures)).sum(axis=1)
        of_bin = held.reshape(-1, _BIN).sum(axis=1)
        used = of_bin > 0
        ratio = ratio[used] / of_bin[used, None]
        return _Estimate(self._pressures, ratio, of_bin[used], sign)

    def _least(self, estimate: "_Estimate", weight: PressureWeight) -> float:
        return estimate.exact(np.log(weight(self._pressures)))

    def _best_weight(self, estimate: "_Estimate") -> PressureWeight:
        """The best candidate, or a computed weight if its bound is narrower by `_WORTHWHILE`."""
        best = min(self._candidates, key=lambda weight: self._least(estimate, weight))
        start = np.log(best(self._pressures))
        end = estimate.minimised(start)
        if estimate.exact(end) > estimate.exact(start) - _WORTHWHILE:
            return best
        return best.times(self._pressures, end - start)


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Logarithm of a bound's energy, as a function of ln w at given pressures.

    It is ln Σ E exp(max ±(ln κ₀ - ln w)) ± ln mean(w), the maximum over the pressures, + for the
    upper and - for the lower bound: the smaller, the better.
    """

    pressures: np.ndarray  #: (m,) [Pa]
    #: (n, m), ln κ₀: conductivity of n gaps at the pressures, over that in the law of the mesh
    ratio: np.ndarray
    energy: np.ndarray  #: (n,), E, energy in the law of the mesh of the cells with about these gaps
    sign: int

    def exact(self, logarithm: np.ndarray) -> float:
        """The estimate for ln w (m,)."""
        return self._smooth(logarithm, np.inf)[0]

    def minimised(self, start: np.ndarray) -> np.ndarray:
        """The ln w of a minimum, from a start; sharper and sharper smooth maxima in turn."""
        end = start
        for sharpness in _SHARPNESS:
            # Any w bounds the flow: a search that ends early leaves the bound a little wider.
            search = minimize(self._smooth, end, (sharpness,), "L-BFGS-B", jac=True, tol=_GAIN)
            end = search.x
        return end

    def _smooth(self, logarithm: np.ndarray, sharpness: float) -> tuple[float, np.ndarray]:
        """The estimate with a smooth maximum, and its gradient."""
        rises = self.sign * (self.ratio - logarithm)
        most = rises.max(axis=1, keepdims=True)
        share = np.zeros_like(rises)
        if np.isfinite(sharpness):
            share = np.exp(sharpness * (rises - most))
            total = share.sum(axis=1, keepdims=True)
            share /= total
            most = most + np.log(total) / sharpness
        widths = np.diff(self.pressures)
        widths = np.append(widths, 0.0) + np.append(0.0, widths)
        weights = widths * np.exp(logarithm - logarithm.max())
        mean = np.log(weights.sum() / widths.sum()) + logarithm.max()
        energies = self.energy * np.exp(most[:, 0] - most.max())
        value = np.log(energies.sum()) + most.max() + self.sign * mean
        gradient = weights / weights.sum() - energies @ share / energies.sum()
        return float(value), self.sign * gradient


def _cell_energies(
    problem: LevelProblem, pressure: Pressures, stream: Streams
) -> tuple[np.ndarray, np.ndarray]:
    """Energy of each cell (C,): its part of ∫K|∇p|², and of ∫∇ψ·R·∇ψ of the true dual."""
    (psi,) = stream.psi
    primal, dual = np.empty((2, problem.space.count))
    for cells, slopes, areas in problem.batches():
        px, py = gradients(slopes, pressure.minima[0].corners(cells)).T
        primal[cells] = areas * problem.data.K[cells] * (px * px + py * py)
        sx, sy = gradients(slopes, psi[problem.cells[cells]]).T
        xx, xy, yy = problem.resistivity(0.0, cells).T
        dual[cells] = areas * (xx * sx * sx + 2 * xy * sx * sy + yy * sy * sy)
    return primal, dual


def _largest_ratio(law: FilmLaw, mean: FilmLaw) -> float:
    """Largest ratio of the largest conductivity to that at the mean pressure, over all gaps.

    Between the kinks of both laws the ratio is monotone in the gap, so the kinks suffice.
    """
    gaps = np.union1d(law.upper.gaps, mean.upper.gaps)
    return float(np.max(law.upper.per_square(gaps) / mean.upper.per_square(gaps)))
