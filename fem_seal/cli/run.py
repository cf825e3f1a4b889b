"""fem-seal run: the products of a scene."""

import argparse

from fem_seal.cli.options import (
    add_for_programs,
    add_jobs,
    add_output,
    add_scene,
    add_trust,
    default_folder,
    work_of,
)
from fem_seal.cli.printing import origin_of, print_result, require_limit, say
from fem_seal.errors import InvalidInput
from fem_seal.progress import Display


def add(command: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_scene(command)
    add_trust(command)
    add_jobs(command, ", for the patches of a [seal]")
    command.add_argument(
        "--dry-run",
        action="store_true",
        help="print the expected time and memory; solve and write nothing",
    )
    add_output(command, "results/NAME for NAME.toml, and -KEY=VALUE for each --set")
    add_for_programs(command)
    command.set_defaults(command=_run)


def _run(options: argparse.Namespace) -> int:
    from fem_seal.scene import Scene
    from fem_seal.scene.files import scene_text
    from fem_seal.solved import run

    if options.dry_run:
        return _predict(options)
    text = scene_text(options.scene)
    scene = Scene.from_text(text, options.scene, options.overrides)
    require_limit(options, scene)
    out = options.out or default_folder(options.scene, options.overrides)
    with Display() as report:
        result = run(
            scene,
            out,
            overwrite=options.overwrite,
            report=report,
            trust=options.trust,
            work=work_of(options),
            origin=origin_of(options, text),
        )
    return print_result(result, out, options)


def _predict(options: argparse.Namespace) -> int:
    from fem_seal.prediction import predicted
    from fem_seal.scene import Scene
    from fem_seal.solved import require_shared

    for name in ("json", "strict", "out", "overwrite"):
        if getattr(options, name):
            raise InvalidInput(f"--{name} acts on a result, and --dry-run makes none; leave it out")
    scene, work = Scene.from_file(options.scene, options.overrides), work_of(options)
    require_shared(scene, work)
    with Display() as report:
        report("predicting time and memory", "")
        expected = predicted(scene, work=work)
    say(str(expected))
    return 0
