"""fem-seal new: a commented scene for a file of heights."""

import argparse
import shlex
from pathlib import Path

from fem_seal.cli.options import add_path, add_statements, scene_of_heights
from fem_seal.cli.printing import say
from fem_seal.errors import InvalidInput, present
from fem_seal.files import write_text
from fem_seal.progress import Display


def add(command: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_path(command, "file", "FILE", "heights or profiles (docs/guide/surfaces.md)")
    add_path(command, "--out", "SCENE.toml", "the new scene (FILE's name, in this folder)")
    add_statements(command)
    command.set_defaults(command=_new)


def _new(options: argparse.Namespace) -> int:
    from fem_seal.new_scene import new_scene

    stated = present(scene_of_heights(options.file, options).measured_map, "map").stated
    out = options.out or Path(f"{options.file.stem}.toml")
    if out.exists() and out != options.file:  # which is a scene, as new_scene says
        raise InvalidInput(f"{out} is there already; delete it, or name another one by --out")
    with Display() as report:
        report(f"reading {options.file}", "")
        new = new_scene(options.file, out.parent, stated)
    write_text(out, new.text)
    lines = [f"{options.file}: {'; '.join(new.facts)}"]
    if new.needed:
        missing = " and ".join(f"surface.{name}" for name in new.needed)
        lines.append(f"{out} still needs {missing}, which the file does not say")
    lines += [
        f'fill in what is marked "yours" in {out}, then look and run:',
        f"    {shlex.join(['fem-seal', 'surface', str(out), '--out', 'surface.png'])}",
        f"    {shlex.join(['fem-seal', 'run', str(out)])}",
    ]
    say("\n".join(lines))
    return 0
