"""Many loads of one surface, each started from an extrapolation of the states before."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import USUAL_STOPPING, ContactStopping
from fem_seal.contact.settings import ElasticSolid, Load
from fem_seal.contact.solve import load_to
from fem_seal.contact.state import ContactState
from fem_seal.grid import GridField

# Largest extrapolation, in steps between the last two loads. A longer one makes no better start.
FURTHEST = 2.0
# Pressure that an open sample lacks for contact, in units of E* × gap / spacing; about half the
# stiffness of one sample. With 0.5 or 1.5 times this value paths take longer; paths over wide
# ranges of load, by a tenth.
LACKING = 0.4


def load_path(
    height: GridField,
    solid: ElasticSolid,
    loads: Iterable[Load],
    stopping: ContactStopping = USUAL_STOPPING,
) -> Iterator[ContactState]:
    """Yield the contact under one load after the other, all of one kind, near to their neighbours.

    Each load starts from a linear extrapolation of the last two states. In it open samples have a
    negative pressure proportional to their gap, so that it predicts which open samples will touch
    and which pressed samples will open. The states are those of `press`, since an elastic contact
    has no memory; only the work is less.
    """
    pair, predictor = ContactPair.prepared(height, solid), Predictor()
    for load in loads:
        spent = pair.half_space.fft_pairs
        state = load_to(pair, load, stopping, predictor.start(load))
        predictor.remember(load, state)
        yield replace(state, fft_pairs=pair.half_space.fft_pairs - spent)


class Predictor:
    """Start for the next load of a surface, extrapolated from its last two states.

    It extrapolates a signed pressure: the pressure of samples that touch, and minus the pressure
    that open samples lack for contact.
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
