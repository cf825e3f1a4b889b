"""Bisection over the load, until brackets of all events are narrow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from demos.letter.contacts import pressed
from demos.letter.events import Bracket, Event, Snapshot
from fem_seal.contact import ContactState
from fem_seal.errors import NotConverged
from fem_seal.grid import GridField

# First bracket of the load, and the largest load. Elastic: A/A0 is about 0.23 at 0.1, 0.62 at 0.35.
LOADS = {"bearing": (0.3, 0.7, 1.0), "elastic": (0.1, 0.35, 10.0)}
# Relative width of a bracket of load at which the bisection stops: the area jumps within it.
SMALLEST_STEP = 1e-7
# Smallest load over the first one: an event below it has occurred at first contact.
FIRST_CONTACT = 1e-6


@dataclass(eq=False)
class _Visited:
    """A computed contact; its pressure is kept only while another contact may start from it."""

    snapshot: Snapshot
    occurred: tuple[bool, ...]
    pressure: np.ndarray | None

    @property
    def load(self) -> float:
        return self.snapshot.load


def crossings(
    surface: GridField, model: str, events: Sequence[Event], resolution: float
) -> list[Bracket]:
    """Bracket the loads at which events occur, to a width in A/A0; each contact is tested for all.

    Contact only grows with the load (for the elastic model: J. R. Barber, Q. J. Mech. Appl. Math.
    27, 1 (1974)). The load is bisected in the widest bracket, from the pressure at its lower end:
    from the upper end or a mean, samples that should open could keep a tiny pressure, which the
    certificate allows, and would count as contact.
    """

    def visit(load: float, start: np.ndarray | None) -> _Visited:
        """Press the surface, and test the contact for all events."""
        state = pressed(surface, model, load, start)
        pressure = state.pressure.values if isinstance(state, ContactState) else None
        occurred = tuple(event.occurred(state.contact) for event in events)
        return _Visited(Snapshot.of(state, load), occurred, pressure)

    visited = _enclosed(visit, *LOADS[model])
    while True:
        brackets = [
            (
                max((v for v in visited if not v.occurred[k]), key=lambda v: v.load),
                min((v for v in visited if v.occurred[k]), key=lambda v: v.load),
            )
            for k in range(len(events))
        ]
        wide = [pair for pair in brackets if _width(pair) > resolution]
        if not wide:
            return [(before.snapshot, after.snapshot) for before, after in brackets]
        starts = {id(before) for before, _ in wide}
        for contact in visited:
            contact.pressure = contact.pressure if id(contact) in starts else None
        before, after = max(wide, key=_width)
        visited.append(visit(0.5 * (before.load + after.load), before.pressure))


def _enclosed(visit, low: float, high: float, largest: float) -> list[_Visited]:
    """Contacts under loads that enclose all events."""
    visited = [visit(low, None)]
    while any(visited[-1].occurred):
        if visited[-1].load < FIRST_CONTACT * low:
            raise NotConverged("contact spans at first contact already")
        visited.append(visit(0.5 * visited[-1].load, None))
    heaviest, load = visited[0], high
    while not all(heaviest.occurred):
        if load > (1 - FIRST_CONTACT) * largest:
            raise NotConverged(f"contact does not span up to the largest load {largest}")
        heaviest = visit(load, heaviest.pressure)
        visited.append(heaviest)
        load = min(1.3 * load, 0.5 * (load + largest))
    return visited


def _width(pair: tuple[_Visited, _Visited]) -> float:
    """Width of a bracket in A/A0 that bisection can still reduce; 0 if the area jumps there."""
    before, after = pair
    if after.load - before.load <= SMALLEST_STEP * after.load:
        return 0.0
    return after.snapshot.area - before.snapshot.area
