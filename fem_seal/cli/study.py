"""fem-seal study: comparison of methods, and price of accuracy."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from platform import machine, processor
from textwrap import fill
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.arguments import choose
from fem_seal.cli.options import add_path, add_scene, add_work, work_of
from fem_seal.cli.printing import WIDTH, say
from fem_seal.digits import per_cent
from fem_seal.errors import InvalidInput, NotConverged, narrowed, present
from fem_seal.files import locked_folder, write_text
from fem_seal.progress import Display
from fem_seal.tables import as_csv, as_text

if TYPE_CHECKING:
    from fem_seal.leak_rate import Bounded
    from fem_seal.patch import Patch
    from fem_seal.scene import Scene
    from fem_seal.verification.cross_validation import Row

# Columns on a terminal, within 100 characters; the CSV has all.
COLUMNS = (
    "method", "squares", "unknowns", "value", "error", "band", "order", "effectivity", "verdict",
)  # fmt: skip

# Why there is nothing to compare in other states than "leaking".
WITHOUT_FLOW = {
    "sealed": "every method says 0 without a solve",
    "lifted off": "the fluid presses harder than the load, so that no gap is left to compare",
}


def add(command: argparse.ArgumentParser) -> None:
    """Add the studies."""
    studies = command.add_subparsers(metavar="STUDY", required=True, parser_class=type(command))
    grids = "number of grids, each twice as fine"
    cross = studies.add_parser(
        "cross-validation", help="every method on one gap over ever finer grids"
    )
    cross.set_defaults(study=_cross_validation)
    add_scene(cross)
    cross.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY=V1,V2,…",
        help="several gaps, as in fem-seal sweep: surface.seed=1..4, contact.pressure=1bar,2bar",
    )
    add_work(cross)
    exact = studies.add_parser("exact", help="every method where the leak rate is known exactly")
    exact.set_defaults(study=_exact)
    exact.add_argument("cases", nargs="*", metavar="CASE", help="exact cases by name (all)")
    add_work(exact)
    trade = studies.add_parser(
        "trade", help="error against time of contact grids, methods and tolerances"
    )
    trade.set_defaults(study=_trade)
    add_scene(trade)
    add_work(trade)
    for study, default in ((cross, 3), (exact, 4)):
        study.add_argument(
            "--grids",
            type=int,
            choices=range(1, 9),
            default=default,
            metavar="1..8",
            help=f"{grids} ({default})",
        )
    for name, study in studies.choices.items():
        out = Path("results") / name
        add_path(study, "--out", "DIR", f"result folder ({out})", out)
    command.set_defaults(command=_study)


Text = list[str] | None  # what a study prints; None while points of other parts are missing


def _study(options: argparse.Namespace) -> int:
    """Run a study in its folder, which its parts share, and print what it says.

    With --gather missing points are a failure.
    """
    with locked_folder(options.out, shared=True):
        text: Text = options.study(options)
    if text is not None:
        say("\n".join(text))
        return 0
    message = "some points of the study are not computed yet"
    if options.gather:
        raise NotConverged(f"{message}; run the parts that are missing, or all without --gather")
    say(f"{message}; the same command without --part, or with --gather, makes the table")
    return 0


def _scene(options: argparse.Namespace, assignments: Sequence[str] = ()) -> "Scene":
    from fem_seal.scene import Scene

    scene = Scene.from_file(options.scene, [*options.overrides, *assignments])
    for name in ("shape", "seal"):
        if getattr(scene, name) is not None:
            raise InvalidInput(f"a study is of one patch on a grid; take [{name}] out of the scene")
    if scene.total_error is not None:
        raise InvalidInput(
            "a study has its own grids; take accuracy.total out of the scene, and set flow.rtol"
        )
    if not scene.needs_leak_rate:
        raise InvalidInput("output.products names no 'leak_rate': there is nothing to compare")
    return scene


def _gaps(options: argparse.Namespace) -> "dict[str, Patch]":
    """The scene's patches that leak, by the fields that tell them apart; says which do not."""
    from fem_seal.patch import Patch
    from fem_seal.sweep import combinations

    keys, points = combinations(*options.vary, folder=options.scene.parent)
    gaps = {}
    for values in points:
        assignments = [f"{key}={value}" for key, value in zip(keys, values, strict=True)]
        patch = Patch(_scene(options, assignments))
        name = ", ".join(assignments)
        if patch.state == "leaking":
            gaps[name] = patch
        elif options.vary:
            say(f"{name}: {patch.state}, where {WITHOUT_FLOW[patch.state]}")
    if not gaps and options.vary:
        raise InvalidInput(f"none of the {len(points)} gaps leaks: there is nothing to compare")
    if not gaps:
        raise InvalidInput(f"the gap is {patch.state}: {WITHOUT_FLOW[patch.state]}")
    return gaps


def _cross_validation(options: argparse.Namespace) -> Text:
    from fem_seal.film import GridFilm
    from fem_seal.flow_settings import FlowSettings
    from fem_seal.verification.cross_validation import StudiedGap, compare
    from fem_seal.verification.pictures import claims_figure, cross_validation_figure

    patches, gaps = _gaps(options), []
    for patch in patches.values():
        scene = patch.scene
        drop, rtol = scene.drive.pressure_drop, scene.flow.rtol
        setting = FlowSettings(scene.viscosity, drop, rtol=rtol, limits=scene.flow.limits)
        film = narrowed(patch.film, GridFilm, "grid")
        gaps.append(StudiedGap.of_film(film, setting, options.grids))
    with Display() as report:
        results = compare(gaps, out=options.out, work=work_of(options), report=report)
    if results is None:
        return None
    compared = {
        name: ([replace(row, gap=name) for row in rows], bracket)
        for name, (rows, bracket) in zip(patches, results, strict=True)
    }
    rows = [row for of_gap, _ in compared.values() for row in of_gap]
    scenes = [patch.scene for patch in patches.values()]
    of_what = "lifted contact" if any(scene.lift == "resolved" for scene in scenes) else "contact"
    is_given_gap = all(scene.contact is None for scene in scenes)
    title = f"{options.scene.stem}, {'given gap' if is_given_gap else of_what}"

    def write() -> None:
        """Write the table of all methods, and its picture."""
        write_text(options.out / "cross_validation.csv", as_csv(rows))
        path = options.out / "cross_validation.png"
        if options.vary:
            claims_figure(rows, path, title)
        else:
            cross_validation_figure(rows, path, title, compared[""][1])

    parallel.on_root(write)
    slips = any(scene.slip is not None for scene in scenes)
    return _cross_validation_text(compared, slips=slips)


def _cross_validation_text(
    compared: "dict[str, tuple[list[Row], Bounded]]", *, slips: bool
) -> list[str]:
    """Lines of all gaps by their names: the methods, and the guaranteed bounds."""
    text = []
    if slips:
        text.append(
            "no slip    the methods are compared without the slip of the gas: the leak rates are "
            "those of fluid.slip = false"
        )
    for name, (of_gap, bracket) in compared.items():
        text += [*filter(None, [name]), as_text(of_gap, COLUMNS)]
        text.append(f"guaranteed: [{bracket.lower:.4e}, {bracket.upper:.4e}] m^3/s")
    rows = [row for of_gap, _ in compared.values() for row in of_gap]
    for row in rows:
        where = f"{row.gap}: {row.method}" if row.gap else row.method
        if row.reason:
            text.append(f"{where} on {row.squares}: {row.reason}")
        elif row.verdict == "disagrees":
            band = per_cent(present(row.band, "band of an answer that disagrees"))
            text.append(f"{where} on {row.squares}: {row.value:.4e} ± {band} is outside of that")
    wrong = sum(row.verdict == "disagrees" for row in rows)
    return [*text, f"{wrong} of {len(rows)} numbers contradict the guaranteed bounds"]


def _exact(options: argparse.Namespace) -> Text:
    from fem_seal.verification.cross_validation import StudiedGap, compare
    from fem_seal.verification.exact_cases import CASES
    from fem_seal.verification.pictures import cross_validation_figure

    squares = [8 * 2**k for k in range(options.grids)]
    cases = {name: choose(CASES, name, "case") for name in options.cases or CASES}
    gaps = [StudiedGap.of_case(case, squares) for case in cases.values()]
    with Display() as report:
        compared = compare(gaps, out=options.out, work=work_of(options), report=report)
    if compared is None:
        return None

    def write() -> None:
        """Write a table and a picture of each case."""
        for name, (rows, exact) in zip(cases, compared, strict=True):
            write_text(options.out / f"{name}.csv", as_csv(rows))
            cross_validation_figure(rows, options.out / f"{name}.png", name, exact)

    parallel.on_root(write)
    return [
        f"{name}: exactly {case.exact:.6g} ({case.source})\n{as_text(rows, COLUMNS)}\n"
        for (name, case), (rows, _) in zip(cases.items(), compared, strict=True)
    ]


def _trade(options: argparse.Namespace) -> Text:
    from fem_seal.verification.pictures import trade_figure
    from fem_seal.verification.trade import TRADE_COLUMNS, recommend, trade

    scene = _scene(options)
    with Display() as report:
        result = trade(scene, out=options.out, work=work_of(options), report=report)
    if result is None:
        return None
    finer = per_cent(result.uncertainty) if result.uncertainty < inf else "not known"
    advice = (
        f"on the finest grid: {result.reference:.4e} m^3/s; a finer one changes it by: {finer}",
        *recommend(result),
        f"(CPU seconds of this machine, {processor() or machine()})",
    )
    text = [fill(sentence, WIDTH, subsequent_indent="    ") for sentence in advice]

    def write() -> None:
        """Write the table of all runs, the advice and the picture."""
        write_text(options.out / "trade.csv", as_csv(result.points))
        write_text(options.out / "advice.txt", "\n".join([*text, ""]))
        trade_figure(result, options.out / "trade.png")

    parallel.on_root(write)
    if scene.lift != "none":
        dry = "dry        no fluid pressure lifts the solid: leak rates of flow.lift = 'none'"
        text = [dry, *text]
    return [*text, "", as_text(result.points, TRADE_COLUMNS)]
