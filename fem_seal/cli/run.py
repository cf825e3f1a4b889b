"""fem-seal run: the products of a scene."""

import argparse

from fem_seal.cli.common import (
    add_command,
    add_jobs,
    add_output,
    add_scene,
    add_trust,
    default_folder,
    jobs_of,
    run_and_print,
)


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "run",
        "compute the products of a scene",
        "fem-seal run demos/scenes/first.toml --set flow.rtol=0.02",
    )
    add_scene(command)
    add_trust(command)
    add_jobs(command, "processes of this machine, for the patches of a [seal] (1)")
    add_output(command, "results/NAME for NAME.toml, and -KEY=VALUE for each --set")
    command.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    from fem_seal.scene import Scene

    scene = Scene.from_file(options.scene, options.overrides)
    out = options.out or default_folder(options.scene, options.overrides)
    return run_and_print(scene, out, options.overwrite, options.trust, jobs_of(options))
