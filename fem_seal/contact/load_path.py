"""Many loads of one surface, each started from an extrapolation of the states before."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.halfspace import Layer
from fem_seal.contact.methods import ContactStopping
from fem_seal.contact.settings import Load
from fem_seal.contact.solve import Start, load_to, start_pressure
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField

# Largest extrapolation, in steps between the last two loads. A longer one makes no better start.
FURTHEST = 2.0
# Pressure that an open sample lacks for contact, in units of E* × gap / spacing; about half the
# stiffness of one sample. With 0.5 or 1.5 times this value paths take longer; paths over wide
# ranges of load, by a tenth.
LACKING = 0.4


def load_path(
    height: GridField,
    contact_modulus: float,
    *,
    pressures: Sequence[float] | None = None,
    area_fractions: Sequence[float] | None = None,
    mean_gaps: Sequence[float] | None = None,
    tolerance: float = 1e-6,
    solver: str = "free-set-cg",
    start: Start | None = None,
    layer: Layer | None = None,
    threads: int | None = None,
    precision: str = "mixed",
    max_iterations: int | None = None,
) -> Iterator[ContactState]:
    """Yield the contact under one load after the other.

    Each load starts from a linear extrapolation of the last two states. In it open samples have a
    negative pressure proportional to their gap, so that it predicts which open samples will touch
    and which pressed samples will open. The states are those of `solve`, since an elastic contact
    has no memory; only the work is less. To resume a path, pass the remaining loads, and the last
    state as `start`.

    Parameters
    ----------
    height, contact_modulus
        As in `solve`.
    pressures, mean_gaps, area_fractions : mean pressures [Pa], mean gaps [m] or A/A0: exactly one
        of them, in any order; neighbours should be near each other
    tolerance, solver, layer, threads, precision, max_iterations
        As in `solve`.
    start : pressure [Pa] from which the first load starts

    Raises
    ------
    InvalidInput
        At once, if an argument is out of range.
    NotConverged
        While iterating, if a state does not converge.
    """
    loads = _one_sequence(pressure=pressures, area_fraction=area_fractions, mean_gap=mean_gaps)
    stopping = ContactStopping(solver, tolerance, max_iterations)
    first = start_pressure(start, height.shape)
    pair = ContactPair.prepared(height, contact_modulus, layer, threads, precision)
    return _states(pair, loads, stopping, first)


def _one_sequence(**named_sequences: Sequence[float] | None) -> list[Load]:
    sequences = {kind: values for kind, values in named_sequences.items() if values is not None}
    if len(sequences) != 1:
        named = ", ".join(f"{kind}s" for kind in sequences) or "none"
        raise InvalidInput(
            f"give exactly one sequence out of pressures, area_fractions, mean_gaps; got {named}"
        )
    ((kind, values),) = sequences.items()
    return [Load(kind, float(value)) for value in values]


def _states(
    pair: ContactPair, loads: list[Load], stopping: ContactStopping, start: np.ndarray | None
) -> Iterator[ContactState]:
    predictor = Predictor()
    for load in loads:
        spent = pair.half_space.pairs
        first = predictor.start(load)
        if first is None and start is not None:
            first = pair.complementary(start)
        state = load_to(pair, load, stopping, first)
        predictor.remember(load, state)
        yield replace(state, fft_pairs=pair.half_space.pairs - spent)


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
