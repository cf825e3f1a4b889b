"""Points of a run, by part."""

import argparse
from collections.abc import Callable, Sequence

from demos import closing_saddle
from demos.letter.cascade import CascadeStart, cascade_start
from demos.letter.contacts import MODELS, RoughCase
from demos.letter.currents import FLOW_AREA, Current, current
from demos.letter.flows import Picture, PictureFolder, picture
from demos.letter.thresholds import Thresholds, thresholds
from fem_seal.points import Chain, PointFolder, StudyTask

# Contact areas of Fig. 3; the largest may be sealed for some surfaces.
AREAS = {
    "bearing": (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.45, 0.48),
    "elastic": (0.02, 0.05, 0.1, 0.2, 0.3, 0.35, 0.38, 0.4, 0.42),
}
CONTACT_AREA = 0.46  # of Fig. 1
STARTS = (("elastic", 0.0), ("bearing", FLOW_AREA), ("elastic", FLOW_AREA))  # of the cascade
SADDLES = (64, 128, 256)  # samples of the saddle's period


def point(folder: PointFolder, function: Callable, *arguments: object) -> Chain:
    """A point by a function of arguments that also name its file."""
    texts = ("+".join(a) if isinstance(a, tuple) else str(a) for a in arguments)
    name = "-".join([function.__name__, *texts])
    return Chain(folder, (StudyTask(name, name, function, arguments),))


def chains_of(asked: argparse.Namespace, cases: Sequence[RoughCase]) -> dict[str, list[Chain]]:
    """Points of a run by part; the name of each holds all that it depends on.

    Thresholds are computed for all cases, the rest for the first one.
    """
    points, case = asked.out / "points", cases[0]
    shown, starts = PictureFolder(points, Picture), PointFolder(points, CascadeStart)
    saddles = PointFolder(points, closing_saddle.Saddle)
    of_part = {
        "currents": currents_of(asked, case, PointFolder(points, Current)),
        "thresholds": thresholds_of(asked, cases, PointFolder(points, Thresholds)),
        "contacts": [point(shown, picture, case, model, CONTACT_AREA, None) for model in MODELS],
        "flows": [point(shown, picture, case, model, FLOW_AREA, asked.rtol) for model in MODELS],
        "cascade": [point(starts, cascade_start, case, *start) for start in STARTS],
        "saddle": [point(saddles, closing_saddle.saddle, n) for n in reversed(SADDLES)],
    }
    parts = {*asked.only}
    parts |= {"contacts", "flows"} if "pictures" in parts else set()
    # Errors of the grid and finite differences belong to the points of Fig. 3.
    parts |= {"currents"} if parts & {"grids", "differences"} else set()
    return {part: chains for part, chains in of_part.items() if part in parts}


def currents_of(asked: argparse.Namespace, case: RoughCase, folder: PointFolder) -> list[Chain]:
    """Points of Fig. 3, and first contact, to which its leak rates relate."""
    areas_of = AREAS if asked.areas is None else dict.fromkeys(MODELS, asked.areas)
    with_differences = "differences" in asked.only
    # Of these a finer grid is solved as well.
    refined = [("elastic", 1, area) for area in areas_of["elastic"] if "grids" in asked.only]
    contacts = [
        (model, seed, area)
        for model, areas in (
            ("elastic", (0.0, *areas_of["elastic"])),
            ("bearing", areas_of["bearing"]),
        )
        for seed in range(1, asked.seeds + 1)
        for area in areas
    ]
    return [
        point(
            folder,
            current,
            case,
            *contact,
            asked.rtol,
            with_differences,
            asked.refine if contact in refined else 0,
        )
        for contact in contacts
    ]


def thresholds_of(
    asked: argparse.Namespace, cases: Sequence[RoughCase], folder: PointFolder
) -> list[Chain]:
    """Where contact percolates, of both models and all cases."""
    return [
        point(folder, thresholds, case, model, seed, asked.resolution)
        for case in cases
        for model in reversed(MODELS)
        for seed in range(1, asked.seeds + 1)
    ]
