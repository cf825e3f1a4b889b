"""The leak rate at which the fluid's pressure meets those of both ends of the leak path.

With a K that is a step function of the net load, and one total pressure in each cell, the march
solves dΦ/ds = -Q/K exactly from the outlet to the inlet (`seal_flow`): in each cell ∫K dΦ rises by
Q Δs, and the cumulative sum of that integral over the steps of K gives the net load where it has
done so. If Q is too large, the pressure reaches p_in before the inlet; if it is too small, the
pressure at the inlet is below p_in.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from functools import partial
from math import exp, inf, log, sqrt

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.upscaling.conductivity import ConductivitySteps
from fem_seal.upscaling.leak_path import EndPressures

# Relative error of the leak rate that solves the boundary condition; bounds are widened by it.
SHOOTING = 1e-9
PRESSURE_ROUNDING = 1e-12  # relative rounding error of a pressure
# Length of a step in ln Q by which an end of the searched range is moved, and most such steps.
WIDENING, MOST_WIDENINGS = 5.0, 100
# Halving the bracket takes 40 iterations; Brent's method takes at most the square of that.
MOST_ITERATIONS = 1600
RELATIVE = 4 * np.finfo(float).eps  # smallest relative tolerance that SciPy accepts


def path_leak_rate(
    steps: ConductivitySteps,
    pressure: np.ndarray,
    lengths: np.ndarray,
    ends: EndPressures,
) -> float:
    """Leak rate [m³/s] at which the fluid has the inlet's pressure at the inlet.

    Each of n cells has a total pressure P [Pa] and a length Δs.
    """
    net = pressure.max() - ends.inlet
    if net <= 0:
        return inf
    # The place of the highest load decides: K is 0 there if the seal is sealed, infinite if open.
    K = float(steps(np.nextafter(net, inf)))
    if K in (0.0, inf):
        return K
    march = March(steps, pressure, lengths, ends)
    finite = steps.conductivity[np.isfinite(steps.conductivity) & (steps.conductivity > 0)]
    scale = ends.drop / lengths.sum()
    low, high = log(finite.min() * scale) - 1, log(finite.max() * scale) + 1
    return exp(bracketed_root(lambda log_rate: march.excess(exp(log_rate)), low, high))


def bracketed_root(excess: Callable[[float], float], low: float, high: float) -> float:
    """Root of an excess that grows with ln Q, from two guesses of its bracket.

    Brent's method also ends at a jump, where it halves the bracket. A root at an end of the bracket
    is returned as it is.
    """
    from scipy.optimize import brentq

    low, high = _widened(excess, low, -WIDENING), _widened(excess, high, WIDENING)
    return float(brentq(excess, low, high, xtol=SHOOTING, rtol=RELATIVE, maxiter=MOST_ITERATIONS))


def _widened(excess: Callable[[float], float], log_rate: float, step: float) -> float:
    """Move ln Q in steps until the excess is 0 or has the sign of the step."""
    for _ in range(MOST_WIDENINGS):
        reached = excess(log_rate)
        if reached * step >= 0:
            return log_rate
        log_rate += step
    raise NotConverged(
        f"no leak rate gives the fluid the inlet's pressure at the inlet: at ln Q = "
        f"{log_rate - step:.6g} (Q in m^3/s) it still differs by {abs(reached):.3g} of the "
        "pressure drop; check the pressures and the total pressures along the leak path"
    )


class March:
    """Integration of dΦ/ds = -Q/K from the outlet to the inlet, cell by cell.

    Each of n cells has a pressure P [Pa] and a length Δs; the first cell is at the inlet.
    """

    def __init__(
        self,
        steps: ConductivitySteps,
        pressure: np.ndarray,
        lengths: np.ndarray,
        ends: EndPressures,
    ):
        loads = np.append(steps.loads, max(steps.loads[-1], pressure.max() - ends.outlet))
        K = steps.conductivity[1:]
        if np.isfinite(steps.conductivity[0]):
            loads, K = np.append(0.0, loads), steps.conductivity
        # From the highest load down: negative loads, K between them, ∫K dw and ∫K w dw to each.
        loads, K = loads[::-1], K[::-1]
        self._loads, self._K = (-loads).tolist(), K.tolist()
        self._areas = np.append(0.0, np.cumsum(-K * np.diff(loads))).tolist()
        self._moments = np.append(0.0, np.cumsum(-K * np.diff(loads**2) / 2)).tolist()
        self._cells = list(zip(pressure[::-1].tolist(), lengths[::-1].tolist(), strict=True))
        self._ends, self._length = ends, float(lengths.sum())
        closed = np.flatnonzero(pressure > ends.inlet)
        # Δs of the cells at the inlet whose film is open.
        self._open = float(lengths[: closed[0]].sum()) if closed.size else self._length

    def excess(self, rate: float) -> float:
        """Measure, without unit, of how much a leak rate Q [m³/s] is too large; < 0 if too small.

        If Q is too small, the pressure at the inlet is below p_in: the excess is the difference
        over the pressure drop. If Q is too large, the pressure reaches p_in before the inlet: the
        excess is the part of ∫ ds that remains. It is nearly linear in ln Q on either side of the
        leak rate.
        """
        # If the first load of the table is P - p_in, p stops at p_in for all larger Q, and the leak
        # rate is the smallest root. Rounding of P - (P - p_in) must not hide it: aim a little below
        # p_in.
        drop = self._ends.inlet - self._ends.outlet
        target = self._ends.inlet - PRESSURE_ROUNDING * drop
        p, remaining = self._marched(rate, target, [])
        if p < target:
            return (p - target) / drop
        return (remaining - self._open) / self._length

    def pressures(self, rate: float) -> np.ndarray:
        """Fluid pressure [Pa] at the ends of the cells, the inlet first."""
        visited = [self._ends.outlet]
        self._marched(rate, inf, visited)
        return np.array(visited[::-1])

    def _marched(self, rate: float, target: float, visited: list[float]) -> tuple[float, float]:
        """Last pressure [Pa], and ∫ ds from there to the inlet.

        The march ends where p reaches the target [Pa]. The pressure at the inlet's side of each
        cell is appended to `visited`.
        """
        p, remaining = self._ends.outlet, self._length
        for P, length in self._cells:
            flux = rate * length
            p_end = self._after_cell(P, p, flux)
            if p_end >= target:
                to_target = self._integral_at(P, target) - self._integral_at(P, p)
                return target, remaining - length * to_target / flux
            p = p_end
            visited.append(p)
            remaining -= length
        return p, remaining

    def _after_cell(self, P: float, p: float, flux: float) -> float:
        """Pressure [Pa] at the inlet's side of a cell with p at its other side.

        Over the cell ∫K dΦ rises by the flux Q Δs; where the film is open, p does not rise.
        """
        loads, K, potential = self._loads, self._K, self._ends.potential
        # Step k of K lies between loads k and k + 1; the film is open beyond the last load.
        k = max(bisect_right(loads, p - P) - 1, 0)
        # By the rest of the flux ∫K dΦ rises from p_k on, in step k.
        p_k, rest = p, flux
        if k < len(K) and K[k] * (potential(P + loads[k + 1]) - potential(p)) < flux:
            integral, end = partial(self._integral, P), self._integral_at(P, p) + flux
            k = bisect_left(range(len(loads)), end, k + 1, key=integral) - 1
            p_k, rest = P + loads[k], end - integral(k)
        if k == len(K):
            return p_k
        reached, per_square = potential(p_k) + rest / K[k], self._ends.per_square
        return sqrt(reached / per_square) - self._ends.offset if per_square else reached

    def _integral(self, P: float, step: int) -> float:
        """∫K dΦ at a total pressure P [Pa] from the highest load down to a step."""
        if not self._ends.per_square:
            return self._areas[step]
        moved = (P + self._ends.offset) * self._areas[step] - self._moments[step]
        return 2 * self._ends.per_square * moved

    def _integral_at(self, P: float, p: float) -> float:
        """The same down to the load P - p [Pa]."""
        step = min(max(bisect_right(self._loads, p - P) - 1, 0), len(self._K) - 1)
        potential = self._ends.potential
        risen = potential(p) - potential(P + self._loads[step])
        return self._integral(P, step) + self._K[step] * risen
