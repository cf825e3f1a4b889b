"""fem-seal percolation: where bearing and elastic contacts percolate."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.cli.common import add_command, add_work, prepare_workers, say, work_of
from fem_seal.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from fem_seal.letter.seed_thresholds import Search
    from fem_seal.letter.threshold_rows import DifferenceRow, ThresholdRow


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "percolation",
        "find the percolation thresholds of rough contacts",
        "fem-seal percolation --n 64,128 --seeds 4",
    )
    lists = (
        ("n", numbers(int), "256", "samples along a side"),
        ("hurst", numbers(float), "0.8", "Hurst exponents"),
        ("short", numbers(float), "4", "short cut-offs, in samples"),
        ("long", numbers(float), "0.125", "long cut-offs, in parts of the side"),
    )
    for name, kind, default, text in lists:
        command.add_argument(
            f"--{name}",
            type=kind,
            default=kind(default),
            metavar="V1,V2,…",
            help=f"{text} ({default})",
        )
    command.add_argument("--seeds", type=int, default=4, metavar="N", help="seeds 1 to N (4)")
    add_search(command)
    command.add_argument(
        "--threads", type=int, default=1, metavar="N", help="threads of the contact (1)"
    )
    add_work(command, "surface")
    command.add_argument(
        "--out",
        type=Path,
        default=Path("results/percolation"),
        metavar="DIR",
        help="result folder (results/percolation)",
    )
    command.set_defaults(command=_percolation)


def add_search(command: argparse.ArgumentParser) -> None:
    """Add the options of the search for thresholds."""
    command.add_argument(
        "--edges",
        default="open,periodic",
        metavar="LIST",
        help="of open, cylinder and periodic: what spanning means (open,periodic)",
    )
    command.add_argument(
        "--resolution", type=float, default=0.002, metavar="A", help="resolution of A/A0 (0.002)"
    )
    command.add_argument(
        "--no-flow", action="store_true", help="leave out the flow through the constriction"
    )


def search_of(options: argparse.Namespace) -> "Search":
    """Search from the options of `add_search`."""
    from fem_seal.letter.seed_thresholds import Search

    edges = tuple(name.strip() for name in options.edges.split(","))
    return Search(options.resolution, edges, not options.no_flow)


def numbers(kind: type) -> Callable[[str], list]:
    """Function that reads a list with commas between."""

    def read(text: str) -> list:
        return [kind(part) for part in text.split(",")]

    read.__name__ = f"list of {kind.__name__}"  # for argparse's message
    return read


def seeds_up_to(count: int) -> range:
    """Seeds 1 to count."""
    if count < 1:
        raise InvalidInput(f"--seeds must be at least 1, got {count}")
    return range(1, count + 1)


def require_one_process(command: str) -> None:
    """Refuse mpirun: these studies compute many small problems, each by one process."""
    if parallel.processes() > 1:
        raise InvalidInput(
            f"fem-seal {command} solves each point in one process; start it without mpirun"
        )


def _percolation(options: argparse.Namespace) -> int:
    from itertools import product

    require_one_process("percolation")
    prepare_workers(options, "fem_seal.letter.percolation")
    seeds = seeds_up_to(options.seeds)
    from fem_seal.files import locked_folder
    from fem_seal.letter.percolation import TABLE_FILE, percolation
    from fem_seal.letter.surfaces import MODELS, RoughCase
    from fem_seal.progress import Display
    from fem_seal.render.thresholds import threshold_figure

    cases = [
        RoughCase(n, hurst, short, long)
        for n, hurst, short, long in product(options.n, options.hurst, options.short, options.long)
    ]
    search, work = search_of(options), work_of(options)
    with locked_folder(options.out, shared=True), Display() as report:
        study = percolation(
            cases,
            seeds,
            options.out,
            search=search,
            threads=options.threads,
            work=work,
            report=report,
        )
        if study.rows:
            threshold_figure(study.rows, options.out)
    say("\n".join([*map(line, study.rows), *map(difference_line, study.differences)]))
    say(f"{len(study.seeds)} surfaces in {options.out}/{TABLE_FILE} and thresholds.png")
    expected = len(cases) * len(MODELS) * len(seeds)
    if work.gather and len(study.seeds) < expected:
        message = f"{expected - len(study.seeds)} of {expected} surfaces are not computed yet"
        return parallel.fail(f"fem-seal: {message}", NotConverged.exit_status)
    return 0


def line(row: "ThresholdRow") -> str:
    """Line on one threshold."""
    spread = "" if row.spread is None else f" ± {row.spread:.4f}"
    corrected = "" if row.corrected is None else f", perimeter-corrected {row.corrected:.4f}"
    corrected += f", transition ± {row.half_width:.4f}"
    return (
        f"{row.model:8} n {row.n} H {row.hurst:g} short {row.short:g} long {row.long:g} "
        f"{row.edges:8} {row.pair:13} A*/A0 = {row.threshold:.4f}{spread}{corrected}"
    )


def difference_line(row: "DifferenceRow") -> str:
    """Line on the amount by which elastic deformation lowers a threshold."""
    spread = "" if row.spread is None else f" ± {row.spread:.4f}"
    return (
        f"n {row.n} H {row.hurst:g} short {row.short:g} long {row.long:g} {row.edges:8} "
        f"{row.pair:13} elasticity lowers A*/A0 by {row.difference:.4f}{spread}"
    )
