"""Options that commands share, and what they mean."""

import argparse
import re
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fem_seal.points import Work
    from fem_seal.scene import Scene

NOT_KEPT = 4  # exit status with --strict if the limit is not surely kept
LONGEST_NAME = 60  # most characters of the name of a result folder


def path_of(text: str) -> Path:
    """Read a path of the command line; an empty one, as of an unset variable, is no folder."""
    if not text:
        raise argparse.ArgumentTypeError("the name is empty")
    return Path(text)


def add_path(
    command: argparse.ArgumentParser,
    name: str,
    metavar: str,
    text: str,
    default: Path | None = None,
) -> None:
    """Add an argument or option that names a file or folder, with its help text."""
    command.add_argument(name, type=path_of, metavar=metavar, help=text, default=default)


def add_scene(
    command: argparse.ArgumentParser, text: str = "the scene file (docs/reference/scene.md)"
) -> None:
    """Add a scene file, with a help text, and changes to it."""
    add_path(command, "scene", "SCENE.toml", text)
    command.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a field, such as flow.rtol=0.02; may be repeated",
    )


def add_statements(command: argparse.ArgumentParser) -> None:
    """Add unit and size of a file of heights, which the file may lack."""
    command.add_argument(
        "--length-unit",
        metavar="UNIT",
        help="unit of the heights, such as um, if the file has none",
    )
    command.add_argument(
        "--size",
        metavar="LX,LY",
        help="nx dx,ny dy, such as '1 mm,1 mm', if the file has none",
    )


def scene_of_heights(path: Path, options: argparse.Namespace) -> "Scene":
    """Scene of a file of heights, with the options of `add_statements` and its --set, if any.

    It subtracts the mean and fills holes. Nothing is pressed: it names a contact that also takes a
    map that does not repeat.
    """
    from fem_seal.scene import Scene
    from fem_seal.scene.files import override

    heights: dict[str, object] = {"kind": "file", "path": str(path)}
    heights |= {"detrend": "mean", "fill": "harmonic"}
    if options.length_unit is not None:
        heights["unit"] = options.length_unit
    if options.size is not None:
        heights["size"] = [side.strip() for side in options.size.split(",")]
    data: dict[str, dict[str, object]] = {
        "surface": heights,
        "contact": {"model": "bearing", "mean_gap": 1.0},
        "output": {"products": ["contact"]},
    }
    for assignment in getattr(options, "overrides", ()):
        data = override(data, assignment)
    surface = data.get("surface")
    if isinstance(surface, dict) and "fill" in surface:
        surface.setdefault("max_missing", 0.99)
    return Scene.from_mapping(data)


def default_folder(scene: Path, overrides: Sequence[str]) -> Path:
    """Name the result folder of a scene file after the file and its changed settings.

    Results with different settings are thus kept side by side. Settings of [output] do not count,
    since they do not change the result; of a field that is set twice the last setting counts.
    """
    settings = {text.partition("=")[0].strip(): text for text in overrides}
    changes = [text for field, text in settings.items() if not field.startswith("output.")]
    words = [re.sub(r"[^\w.=+-]+", "_", text) for text in changes]
    name = "-".join([scene.stem, *words])
    if len(name) > LONGEST_NAME:
        name = f"{name[:LONGEST_NAME]}-{sha256(name.encode('utf-8', 'replace')).hexdigest()[:8]}"
    return Path("results") / name


def add_trust(command: argparse.ArgumentParser) -> None:
    """Add --trust, by which the user allows gmsh to run a geometry; a scene cannot allow it."""
    command.add_argument(
        "--trust",
        action="store_true",
        help="let gmsh run the scene's .geo file, a program with your rights",
    )


def add_jobs(
    command: argparse.ArgumentParser, purpose: str = "", default: int | None = None
) -> None:
    """Add --jobs, its help with a purpose, and --memory.

    Left out, the number of jobs is the default; None: as many as save time (`Work.jobs_for`).
    """
    usual = "as many as save time" if default is None else default
    text = f"processes of this machine{purpose} (default: {usual})"
    command.add_argument("--jobs", type=int, default=default, metavar="N", help=text)
    command.add_argument(
        "--memory",
        type=float,
        metavar="GB",
        help="memory by which the number of jobs is chosen (default: what is free)",
    )


def work_of(options: argparse.Namespace) -> "Work":
    """Distribution of points over processes, from the options of `add_jobs` or `add_work`."""
    from fem_seal.points import Work

    memory = None if options.memory is None else 1e9 * options.memory
    shared = {name: vars(options)[name] for name in ("part", "gather") if name in options}
    return Work(options.jobs, memory=memory, **shared)


def add_work(command: argparse.ArgumentParser, default: int | None = 1) -> None:
    """Add the options that distribute points over processes."""
    add_jobs(command, default=default)
    command.add_argument(
        "--part",
        type=part_of_points,
        default=(1, 1),
        metavar="K/N",
        help="only share K of N of the work, for job arrays, such as 2/8 (1/1)",
    )
    command.add_argument(
        "--gather",
        action="store_true",
        help="compute nothing: make the tables of the points computed so far",
    )


def part_of_points(text: str) -> tuple[int, int]:
    """Read K/N."""
    try:
        k, n = map(int, text.split("/"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form K/N, such as 2/8") from None
    return k, n


def add_output(command: argparse.ArgumentParser, default: str) -> None:
    """Add the result folder."""
    add_path(command, "--out", "DIR", f"result folder ({default})")
    command.add_argument(
        "--overwrite", action="store_true", help="replace another scene's result in DIR"
    )


def add_for_programs(command: argparse.ArgumentParser) -> None:
    """Add the options for programs that read the result or the exit status."""
    command.add_argument(
        "--json", action="store_true", help="print the content of result.json in place of words"
    )
    command.add_argument(
        "--strict",
        action="store_true",
        help=f"exit status {NOT_KEPT} where the verdict is above limit or undecided",
    )
