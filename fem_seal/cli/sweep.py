"""fem-seal sweep: a scene over the values of some of its fields."""

import argparse
from pathlib import Path

from fem_seal import parallel
from fem_seal.cli.common import add_command, add_output, add_scene, say
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
    with Display(parallel.is_root()) as report:
        tally = sweep(
            options.scene,
            [Axis.parse(text) for text in options.vary],
            out,
            overrides=options.overrides,
            overwrite=options.overwrite,
            report=report,
        )
    say(f"{tally.points} points, {tally.computed} of them computed now, in {out}/sweep.csv")
    if tally.not_converged:
        message = f"{tally.not_converged} points did not converge; column reason says why"
        return parallel.fail(f"fem-seal: {message}", NotConverged.exit_status)
    return 0
