"""Many loads of one surface, each started from what its predecessors foretell."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fem_seal.contact.halfspace import Layer
from fem_seal.contact.interface import Interface
from fem_seal.contact.methods import Stopping
from fem_seal.contact.solve import Load, Start, load_to, start_pressure
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField

# Extrapolating further than this multiple of the last step starts worse than not at all.
FURTHEST = 2.0
# Pressure that an open sample lacks for contact, in units of gap × stiffness of one sample: between
# 0.15 and 0.3 paths of small and of large steps cost least.
LACKING = 0.25


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
    threads: int = 1,
    precision: str = "mixed",
    max_iterations: int | None = None,
) -> Iterator[ContactState]:
    """Contact under one load after the other, each yielded as soon as it is done.

    The start of each is extrapolated linearly from the last two states, where open samples count
    with a negative pressure proportional to their gap: so they are foretold to touch, and pressed
    ones to open. The states are those of `solve` (there is no memory in an elastic contact); only
    the work is less. To resume a path, give the remaining loads and the last state as `start`.

    Parameters
    ----------
    height, contact_modulus
        As in `solve`.
    pressures [Pa], area_fractions, mean_gaps [m] : sequence of float
        Exactly one of them, in any order; neighbours should be near each other.
    tolerance, solver, layer, threads, precision, max_iterations
        As in `solve`.
    start : pressure to start the first load from [Pa]
        Array, field or state.

    Returns
    -------
    iterator of ContactState

    Raises
    ------
    InvalidInput
        At once, if an argument is out of range.
    NotConverged
        While iterating, if a state does not converge.
    """
    loads = _one_sequence(pressure=pressures, area_fraction=area_fractions, mean_gap=mean_gaps)
    stopping = Stopping(solver, tolerance, max_iterations)
    first = start_pressure(start, height.shape)
    interface = Interface.prepared(height, contact_modulus, layer, threads, precision)
    return _states(interface, loads, stopping, first)


def _one_sequence(**given: Sequence[float] | None) -> list[Load]:
    sequences = {kind: values for kind, values in given.items() if values is not None}
    if len(sequences) != 1:
        named = ", ".join(f"{kind}s" for kind in sequences) or "none"
        raise InvalidInput(
            f"give exactly one sequence out of pressures, area_fractions, mean_gaps; got {named}"
        )
    ((kind, values),) = sequences.items()
    return [Load(kind, float(value)) for value in values]


def _states(
    interface: Interface, loads: list[Load], stopping: Stopping, start: np.ndarray | None
) -> Iterator[ContactState]:
    before, last = None, None
    for load in loads:
        spent = interface.half_space.pairs
        if last is not None:
            start = _foretold(before, last, load)
        elif start is not None:
            start = interface.complementary(start)
        state = load_to(interface, load, stopping, start)
        state = replace(state, fft_pairs=interface.half_space.pairs - spent)
        before, last = last, (load, _signed(interface, state))
        yield state


def _signed(interface: Interface, state: ContactState) -> np.ndarray:
    """Pressure of the touching samples, minus what the open ones lack [Pa]."""
    return state.pressure.values - LACKING * interface.point_stiffness * state.gap.values


def _foretold(
    before: tuple[Load, np.ndarray] | None, last: tuple[Load, np.ndarray], load: Load
) -> np.ndarray:
    """Signed pressure s1 + r (s1 - s0), clipped at zero, with r the ratio of the steps of load."""
    if before is None or before[0].value == last[0].value:
        return np.maximum(last[1], 0)
    ratio = (load.value - last[0].value) / (last[0].value - before[0].value)
    # At -1 the path has turned back to the state before.
    ratio = min(max(ratio, -1.0), FURTHEST)
    return np.maximum(last[1] + ratio * (last[1] - before[1]), 0)
