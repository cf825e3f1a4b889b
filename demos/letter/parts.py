"""Points of a run, by part."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

from demos.letter.cascade import CascadeStart, cascade_start
from demos.letter.contacts import MODELS, RoughCase
from demos.letter.currents import FLOW_AREA, Current, current
from demos.letter.flows import FlowMeasures
from demos.letter.maps import pictures
from demos.letter.thresholds import Thresholds, thresholds
from fem_seal.points import PointFolder, StudyTask

# Contact areas of Fig. 3; the largest may be sealed for some surfaces.
AREAS = {
    "bearing": (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.45, 0.48),
    "elastic": (0.02, 0.05, 0.1, 0.2, 0.3, 0.35, 0.38, 0.4, 0.42),
}
STARTS = (("elastic", 0.0), ("bearing", FLOW_AREA), ("elastic", FLOW_AREA))  # of the cascade


def point(function: Callable, *arguments: object) -> StudyTask:
    """A point by a function of arguments that also name its file."""
    texts = ("+".join(a) if isinstance(a, tuple) else str(a) for a in arguments)
    name = "-".join([function.__name__, *texts])
    return StudyTask(name, name, function, arguments)


def folder_of(asked: argparse.Namespace) -> PointFolder:
    """Folder of the points of all parts."""
    kinds = Current | Thresholds | CascadeStart | dict[str, FlowMeasures]
    return PointFolder(asked.out / "points", kinds)


def tasks_of(asked: argparse.Namespace, cases: Sequence[RoughCase]) -> dict[str, list[StudyTask]]:
    """Points of a run by part; the name of each holds all that it depends on.

    Thresholds are computed for all cases, the rest for the first one.
    """
    case = cases[0]
    drawn = point(pictures, case, asked.rtol)
    beside = folder_of(asked).folder, drawn.name  # where it draws, which is not part of its name
    of_part = {
        "pictures": [replace(drawn, arguments=(*drawn.arguments, *beside))],
        "currents": currents_of(asked, case),
        "thresholds": thresholds_of(asked, cases),
        "cascade": [point(cascade_start, case, *start) for start in STARTS],
    }
    parts = {*asked.only}
    # Errors of the grid and finite differences belong to the points of Fig. 3.
    parts |= {"currents"} if parts & {"grids", "differences"} else set()
    return {part: tasks for part, tasks in of_part.items() if part in parts}


def currents_of(asked: argparse.Namespace, case: RoughCase) -> list[StudyTask]:
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
            current,
            case,
            *contact,
            asked.rtol,
            with_differences,
            asked.refine if contact in refined else 0,
        )
        for contact in contacts
    ]


def thresholds_of(asked: argparse.Namespace, cases: Sequence[RoughCase]) -> list[StudyTask]:
    """Where contact percolates, of both models and all cases."""
    return [
        point(thresholds, case, model, seed, asked.resolution)
        for case in cases
        for model in reversed(MODELS)
        for seed in range(1, asked.seeds + 1)
    ]
