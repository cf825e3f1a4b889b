"""K(w): what a patch of rough contact conducts at the net load w = P - p that its solid carries."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_seal.errors import InvalidInput

# Steps of the interpolated conductivity between two loads of a table.
STEPS = 16


@dataclass(frozen=True, eq=False)
class ConductivitySteps:
    """A conductivity that falls with the load in steps.

    Parameters
    ----------
    loads : (n,) float
        Net loads [Pa], ascending, at which the conductivity falls.
    conductivity : (n + 1,) float
        K [m³/(Pa s)] below the first load, between the loads, and above the last load. It does
        not increase; infinite where the film may be open, zero where it may be sealed.
    """

    loads: np.ndarray
    conductivity: np.ndarray

    def __call__(self, load: np.ndarray) -> np.ndarray:
        """K [m³/(Pa s)] at net loads [Pa]; infinite where the net load is not positive."""
        K = self.conductivity[np.searchsorted(self.loads, load, side="left")]
        return np.where(np.asarray(load) > 0, K, np.inf)


@dataclass(frozen=True, eq=False)
class ConductivityTable:
    """Bounds of the effective conductivity of a patch at a list of net loads.

    K falls with the load. Where the bounds of a higher load exceed those of a lower one (the
    contact's grid can do that), the bounds are widened until they fall: the upper bound to the
    largest one at this load and above, the lower bound to the smallest one at this load and below.

    Parameters
    ----------
    loads : (n,) float
        Net loads w = P - p [Pa], >= 0, ascending.
    lower, upper : (n,) float
        Bounds of K [m³/(Pa s)], 0 <= lower <= upper; both 0 where the patch is sealed.

    Raises
    ------
    InvalidInput
        If the lists differ in length, a number is not finite or negative, loads do not ascend, or
        bounds cross.
    """

    loads: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def __post_init__(self) -> None:
        loads, lower, upper = (
            np.array(values, dtype=float) for values in (self.loads, self.lower, self.upper)
        )
        if not (loads.ndim == 1 and loads.size and loads.shape == lower.shape == upper.shape):
            raise InvalidInput(
                "a conductivity table needs as many lower and upper bounds as loads, at least one; "
                f"got {loads.size} loads, {lower.size} lower and {upper.size} upper bounds"
            )
        if not np.isfinite([loads, lower, upper]).all() or min(loads.min(), lower.min()) < 0:
            raise InvalidInput("loads and conductivities must be finite numbers, not negative")
        if (np.diff(loads) <= 0).any():
            raise InvalidInput("the loads of a conductivity table must ascend")
        if (lower > upper).any():
            at = loads[np.argmax(lower > upper)]
            raise InvalidInput(f"the bounds of the conductivity cross at a load of {at:g} Pa")
        object.__setattr__(self, "loads", loads)
        object.__setattr__(self, "lower", np.minimum.accumulate(lower))
        object.__setattr__(self, "upper", np.maximum.accumulate(upper[::-1])[::-1])

    @classmethod
    def exact(cls, loads: Sequence[float], conductivity: Sequence[float]) -> "ConductivityTable":
        """Table of a conductivity that is known exactly at its loads."""
        return cls(np.asarray(loads), np.asarray(conductivity), np.asarray(conductivity))

    @property
    def sealing_load(self) -> float:
        """Smallest load [Pa] of the table that seals the patch; infinite if none does."""
        sealed = self.upper == 0
        return float(self.loads[np.argmax(sealed)]) if sealed.any() else np.inf

    @cached_property
    def highest(self) -> ConductivitySteps:
        """Upper bound of K: between two loads the upper bound of the lower load."""
        return ConductivitySteps(self.loads, np.concatenate([[np.inf], self.upper]))

    @cached_property
    def lowest(self) -> ConductivitySteps:
        """Lower bound of K: between two loads the lower bound of the higher load, above all 0."""
        return ConductivitySteps(self.loads, np.concatenate([self.lower, [0.0]]))

    @property
    def value(self) -> np.ndarray:
        """Estimate of K at the loads: √(lower upper), or the upper bound if the lower one is 0."""
        middle = np.sqrt(self.lower) * np.sqrt(self.upper)
        return np.minimum.accumulate(np.where(self.lower > 0, middle, self.upper))

    @cached_property
    def interpolated(self) -> ConductivitySteps:
        """Estimate of K between the bounds, in fine steps: ln K is linear between the loads.

        Towards a sealed load K itself is linear. Below the first load ln K is extrapolated with
        the slope of the first interval; above the last load K keeps its last value.
        """
        loads, K = self.loads, self.value
        slope = 0.0
        if loads.size > 1 and K[1] > 0:
            slope = np.log(K[0] / K[1]) / (loads[1] - loads[0])
        # Extrapolate over many e-folds of K at most: beyond them only the size matters, not K.
        rise = min(slope * loads[0], 50.0)
        nodes, values = np.append(0.0, loads), np.append(K[0] * np.exp(rise), K)
        if loads[0] == 0:
            nodes, values = nodes[1:], values[1:]
        share = (np.arange(STEPS) + 0.5) / STEPS
        edges, steps = [nodes[:1]], [values[:1]]
        for a, b, Ka, Kb in zip(nodes, nodes[1:], values, values[1:], strict=False):
            edges.append(a + (b - a) * (np.arange(STEPS) + 1) / STEPS)
            steps.append(Ka ** (1 - share) * Kb**share if Kb > 0 else Ka * (1 - share))
        return ConductivitySteps(np.concatenate(edges), np.concatenate([*steps, values[-1:]]))
