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


def chains_of(asked: argparse.Namespace, cases: Sequence[RoughCase]) -> dict[str, list[Chain]]:
    """Points of a run by part; the name of each holds all that it depends on.

    Thresholds are computed for all cases, the rest for the first one.
    """
    points, case, seeds = asked.out / "points", cases[0], range(1, asked.seeds + 1)
    areas_of = AREAS if asked.areas is None else dict.fromkeys(MODELS, asked.areas)

    def point(folder: PointFolder, function: Callable, *arguments: object) -> Chain:
        """A point by a function of arguments that also name its file."""
        texts = ("+".join(a) if isinstance(a, tuple) else str(a) for a in arguments)
        name = "-".join([function.__name__, *texts])
        return Chain(folder, (StudyTask(name, name, function, arguments),))

    shown, records = PictureFolder(points, Picture), PointFolder(points, Current)
    with_differences = "differences" in asked.only
    # Beside these points a finer grid is solved.
    refined = [("elastic", 1, area) for area in areas_of["elastic"] if "grids" in asked.only]
    of_part = {
        "currents": [
            point(
                records,
                current,
                case,
                model,
                seed,
                area,
                asked.rtol,
                with_differences,
                asked.refine if (model, seed, area) in refined else 0,
            )
            for model, areas in (
                ("elastic", (0.0, *areas_of["elastic"])),
                ("bearing", areas_of["bearing"]),
            )
            for seed in seeds
            for area in areas
        ],
        "thresholds": [
            point(
                PointFolder(points, Thresholds),
                thresholds,
                one,
                model,
                seed,
                asked.resolution,
            )
            for one in cases
            for model in reversed(MODELS)
            for seed in seeds
        ],
        "contacts": [point(shown, picture, case, model, CONTACT_AREA, None) for model in MODELS],
        "flows": [point(shown, picture, case, model, FLOW_AREA, asked.rtol) for model in MODELS],
        "cascade": [
            point(PointFolder(points, CascadeStart), cascade_start, case, *start)
            for start in STARTS
        ],
        "saddle": [
            point(PointFolder(points, closing_saddle.Saddle), closing_saddle.saddle, samples)
            for samples in reversed(SADDLES)
        ],
    }
    parts = {*asked.only}
    parts |= {"contacts", "flows"} if "pictures" in parts else set()
    # Errors of the grid and finite differences belong to the points of Fig. 3.
    parts |= {"currents"} if parts & {"grids", "differences"} else set()
    return {part: chains for part, chains in of_part.items() if part in parts}
