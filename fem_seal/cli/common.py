"""Options that commands share, the run of a scene, and its printed result."""

import argparse
import json
import os
import re
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.errors import InvalidInput, NotConverged, printable
from fem_seal.progress import Display

if TYPE_CHECKING:
    from fem_seal.points import Work
    from fem_seal.results import Result
    from fem_seal.scene import Scene

NOT_KEPT = 4  # exit status with --strict if the limit is not surely kept
WIDTH = 100  # characters of a printed line
LONGEST_NAME = 60  # most characters of the name of a result folder


def add_command(
    subparsers: argparse._SubParsersAction, name: str, purpose: str, example: str
) -> argparse.ArgumentParser:
    """Add a command with its help and an example."""
    return subparsers.add_parser(
        name,
        help=purpose,
        description=f"{purpose[0].upper()}{purpose[1:]}.",
        epilog=f"Example: {example}",
    )


def add_moved(subparsers: argparse._SubParsersAction, scripts: dict[str, str]) -> None:
    """Add commands that are scripts now; with any words behind, each names its script."""

    def refuse(options: argparse.Namespace) -> int:
        """Name the script."""
        raise InvalidInput(
            f"{options.moved} is a script now: {scripts[options.moved]}, from a checkout of the "
            "project (docs/theory/letter.md, docs/guide/pictures.md)"
        )

    for name in scripts:
        # With another prefix character options are words like any other.
        command = subparsers.add_parser(name, add_help=False, prefix_chars="\0")
        command.add_argument("words", nargs="*")
        command.set_defaults(command=refuse, moved=name)


def add_scene(
    command: argparse.ArgumentParser, text: str = "the scene file (docs/reference/scene.md)"
) -> None:
    """Add a scene file, with a help text, and changes to it."""
    command.add_argument("scene", type=Path, metavar="SCENE.toml", help=text)
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

    heights: dict[str, object] = {"kind": "file", "path": str(path), "max_missing": 0.99}
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
    return Scene.from_mapping(data)


def default_folder(scene: Path, overrides: Sequence[str]) -> Path:
    """Name the result folder of a scene file after the file and its changed settings.

    Results with different settings are thus kept side by side. Settings of [output] do not count,
    since they do not change the result.

    >>> default_folder(Path("first.toml"), ["flow.rtol=0.02", "output.products=['contact']"])
    PosixPath('results/first-flow.rtol=0.02')
    """
    changes = [text for text in overrides if not text.strip().startswith("output.")]
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


def add_jobs(command: argparse.ArgumentParser, jobs: str) -> None:
    """Add --jobs and --memory; `jobs` is the help of the former."""
    command.add_argument("--jobs", type=int, default=1, metavar="N", help=jobs)
    command.add_argument(
        "--memory",
        type=float,
        metavar="GB",
        help="most memory of all jobs together (what the machine has available)",
    )


def work_of(options: argparse.Namespace) -> "Work":
    """Distribution of points over processes, from the options of `add_jobs` or `add_work`."""
    from fem_seal.points import Work

    memory = None if options.memory is None else int(1e9 * options.memory)
    shared = {name: vars(options)[name] for name in ("part", "gather") if name in options}
    return Work(options.jobs, memory=memory, **shared)


def add_work(command: argparse.ArgumentParser, noun: str) -> None:
    """Add the options that distribute points over processes; a part is every N-th `noun`."""
    add_jobs(command, "processes of this machine (1)")
    command.add_argument(
        "--part",
        type=part,
        default=(1, 1),
        metavar="K/N",
        help=f"only every N-th {noun} from the K-th on, for job arrays (1/1)",
    )
    command.add_argument(
        "--gather",
        action="store_true",
        help="compute nothing: write the tables of the finished points",
    )


def part(text: str) -> tuple[int, int]:
    """Read K/N."""
    try:
        k, n = map(int, text.split("/"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form K/N, such as 2/8") from None
    return k, n


def prepare_workers(options: argparse.Namespace, module: str) -> None:
    """Let the workers of --jobs import a module while this process imports it."""
    if options.jobs > 1 and not options.gather:
        from fem_seal.points.farm import preload

        preload([module])


def add_output(command: argparse.ArgumentParser, default: str) -> None:
    """Add the result folder."""
    command.add_argument("--out", type=Path, metavar="DIR", help=f"result folder ({default})")
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


def require_limit(options: argparse.Namespace, scene: "Scene") -> None:
    """Refuse --strict without a limit before anything is computed."""
    if options.strict and scene.limit is None:
        raise InvalidInput("--strict needs a limit: limit.leak_rate of the scene, such as '1 ml/h'")


def run_and_print(
    scene: "Scene",
    out: Path,
    options: argparse.Namespace,
    *,
    trust: bool = False,
    work: "Work | None" = None,
    scene_text: str | None = None,
    head: Sequence[str] = (),
) -> int:
    """Run a scene into a folder, print its result below a head and give the exit status."""
    from fem_seal.results.result import Origin
    from fem_seal.solved import run

    require_limit(options, scene)
    # result.json is UTF-8: bytes of other names become \xe9 and the like.
    words = (os.fsencode(word).decode("utf-8", "backslashreplace") for word in options.command_line)
    origin = Origin(tuple(words), scene_text)
    with Display(parallel.is_root()) as report:
        result = run(
            scene,
            out,
            overwrite=options.overwrite,
            report=report,
            trust=trust,
            work=work,
            origin=origin,
        )
    return print_result(result, out, options, head)


def print_result(
    result: "Result", out: Path | None, options: argparse.Namespace, head: Sequence[str] = ()
) -> int:
    """Print the numbers a user asked for and give the exit status."""
    if parallel.is_root():
        if options.json:
            say(json.dumps(json.loads(result.to_json()), indent=2))
        else:
            say("\n".join((*head, *summary(result, out))))
    if not result.converged:
        return parallel.fail(f"fem-seal: {result.reason}", NotConverged.exit_status)
    decision = None if result.verdict is None else result.verdict.decision
    if options.strict and decision in ("above limit", "undecided", "lifted off"):
        return parallel.fail(f"fem-seal: {decision} (--strict)", NOT_KEPT)
    return 0


def say(text: str) -> None:
    """Print to standard output, from the first process only."""
    if parallel.is_root():
        print(printable(text), flush=True)  # noqa: T201 (the output of the command)


def summary(result: "Result", out: Path | None) -> list[str]:
    """Lines of the printed result; result.json has all digits."""
    from fem_seal.results.words import summary_of

    lines = [
        fill(
            text,
            WIDTH,
            initial_indent=f"{label:10} ",
            subsequent_indent=" " * 11,
            break_long_words=False,
            break_on_hyphens=False,
        )
        for label, text in summary_of(result)
    ]
    if out is not None:
        lines.append(f"result     {', '.join(('result.json', *result.files))} in {out}")
    return lines
