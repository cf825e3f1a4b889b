"""All figures, thresholds and tables of the letter, and one closing saddle: resumable, parallel.

    python -m demos.letter.reproduce --size 256

from a checkout of the project. Each finished point is a file in DIR/points: the same command goes
on after a run was killed, and a run with more parts or seeds adds the points that it lacks.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path

from demos import closing_saddle
from demos.letter import figures
from demos.letter.cascade import CascadeStart, cascade_start
from demos.letter.contacts import MODELS, RoughCase
from demos.letter.currents import FLOW_AREA, Current, current, over_first_contact
from demos.letter.flows import FlowMeasures, Picture, PictureFolder, picture
from demos.letter.page import Findings, page
from demos.letter.persson import comparisons, predictions, ring_spectrum
from demos.letter.thresholds import Thresholds, threshold_rows, thresholds
from fem_seal import parallel
from fem_seal.cli.options import add_work, work_of
from fem_seal.digits import number_of
from fem_seal.errors import FemSealError, InvalidInput
from fem_seal.files import locked_folder, write_text
from fem_seal.points import Chain, PointFolder, StudyTask, Work, compute_study
from fem_seal.progress import Display, Report
from fem_seal.tables import as_csv
from fem_seal.theory.persson import AREA_LAWS

PARTS = {
    "thresholds": "where contact percolates",
    "currents": "leak rates of Fig. 3",
    "differences": "finite differences in Fig. 3",
    "grids": "error of the contact's grid in Fig. 3, for the first seed",
    "pictures": "Figs. 1 and 2",
    "cascade": "start of the cascade",
    "saddle": "one closing saddle",
}
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
                *(records, current, case, model, seed, area, asked.rtol, with_differences),
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
                *(thresholds, one, model, seed, asked.resolution),
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


def reproduce(
    asked: argparse.Namespace, cases: Sequence[RoughCase], report: Report, work: Work
) -> Findings | None:
    """Compute the points that the folder lacks; draw and write all, unless some are left to others.

    Raises InvalidInput if the folder cannot be written, and NotConverged if a contact or a flow
    does not converge; the other points are computed all the same.
    """
    out, chains = asked.out, chains_of(asked, cases)
    if compute_study([chain for part in chains.values() for chain in part], work, report).missing:
        return None
    report("figures and tables", "")
    done = {
        part: [chain.folder.load(chain.tasks[0].name) for chain in of_part]
        for part, of_part in chains.items()
    }
    rows = threshold_rows(done.get("thresholds", []))
    case = cases[0]
    if rows:
        write_text(out / "thresholds.csv", as_csv(rows))
        figures.threshold_figure(rows, out)
    currents, flows = [], None
    if "currents" in done:
        currents = _currents(case, done["currents"], out)
    if "flows" in done:
        contacts, shown = (
            dict(zip(MODELS, done[part], strict=True)) for part in ("contacts", "flows")
        )
        figures.contact_figure(contacts, out)
        figures.flow_figure(shown, out)
        flows = {model: FlowMeasures.of(flow) for model, flow in shown.items()}
    if "saddle" in done:
        closing_saddle.show(done["saddle"][::-1], out / "saddle.png")
    of_case = [row for row in rows if row.case == case]
    found = Findings(of_case, currents, flows, done.get("cascade", []))
    title = f"{case}, {number_of(asked.seeds, 'seed')}, rtol {asked.rtol:g}"
    write_text(out / "letter.md", page(title, found))
    return found


def _currents(case: RoughCase, points: list[Current], out: Path):
    """Write and draw Fig. 3 and the comparison with theory; the points over first contact."""
    currents = over_first_contact(points)
    first = {point.seed: point.value for point in points if point.wanted == 0}
    spectra = {seed: ring_spectrum(case, case.surface(seed)) for seed in first}
    curves = [
        row
        for law in AREA_LAWS
        for seed, spectrum in spectra.items()
        for row in predictions(spectrum, law, seed, first[seed])
    ]
    theory = comparisons(currents, curves)
    write_text(out / "fig3.csv", as_csv(currents))
    write_text(out / "fig3-persson.csv", as_csv(curves))
    if theory:
        write_text(out / "theory.csv", as_csv(theory))
    figures.current_figure(currents, curves, out)
    return currents


def parser() -> argparse.ArgumentParser:
    """Command line."""
    top = argparse.ArgumentParser(
        prog="python -m demos.letter.reproduce",
        description="The 2012 letter on percolation and leakage of rough contacts, with errors.",
        epilog="Parts: " + "; ".join(f"{name}: {text}" for name, text in PARTS.items()) + ".",
    )

    def several(kind: type) -> Callable[[str], tuple]:
        read = lambda text: tuple(kind(part) for part in text.split(","))  # noqa: E731
        read.__name__ = f"list of {kind.__name__}"  # for argparse's message
        return read

    cases = "; thresholds for all values, the rest for the first"
    for name, kind, default, metavar, text in (
        ("size", several(int), (256,), "V1,V2,…", f"samples along a side (256){cases}"),
        ("hurst", several(float), (0.8,), "V1,V2,…", f"Hurst exponent (0.8){cases}"),
        ("short", several(float), (1.0,), "V1,V2,…", f"short cut-off, in samples (1){cases}"),
        ("long", several(float), (0.125,), "V1,V2,…", f"long cut-off over the side (0.125){cases}"),
        ("seeds", int, 3, "N", "surfaces 1 to N (3)"),
        ("rtol", float, 0.1, "RTOL", "width of certified brackets (0.1)"),
        ("areas", several(float), None, "V1,…", "A/A0 of Fig. 3 (0.02 to closing)"),
        ("refine", int, 2, "FACTOR", "finer grids (2)"),
        ("resolution", float, 0.002, "A", "of thresholds, in A/A0 (0.002)"),
        ("out", Path, Path("results/letter"), "DIR", "folder; its points stay (results/letter)"),
    ):
        top.add_argument(f"--{name}", type=kind, default=default, metavar=metavar, help=text)
    top.add_argument(
        "--only",
        nargs="+",
        default=tuple(PARTS),
        metavar="PART",
        choices=tuple(PARTS),
        help="parts to compute (all); a later run adds others",
    )
    add_work(top)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; exit status 0, 2 for bad input, 3 where a point does not converge."""
    options = parser().parse_args(arguments)
    try:
        if parallel.processes() > 1:
            raise InvalidInput("each point is solved by one process; start it without mpirun")
        for right, sentence in (
            (options.seeds >= 1, "--seeds must be at least 1"),
            (0 < options.rtol < 2, "--rtol must lie in (0, 2)"),
            (0 < options.resolution < 1, "--resolution must lie in (0, 1)"),
            (options.refine >= 2, "--refine must be at least 2"),
            (all(0 < area < 1 for area in options.areas or ()), "--areas must lie in (0, 1)"),
        ):
            if not right:
                raise InvalidInput(sentence)
        lists = options.size, options.hurst, options.short, options.long
        cases = [RoughCase(*values) for values in product(*lists)]
        with locked_folder(options.out, shared=True), Display() as report:
            found = reproduce(options, cases, report, work_of(options))
        if found is None:
            print("some points are not computed yet; without --part they are, with the figures")
            return 0
    except FemSealError as error:
        print(f"reproduce: {error}", file=sys.stderr)
        return error.exit_status
    print((options.out / "letter.md").read_text(encoding="utf-8"))
    print(f"letter.md, figures and tables in {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
