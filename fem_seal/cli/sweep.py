"""fem-seal sweep: a scene over the values of some of its fields."""

import argparse
import csv
from pathlib import Path

from fem_seal import parallel
from fem_seal.cli.common import add_command, add_output, add_scene, add_trust, say
from fem_seal.errors import NotConverged


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "sweep",
        "compute a scene over the values of some fields",
        "fem-seal sweep demos/scenes/first.toml --vary contact.pressure=0.1MPa,0.2MPa",
    )
    add_scene(command)
    add_trust(command)
    command.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="KEY=V1,V2,…",
        help="a field and its values; given more than once, all combinations are computed",
    )
    add_output(command, "results/NAME-sweep for NAME.toml; done points are kept")
    command.set_defaults(command=_sweep)


def _sweep(options: argparse.Namespace) -> int:
    from fem_seal.progress import Display
    from fem_seal.sweep import Axis, sweep
    from fem_seal.sweep.table import TABLE_FILE

    out = options.out or Path("results") / f"{options.scene.stem}-sweep"
    with Display(parallel.is_root()) as report:
        tally = sweep(
            options.scene,
            [Axis.parse(text) for text in options.vary],
            out,
            overrides=options.overrides,
            overwrite=options.overwrite,
            report=report,
            trust=options.trust,
        )
    say("\n".join(_points(out / TABLE_FILE)))
    say(f"{tally.points} points, {tally.computed} of them computed now, in {out}/sweep.csv")
    if tally.not_converged:
        message = f"{tally.not_converged} points did not converge; column reason says why"
        return parallel.fail(f"fem-seal: {message}", NotConverged.exit_status)
    return 0


def _points(path: Path) -> list[str]:
    """One line a point of the table, for people."""
    from fem_seal.sweep.table import COLUMNS

    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    names = [", ".join(f"{k}={v}" for k, v in row.items() if k not in COLUMNS) for row in rows]
    width = max(map(len, names), default=0)
    return [f"{name:{width}}  {_found(row)}" for name, row in zip(names, rows, strict=True)]


def _found(row: dict[str, str]) -> str:
    from fem_seal.leak_rate import rate_text

    if not row["state"]:
        return f"not converged: {row['reason']}"
    area = f"{100 * float(row['contact_area_fraction']):.3g} % in contact"
    if row["state"] == "sealed" or not row["leak_rate"]:
        return f"{row['state']}, {area}"
    value, lower, upper = (
        float(row[name]) if row[name] else None for name in ("leak_rate", "lower", "upper")
    )
    return f"{row['decision']}, {rate_text(value, lower, upper, 'm^3/s')}, {area}"
