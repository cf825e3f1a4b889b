"""All figures, thresholds and tables of the letter: resumable, parallel.

    python -m demos.letter.reproduce --size 256

from a checkout of the project. Each finished point is a file in DIR/points: the same command goes
on after a run was killed, and a run with more parts or seeds adds the points that it lacks.
"""

import argparse
import shutil
import sys
from collections.abc import Sequence
from itertools import chain, product
from pathlib import Path

from demos.letter.contacts import RoughCase
from demos.letter.current_figure import current_figure
from demos.letter.currents import Current, over_first_contact
from demos.letter.options import parser
from demos.letter.page import Findings, page
from demos.letter.parts import folder_of, tasks_of
from demos.letter.persson import comparisons, predictions, ring_spectrum
from demos.letter.threshold_figure import threshold_figure
from demos.letter.thresholds import threshold_rows
from fem_seal import parallel
from fem_seal.cli.options import work_of
from fem_seal.digits import number_of
from fem_seal.errors import FemSealError, InvalidInput
from fem_seal.files import locked_folder, write_text
from fem_seal.points import Work, compute_study
from fem_seal.progress import Display, Report
from fem_seal.tables import as_csv
from fem_seal.theory.persson import AREA_LAWS


def reproduce(
    asked: argparse.Namespace, cases: Sequence[RoughCase], report: Report, work: Work
) -> Findings | None:
    """Compute the points that the folder lacks; draw and write all, unless some are left to others.

    Raises InvalidInput if the folder cannot be written, and NotConverged if a contact or a flow
    does not converge; the other points are computed all the same.
    """
    out, folder, tasks = asked.out, folder_of(asked), tasks_of(asked, cases)
    if compute_study(folder, list(chain.from_iterable(tasks.values())), work, report).missing:
        return None
    report("figures and tables", "")
    done = {part: [folder.load(task.name) for task in of_part] for part, of_part in tasks.items()}
    rows = threshold_rows(done.get("thresholds", []))
    case = cases[0]
    if rows:
        write_text(out / "thresholds.csv", as_csv(rows))
        threshold_figure(rows, out)
    currents, flows = [], None
    if "currents" in done:
        currents = _currents(case, done["currents"], out)
    if "pictures" in done:
        (flows,), (drawn,) = done["pictures"], tasks["pictures"]
        for path in folder.folder.glob(f"{drawn.name}-*"):
            shutil.copy(path, out / path.name.removeprefix(f"{drawn.name}-"))
    of_case = [row for row in rows if row.case == case]
    found = Findings(of_case, currents, flows, done.get("cascade", []))
    title = f"{case}, {number_of(asked.seeds, 'seed')}, rtol {asked.rtol:g}"
    write_text(out / "letter.md", page(title, found))
    return found


def _currents(case: RoughCase, points: list[Current], out: Path) -> list[Current]:
    """Write and draw Fig. 3 and the comparison with theory; the points over first contact."""
    currents = over_first_contact(points)
    if not any(point.value for point in currents):
        raise InvalidInput("no contact of --areas leaks; name a smaller area as well")
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
    current_figure(currents, curves, out)
    return currents


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
