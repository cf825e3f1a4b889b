"""Bisection over the load for many criteria at once: each contact is tested against all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.grid import GridField
from fem_seal.letter.spanning import Criterion, Snapshot
from fem_seal.letter.surfaces import Model

if TYPE_CHECKING:
    from fem_seal.contact.state import GapState

# Relative width of a bracket of load at which the bisection stops: the area jumps within it.
SMALLEST_STEP = 1e-7
# Smallest load over the first one: a criterion met below it is met at first contact.
FIRST_CONTACT = 1e-6


@dataclass(frozen=True)
class ThresholdBracket:
    """The last computed contact before a criterion is met, and the first one after.

    Attributes
    ----------
    criterion : Criterion
        Definition of spanning.
    before, after : Snapshot
        The two contacts, which bracket the threshold.
    """

    criterion: Criterion
    before: Snapshot
    after: Snapshot


@dataclass(eq=False)
class _Visited:
    """A computed contact, and which criteria it meets.

    The pressure is kept only while another contact may start from it.
    """

    snapshot: Snapshot
    crossed: tuple[bool, ...]
    pressure: np.ndarray | None


def crossings(
    surface: GridField,
    model: Model,
    criteria: Sequence[Criterion],
    resolution: float,
    *,
    threads: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> list[ThresholdBracket]:
    """Bracket the load at which each criterion is met.

    Contact only grows with the load, in both models (for the elastic one: J. R. Barber, Q. J.
    Mech. Appl. Math. 27, 1 (1974)), so that each criterion is met once and stays met. The load is
    bisected in the widest bracket; each contact starts from the pressure at the lower end. (If it
    started from the upper end or a mean of both, samples that should open could keep a tiny
    pressure, which the certificate allows, and would count as contact.)

    Parameters
    ----------
    surface : heights [m]
    model : bearing or elastic
    criteria : criteria to bracket
    resolution : largest width of the brackets in A/A0
    threads : threads of an elastic contact
    progress : called with a text on each contact

    Returns
    -------
    list of ThresholdBracket, in the order of the criteria

    Raises
    ------
    NotConverged
        If a contact does not converge, or a criterion is met at every load or at none.
    """

    def visit(load: float, start: np.ndarray | None) -> _Visited:
        state = model.press(surface, load, start, threads)
        crossed = tuple(criterion.crossed(state.contact) for criterion in criteria)
        progress(f"A/A0 = {state.contact_area_fraction:.4f}, {sum(crossed)} of {len(crossed)} met")
        return _Visited(Snapshot.of(state, load), crossed, _pressure(state))

    visited = _enclosed(visit, model)
    while True:
        ends = [_ends(visited, k) for k in range(len(criteria))]
        before, after = max(ends, key=_unfinished)
        if _unfinished((before, after)) <= resolution:
            break
        wide = [pair for pair in ends if _unfinished(pair) > resolution]
        _forget_pressures(visited, keep={id(before) for before, _ in wide})
        load = 0.5 * (before.snapshot.load + after.snapshot.load)
        visited.append(visit(load, before.pressure))
    return [
        ThresholdBracket(criterion, low.snapshot, high.snapshot)
        for criterion, (low, high) in zip(criteria, ends, strict=True)
    ]


def _pressure(state: "GapState") -> np.ndarray | None:
    from fem_seal.contact.state import ContactState

    return state.pressure.values if isinstance(state, ContactState) else None


def _enclosed(
    visit: Callable[[float, np.ndarray | None], _Visited], model: Model
) -> list[_Visited]:
    """Contacts under loads that enclose the thresholds of all criteria."""
    visited = [visit(model.low, None)]
    while any(visited[-1].crossed):
        if visited[-1].snapshot.load < FIRST_CONTACT * model.low:
            raise NotConverged("a spanning criterion is met at first contact already")
        visited.append(visit(0.5 * visited[-1].snapshot.load, None))
    load = model.high
    while not all(max(visited, key=_load).crossed):
        if load > model.limit:
            raise NotConverged(
                f"not every spanning criterion is met up to the largest load {model.limit}"
            )
        visited.append(visit(load, max(visited, key=_load).pressure))
        # The load of the bearing model is an area fraction and approaches 1 at full contact.
        load = min(1.3 * load, 0.5 * (load + 1)) if model.limit < 1 else 1.3 * load
    return visited


def _load(end: _Visited) -> float:
    return end.snapshot.load


def _ends(visited: list[_Visited], k: int) -> tuple[_Visited, _Visited]:
    """Largest load at which criterion k is not met and smallest at which it is."""
    return (
        max((end for end in visited if not end.crossed[k]), key=_load),
        min((end for end in visited if end.crossed[k]), key=_load),
    )


def _unfinished(pair: tuple[_Visited, _Visited]) -> float:
    """Width of a bracket in A/A0 that bisection can still reduce; 0 if the area jumps there."""
    before, after = (end.snapshot for end in pair)
    if after.load - before.load <= SMALLEST_STEP * after.load:
        return 0.0
    return after.area - before.area


def _forget_pressures(visited: list[_Visited], keep: set[int]) -> None:
    for end in visited:
        if id(end) not in keep:
            end.pressure = None
