"""Where contact percolates: both ends of the transition, by bisection over the load."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from demos.letter.contacts import MODELS, RoughCase, pressed
from fem_seal.contact import ContactState, GapState
from fem_seal.contact.state import PERIMETER_FACTOR
from fem_seal.errors import NotConverged
from fem_seal.film.clusters import joins_ends
from fem_seal.grid import GridField

# Connectivities of contact and of open. All but the last are dual pairs. In the last one neither
# phase is connected through corners, and both may fail to span.
PAIRS = {
    "triangulation": ("triangulation", "triangulation"),
    "contact-8": ("8", "4"),
    "contact-4": ("4", "8"),
    "both-4": ("4", "4"),
}
REFERENCE = "triangulation"  # the pair by which the flow solver decides whether a gap leaks
# First bracket of the load, and the largest load. Elastic: A/A0 is about 0.23 at 0.1, 0.62 at 0.35.
LOADS = {"bearing": (0.3, 0.7, 1.0), "elastic": (0.1, 0.35, 10.0)}
# Relative width of a bracket of load at which the bisection stops: the area jumps within it.
SMALLEST_STEP = 1e-7
# Smallest load over the first one: an event below it has occurred at first contact.
FIRST_CONTACT = 1e-6
DIFFERENCE = "bearing less elastic"  # in place of the model, in rows of differences


@dataclass(frozen=True)
class Event:
    """Contact begins to join the ends of the cell, or open ceases to; each occurs once.

    Paths go from the first row to the last, between side walls.
    """

    phase: str  #: "contact" or "open"
    connectivity: str

    def __str__(self) -> str:
        return f"{self.phase} {self.connectivity}"

    def occurred(self, contact: np.ndarray) -> bool:
        """Whether it has occurred in a contact, (nx, ny) bool."""
        if self.phase == "contact":
            return joins_ends(contact, self.connectivity)
        return not joins_ends(~contact, self.connectivity)


EVENTS = [
    Event(phase, connectivity)
    for phase in ("contact", "open")
    for connectivity in ("triangulation", "4", "8")
]


def euler_characteristic(mask: np.ndarray) -> int:
    """Vertices minus edges plus triangles of the pixel triangulation in a mask on the torus.

    It is the number of pieces minus that of their holes (K. R. Mecke, Lect. Notes Phys. 554, 111
    (2000)): negative for a "Swiss cheese". Both sides of the mask have an even number of samples.
    """

    def count(*masks: np.ndarray) -> int:
        return int(np.count_nonzero(np.logical_and.reduce(masks)))

    a, b, c = mask, np.roll(mask, -1, axis=0), np.roll(mask, -1, axis=1)
    d = np.roll(b, -1, axis=1)
    even = np.indices(mask.shape).sum(axis=0) % 2 == 0
    edges = count(a, b) + count(a, c) + count(a, d, even) + count(b, c, ~even)
    rising = count(a, b, d, even) + count(a, c, d, even)
    falling = count(a, b, c, ~even) + count(b, c, d, ~even)
    return count(a) - edges + rising + falling


@dataclass(frozen=True)
class Snapshot:
    """Measures of one contact."""

    load: float
    area: float  #: A/A0, counted in samples
    corrected: float  #: A/A0 less what pixels add along the perimeter
    #: Euler characteristic of contact on the torus, by the triangulation; open has its opposite
    euler: int

    @property
    def perimeter(self) -> float:
        """Number of pixel edges between contact and open over the number of samples."""
        return (self.area - self.corrected) / PERIMETER_FACTOR

    @classmethod
    def of(cls, state: GapState, load: float) -> "Snapshot":
        """Measure a contact."""
        return cls(
            load,
            state.contact_area_fraction,
            state.contact_area_corrected,
            euler_characteristic(state.contact),
        )


Bracket = tuple[Snapshot, Snapshot]  # the last contact before an event, and the first one after


@dataclass(frozen=True)
class Thresholds:
    """Brackets of all events of one surface under one model."""

    case: RoughCase
    model: str
    seed: int
    resolution: float  #: largest width of the brackets in A/A0
    brackets: dict[str, Bracket]  #: by the name of the event

    def ends(self, pair: str, name: str = "area") -> tuple[float, float]:
        """A/A0, or another measure, where contact begins to span and where open ceases to."""
        events = map(Event, ("contact", "open"), PAIRS[pair])
        brackets = [self.brackets[str(event)] for event in events]
        return tuple(float(np.mean([getattr(end, name) for end in both])) for both in brackets)

    def at(self, pair: str, name: str = "area") -> float:
        """A*/A0, the mean of both ends, or the mean of another measure."""
        return float(np.mean(self.ends(pair, name)))


def thresholds(case: RoughCase, model: str, seed: int, resolution: float) -> Thresholds:
    """Bracket the thresholds of one surface under one model."""
    brackets = crossings(case.surface(seed), model, EVENTS, resolution)
    found = dict(zip(map(str, EVENTS), brackets, strict=True))
    return Thresholds(case, model, seed, resolution, found)


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


@dataclass(frozen=True)
class ThresholdRow:
    """A*/A0 of an ensemble, mean over its seeds; or bearing less elastic of the same surfaces."""

    case: RoughCase
    model: str
    pair: str
    seeds: int
    threshold: float
    deviation: float | None  #: standard deviation of one seed; None for a single one
    standard_error: float | None  #: of the mean
    corrected: float | None = None  #: after the perimeter correction; elastic contact only
    corrected_deviation: float | None = None
    #: half the distance of the areas where contact begins and open ceases to span, mean over seeds
    half_width: float | None = None
    euler: float | None = None  #: Euler characteristic of contact at A*, by the triangulation
    perimeter: float | None = None  #: pixel edges for each sample, at A*


def threshold_rows(found: Sequence[Thresholds]) -> list[ThresholdRow]:
    """Rows of all ensembles, pairs and models, and of the differences."""
    rows, of = [], {(one.case, one.model, one.seed): one for one in found}
    for case in dict.fromkeys(one.case for one in found):
        seeds = sorted({one.seed for one in found if one.case == case})
        by_model = {
            model: [of[case, model, seed] for seed in seeds if (case, model, seed) in of]
            for model in MODELS
        }
        both = [s for s in seeds if all((case, model, s) in of for model in MODELS)]
        for pair in PAIRS:
            rows += [_row(pair, ones) for ones in by_model.values() if ones]
            cut, pressed = (
                np.array([of[case, model, s].at(pair) for s in both]) for model in MODELS
            )
            if both:
                values = _statistics(cut - pressed)
                rows.append(ThresholdRow(case, DIFFERENCE, pair, len(both), *values))
    return rows


def _row(pair: str, ones: Sequence[Thresholds]) -> ThresholdRow:
    """Row of one model; its Euler characteristic and perimeter are those of the reference pair."""
    case, model = ones[0].case, ones[0].model
    # A pixel of an elastic contact counts if it carries any pressure, which makes the area too
    # large. The area of a cut is prescribed.
    corrected, deviation, _ = (
        _statistics([one.at(pair, "corrected") for one in ones])
        if model == "elastic"
        else (None, None, None)
    )
    ends = np.array([one.ends(pair) for one in ones])
    return ThresholdRow(
        *(case, model, pair, len(ones)),
        *_statistics([one.at(pair) for one in ones]),
        corrected,
        deviation,
        half_width=float(np.abs(ends[:, 1] - ends[:, 0]).mean() / 2),
        euler=float(np.mean([one.at(REFERENCE, "euler") for one in ones])),
        perimeter=float(np.mean([one.at(REFERENCE, "perimeter") for one in ones])),
    )


def _statistics(values: Sequence[float]) -> tuple[float, float | None, float | None]:
    """Mean, standard deviation of one value, standard error of the mean."""
    mean = float(np.mean(values))
    if len(values) == 1:
        return mean, None, None
    deviation = float(np.std(values, ddof=1))
    return mean, deviation, deviation / len(values) ** 0.5
