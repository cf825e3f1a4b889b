"""fem-seal sweep: a scene over the values of some of its fields."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.cli.common import add_command, add_output, add_scene, add_trust, say
from fem_seal.errors import NotConverged

if TYPE_CHECKING:
    from fem_seal.sweep import Point


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

    out = options.out or Path("results") / f"{options.scene.stem}-sweep"
    axes = [Axis.parse(text) for text in options.vary]
    with Display(parallel.is_root()) as report:
        tally = sweep(
            options.scene,
            axes,
            out,
            overrides=options.overrides,
            overwrite=options.overwrite,
            report=report,
            trust=options.trust,
        )
    names = [
        ", ".join(f"{axis.key}={value}" for axis, value in zip(axes, point.values, strict=True))
        for point in tally.table
    ]
    width = max(map(len, names), default=0)
    for name, point in zip(names, tally.table, strict=True):
        say(f"{name:{width}}  {_words(point)}")
    say(f"{tally.points} points, {tally.computed} of them computed now, in {out}/sweep.csv")
    if tally.failed:
        message = f"{tally.failed} of {tally.points} points failed or did not converge"
        return parallel.fail(
            f"fem-seal: {message}; column reason says why", NotConverged.exit_status
        )
    return 0


def _words(point: "Point") -> str:
    """Say what a point amounts to, for people."""
    from fem_seal.leak_rate import rate_text

    numbers = point.numbers
    if not numbers["state"]:
        return f"no result: {numbers['reason']}"
    area = f"{100 * numbers['contact_area_fraction']:.3g} % in contact"
    if numbers["state"] == "sealed" or numbers["leak_rate"] is None:
        return f"{numbers['state']}, {area}"
    rate = rate_text(numbers["leak_rate"], numbers["lower"], numbers["upper"], "m^3/s")
    return f"{numbers['decision']}, {rate}, {area}"
