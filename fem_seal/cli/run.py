"""fem-seal run: the products of a scene."""

import argparse

from fem_seal.cli.common import (
    add_command,
    add_for_programs,
    add_jobs,
    add_output,
    add_scene,
    add_trust,
    default_folder,
    run_and_print,
    say,
    work_of,
)
from fem_seal.errors import InvalidInput


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
    command.add_argument(
        "--dry-run", action="store_true", help="print time and memory; solve and write nothing"
    )
    add_output(command, "results/NAME for NAME.toml, and -KEY=VALUE for each --set")
    add_for_programs(command)
    command.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    from fem_seal.scene import Scene

    scene, work = Scene.from_file(options.scene, options.overrides), work_of(options)
    if work.jobs > 1 and scene.seal is None:
        raise InvalidInput(
            f"--jobs = {work.jobs} distributes the patches of a [seal], and this scene has none; "
            "leave it out, or start the command by mpirun"
        )
    if options.dry_run:
        from fem_seal.prediction import predicted

        say(str(predicted(scene, jobs=work.jobs)))
        return 0
    out = options.out or default_folder(options.scene, options.overrides)
    text = options.scene.read_text(encoding="utf-8-sig")
    return run_and_print(scene, out, options, trust=options.trust, work=work, scene_text=text)
