"""A start for the next of many loads of one surface, extrapolated from the states before."""

import numpy as np

from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState

# Largest extrapolation, in steps between the last two loads. A longer one makes no better start.
FURTHEST = 2.0
# Pressure that an open sample lacks for contact, in units of E* × gap / spacing; about half the
# stiffness of one sample. With 0.5 or 1.5 times this value paths take longer; paths over wide
# ranges of load, by a tenth.
LACKING = 0.4


class Predictor:
    """Start for the next load of a surface, extrapolated linearly from its last two states.

    It extrapolates a signed pressure: the pressure of samples that touch, and minus the pressure
    that open samples lack for contact. So it predicts which open samples will touch and which
    pressed samples will open. An elastic contact has no memory: only the work is less.
    """

    def __init__(self) -> None:
        self._last: list[tuple[float, np.ndarray]] = []

    def remember(self, load: Load, state: ContactState) -> None:
        """Store a state; all loads of a path are of one kind."""
        dx, dy = state.gap.spacing
        lacking = LACKING * state.contact_modulus / (dx * dy) ** 0.5 * state.gap.values
        self._last = [*self._last[-1:], (load.value, state.pressure.values - lacking)]

    def start(self, load: Load) -> np.ndarray | None:
        """Pressure [Pa] for a load: s1 + r (s1 - s0) clipped at zero, r the ratio of the steps."""
        if not self._last:
            return None
        (before, signed_before), (last, signed_last) = self._last[0], self._last[-1]
        if before == last:
            return np.maximum(signed_last, 0)
        # A ratio of -1 returns to the state before the last.
        ratio = min(max((load.value - last) / (last - before), -1.0), FURTHEST)
        return np.maximum(signed_last + ratio * (signed_last - signed_before), 0)
