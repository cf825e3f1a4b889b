"""fem-seal mesh: the mesh of a scene's shape, without solving anything."""

import argparse

from fem_seal.cli.options import add_path, add_scene, add_trust, default_folder
from fem_seal.cli.printing import say
from fem_seal.progress import Display


def add(command: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_scene(command)
    add_trust(command)
    add_path(command, "--out", "DIR", "folder of the files (results/NAME for NAME.toml)")
    command.set_defaults(command=_mesh)


def _mesh(options: argparse.Namespace) -> int:
    from fem_seal.drawing import mesh
    from fem_seal.scene import Scene

    scene = Scene.from_file(options.scene, options.overrides)
    out = options.out or default_folder(options.scene, options.overrides)
    with Display() as report:
        lines, names = mesh(scene, out, report, trust=options.trust)
    say("\n".join([*lines, f"result     {', '.join(names)} in {out}"]))
    return 0
