"""fem-seal letter: the 2012 letter on percolation and leakage, reproduced with error bars."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.cli.common import add_command, add_work, prepare_workers, say, work_of
from fem_seal.cli.percolation import add_search, numbers, require_one_process, search_of
from fem_seal.errors import NotConverged

if TYPE_CHECKING:
    from fem_seal.letter.campaign import Letter, Plan

# Parts that can be left out: finer contact grids, the start of the cascade, finite differences.
SKIPPED = ("grids", "cascade", "differences")
# Models whose points can be chosen.
POINTS = ("bearing", "elastic")


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "letter",
        "reproduce the 2012 letter on percolation and leakage of rough contacts",
        "fem-seal letter --size 128 --seeds 1",
    )
    command.add_argument(
        "--size", type=int, default=256, metavar="N", help="samples along a side (256)"
    )
    command.add_argument("--seeds", type=int, default=3, metavar="N", help="seeds 1 to N (3)")
    command.add_argument(
        "--hurst", type=float, default=0.8, metavar="H", help="Hurst exponent (0.8)"
    )
    command.add_argument(
        "--short", type=float, default=1.0, metavar="SAMPLES", help="short cut-off (1)"
    )
    command.add_argument(
        "--long", type=float, default=0.125, metavar="PART", help="long cut-off / side (0.125)"
    )
    command.add_argument(
        "--rtol", type=float, default=0.1, help="width of the certified brackets (0.1)"
    )
    command.add_argument(
        "--refine",
        type=int,
        default=2,
        metavar="FACTOR",
        choices=(2, 4),
        help="finest contact grid for its error: 2 or 4 times the samples (2)",
    )
    command.add_argument(
        "--skip",
        nargs="+",
        default=(),
        metavar="PART",
        choices=SKIPPED,
        help=f"leave the costliest parts out, of {', '.join(SKIPPED)}; a later run adds them",
    )
    add_search(command)
    for model in POINTS:
        command.add_argument(
            f"--{model}-areas",
            type=numbers(float),
            metavar="V1,V2,…",
            help=f"A/A0 of the {model} points of Fig. 3, beside first contact (0.02 to closing)",
        )
    command.add_argument(
        "--threads", type=int, default=1, metavar="N", help="threads of the contact (1)"
    )
    add_work(command, "point")
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="result folder; done points are kept (results/letter-N)",
    )
    command.set_defaults(command=_letter)


def plan_of(options: argparse.Namespace) -> "Plan":
    """Plan from the options; raise InvalidInput if it cannot be computed."""
    from fem_seal.letter.campaign import AREAS, REFINED_AREAS, Plan
    from fem_seal.letter.surfaces import RoughCase

    chosen = {model: getattr(options, f"{model}_areas") for model in POINTS}
    return Plan(
        RoughCase(options.size, options.hurst, options.short, options.long),
        seeds=options.seeds,
        rtol=options.rtol,
        grid_factors=tuple(f for f in (1, 2, 4) if f <= options.refine),
        search=search_of(options),
        areas={model: tuple(areas or AREAS[model]) for model, areas in chosen.items()},
        refined=() if "grids" in options.skip else REFINED_AREAS,
        cascade="cascade" not in options.skip,
        differences="differences" not in options.skip,
        threads=options.threads,
    )


def _letter(options: argparse.Namespace) -> int:
    require_one_process("letter")
    prepare_workers(options, "fem_seal.letter.campaign")
    # DOLFINx 0.5 to 0.7 must be loaded before VTK.
    from fem_seal import fenicsx  # noqa: F401
    from fem_seal.files import locked_folder, write_text
    from fem_seal.letter.campaign import compute_points_of, letter
    from fem_seal.letter.page import page
    from fem_seal.progress import Display
    from fem_seal.render import letter as figures
    from fem_seal.render.offscreen import require_gl

    require_gl()
    plan = plan_of(options)
    out = options.out or Path("results") / f"letter-{options.size}"
    work = work_of(options)
    with locked_folder(out, shared=True), Display() as report:
        missing = compute_points_of(plan, out, report, work).missing
        if missing:
            message = f"{missing} points of the letter are not computed yet"
            if work.gather:
                return parallel.fail(f"fem-seal: {message}", NotConverged.exit_status)
            say(f"{message}; the same command without --part, or with --gather, makes the figures")
            return 0
        result, data = letter(plan, out, report)
        report("figures", "")
        write_text(out / "letter.md", page(result))
        paths = [
            *figures.contact_figure(data.contacts, out),
            *figures.flow_figure(data.flows, out),
            *figures.current_figure(data.currents, data.persson, out),
            *(figures.error_figure(data.errors, out) if data.errors else ()),
        ]
    say("\n".join(summary(result)))
    say(f"letter.json, letter.md, {', '.join(path.name for path in paths)} in {out}")
    return 0


def summary(result: "Letter") -> list[str]:
    """Lines of the printed result; letter.json has all numbers."""
    from fem_seal.cli.percolation import difference_line, line

    agreement = result.agreement
    lines = [line(row) for row in result.thresholds]
    lines += [difference_line(row) for row in result.differences]
    ratios = result.decades
    lines += [
        f"flow density at A/A0 = 0.2, bearing over elastic: 10^{ratios['total']:.2f} in total, "
        f"10^{ratios['body']:.2f} in the 99.9 % quantile, 10^{ratios['peak']:.2f} at the peak",
        f"currents over {agreement.decades:.1f} decades"
        + (
            f"; finite differences within both bands at {agreement.bands_overlap} of "
            f"{agreement.compared} points"
            if agreement.compared
            else ""
        ),
        f"up to 0.8 A*: Bruggeman within a factor {agreement.bruggeman_bearing:.2f} (bearing), "
        f"modified within {agreement.modified_elastic:.2f} with A* = 0.42 and "
        f"{agreement.modified_measured_elastic:.2f} with A* measured (elastic)",
    ]
    lines += [
        f"cascade start, {start.model} A/A0 = {start.area:g}: energy error "
        f"{start.mean_field_energy:.2g} to {start.cascade_energy:.2g}"
        + (f", {start.rms_reduction:.3g} times less pressure error" if start.rms_reduction else "")
        for start in result.cascade
    ]
    return lines
