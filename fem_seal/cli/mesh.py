"""fem-seal mesh: the mesh of a scene's shape, without solving anything."""

import argparse

from fem_seal.cli.options import add_command, add_path, add_scene, add_trust, default_folder
from fem_seal.cli.printing import say
from fem_seal.errors import InvalidInput
from fem_seal.progress import Display


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "mesh",
        _mesh,
        "write and draw the mesh of a scene's [shape]",
        "demos/scenes/flange.toml",
    )
    add_scene(command)
    add_trust(command)
    add_path(command, "--out", "DIR", "folder of the files (results/NAME for NAME.toml)")


def _mesh(options: argparse.Namespace) -> int:
    from fem_seal.drawing import mesh
    from fem_seal.scene import Scene

    scene = Scene.from_file(options.scene, options.overrides)
    if scene.shape is None:
        raise InvalidInput(
            f"{options.scene} has no [shape]; the mesh of a gap on a grid is made while it is "
            "solved: name 'mesh' in output.products of fem-seal run"
        )
    out = options.out or default_folder(options.scene, options.overrides)
    with Display() as report:
        lines, names = mesh(scene, out, report, trust=options.trust)
    say("\n".join([*lines, f"result     {', '.join(names)} in {out}"]))
    return 0
