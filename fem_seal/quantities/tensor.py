"""The effective conductivity tensor of the periodic cell, as numbers for a result."""

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.leak_rate import Bounded

if TYPE_CHECKING:
    from fem_seal.flow.bounds import TensorBounds

ROUNDING = 1e-14  # of |xy|/√(xx yy), which is 1 for a single channel


@dataclass(frozen=True)
class ConductivityTensor:
    """Symmetric K* with mean flux -K*·(mean pressure gradient); h³/(12 η) of a smooth channel."""

    xx: Bounded  #: [m³/(Pa s)]; x is the direction of the scene's flow
    xy: Bounded
    yy: Bounded
    easiest: float  #: largest principal value of the estimate [m³/(Pa s)]
    hardest: float  #: smallest one
    angle: float  #: angle from x to the easiest direction in degrees, above -90 and at most 90
    unknowns: int  #: unknowns of the last mesh for one direction
    converged: bool  #: whether flow.rtol was reached in every direction
    reason: str  #: the limit that ended the refinement, "" if converged

    @classmethod
    def of(cls, bounds: "TensorBounds") -> "ConductivityTensor":
        """Take the components out of the two bounding matrices."""
        value = bounds.value

        def component(i: int, j: int) -> Bounded:
            # Next to 0 the component of the mean is rounding, and so are its bounds.
            interval = bounds.interval(i, j)
            return Bounded(float(np.clip(value[i, j], *interval)), *interval)

        (hardest, easiest), directions = np.linalg.eigh(value)
        if abs(value[0, 1]) >= (1 - ROUNDING) * np.sqrt(value.diagonal()).prod():
            hardest = 0.0  # of a single channel
        x, y = directions[:, 1]
        angle = float(np.degrees(np.arctan2(y, x)))
        return cls(
            xx=component(0, 0),
            xy=component(0, 1),
            yy=component(1, 1),
            easiest=float(easiest),
            hardest=float(hardest),
            angle=angle - 180 * ceil((angle - 90) / 180),
            unknowns=bounds.unknowns,
            converged=bounds.converged,
            reason=bounds.reason,
        )
