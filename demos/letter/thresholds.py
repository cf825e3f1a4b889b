"""Where contact percolates: both ends of the transition, of one surface and of ensembles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from demos.letter.contacts import MODELS, RoughCase
from demos.letter.crossings import crossings
from demos.letter.events import EVENTS, PAIRS, REFERENCE, Bracket, Event

DIFFERENCE = "bearing less elastic"  # in place of the model, in rows of differences


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
        case,
        model,
        pair,
        len(ones),
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
