"""A start for the next of many loads of one surface, extrapolated from the states before."""

from collections.abc import Sequence

import numpy as np

from fem_seal.contact.state import ContactState

# Largest extrapolation, in steps between the last two loads. A longer one makes no better start.
FURTHEST = 2.0
# Pressure that an open sample lacks for contact, in units of E* × gap / spacing; about half the
# stiffness of one sample. With 0.5 or 1.5 times this value paths take longer; paths over wide
# ranges of load, by a tenth.
LACKING = 0.4


def extrapolated(load: float, states: Sequence[tuple[float, ContactState]]) -> np.ndarray | None:
    """Pressure [Pa] to start from under a load, linear in the last two states; None without any.

    The states of a path come with their loads, all of one kind. A signed pressure is extrapolated,
    s1 + r (s1 - s0) with r the ratio of the steps: the pressure of samples that touch, and minus
    the pressure that open samples lack for contact. So it predicts which open samples will touch
    and which pressed samples will open. An elastic contact has no memory: only the work is less.
    """
    if not states:
        return None
    # The first and the last of at most two states, which may be one.
    (before, first), (last, latest) = states[-2:][0], states[-1]
    signed = _signed_pressure(latest)
    if before != last:
        # A ratio of -1 returns to the state before the last.
        ratio = min(max((load - last) / (last - before), -1.0), FURTHEST)
        signed = signed + ratio * (signed - _signed_pressure(first))
    return np.maximum(signed, 0)


def _signed_pressure(state: ContactState) -> np.ndarray:
    """Pressure [Pa] of samples that touch, and minus the one that open samples lack."""
    dx, dy = state.gap.spacing
    lacking = LACKING * state.contact_modulus / (dx * dy) ** 0.5 * state.gap.values
    return state.pressure.values - lacking
