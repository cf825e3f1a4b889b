"""fem-seal sweep: a scene over the values of some of its fields."""

import argparse
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.cli.options import (
    add_output,
    add_scene,
    add_trust,
    add_work,
    default_folder,
    path_of,
    work_of,
)
from fem_seal.cli.printing import say
from fem_seal.errors import NotConverged, present
from fem_seal.files import locked_folder
from fem_seal.progress import Display
from fem_seal.tables import aligned

if TYPE_CHECKING:
    from fem_seal.sweep import Point


def add(command: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_scene(command)
    add_trust(command)
    points = command.add_mutually_exclusive_group(required=True)
    points.add_argument(
        "--vary",
        action="append",
        metavar="KEY=V1,V2,…",
        help="a field and its values; given more than once, all combinations are computed. A value "
        "may be a range, 1..1000, and that of a path a pattern, maps/m*.npz",
    )
    text = "in place of --vary: a head of keys, and a line for each point"
    points.add_argument("--points", type=path_of, metavar="TABLE.csv", help=text)
    add_work(command, default=None)
    command.add_argument(
        "--picture",
        action="store_true",
        help="draw sweep.png: leak rates, with all counted errors, against what varies",
    )
    add_output(command, "results/NAME-sweep for NAME.toml, with each --set; done points are kept")
    command.set_defaults(command=_sweep)


def _sweep(options: argparse.Namespace) -> int:
    from fem_seal.sweep import combinations, read_points, sweep

    folder = default_folder(options.scene, options.overrides)
    out = options.out or folder.with_name(f"{folder.name}-sweep")
    if options.points is not None:
        points = read_points(options.points)
    else:
        points = combinations(*options.vary, folder=options.scene.parent)
    with Display() as report:
        tally = sweep(
            options.scene,
            points,
            out,
            overrides=options.overrides,
            overwrite=options.overwrite,
            report=report,
            trust=options.trust,
            work=work_of(options),
        )
    keys = points[0]
    names = [", ".join(map("{}={}".format, keys, point.values)) for point in tally.table]
    points_in_words = aligned([*zip(names, map(line_of_point, tally.table), strict=True)])
    for line in (*points_in_words.splitlines(), *tally.equal):
        say(line)
    done = tally.points - tally.missing
    say(f"{done} points, {tally.computed} of them computed now, in {out}/sweep.csv")
    if options.picture and parallel.is_root():
        from fem_seal.sweep.picture import PICTURE_FILE, NotDrawn, sweep_figure

        try:
            with locked_folder(out, shared=True):
                sweep_figure(keys, tally.table, out, tally.shown)
        except NotDrawn as error:
            say(f"{PICTURE_FILE} is not drawn: {error}")
    if tally.failed:
        raise NotConverged(
            f"{tally.failed} of {tally.points} points failed or did not converge; column reason "
            "says why"
        )
    if tally.missing and options.gather:
        raise NotConverged(
            f"{tally.missing} of {tally.points} points are not computed yet; run the parts that "
            "are missing, or all without --gather"
        )
    return 0


def line_of_point(point: "Point") -> str:
    """One line about a point."""
    if point.state is None:
        return f"no result: {point.reason}"
    area = f"{100 * present(point.contact_area_fraction, 'contact area'):.3g} % in contact"
    if "seal.patches_along" in point.further:
        area += " in the first patch"
    if not point.converged:
        area += ", not converged"
    decision = None if point.decision == point.state else point.decision
    return ", ".join(filter(None, (point.state, decision, point.headline, area)))
