"""The printed result of a scene, and its exit status."""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from fem_seal import parallel
from fem_seal.cli.options import NOT_KEPT
from fem_seal.errors import InvalidInput, NotConverged, printable

if TYPE_CHECKING:
    from fem_seal.results import Result
    from fem_seal.results.result import Origin
    from fem_seal.scene import Scene

WIDTH = 100  # characters of a printed line


def require_limit(options: argparse.Namespace, scene: "Scene") -> None:
    """Refuse --strict without a limit before anything is computed."""
    if options.strict and scene.limit is None:
        raise InvalidInput("--strict needs a limit: limit.leak_rate of the scene, such as '1 ml/h'")


def origin_of(options: argparse.Namespace, scene_text: str | None = None) -> "Origin":
    """The words of the command, and the text of the scene file, as result.json keeps them."""
    from fem_seal.results.result import Origin

    # result.json is UTF-8: bytes of other names become \xe9 and the like.
    words = (os.fsencode(word).decode("utf-8", "backslashreplace") for word in options.command_line)
    return Origin(command=tuple(words), scene_text=scene_text)


def print_result(
    result: "Result", out: Path | None, options: argparse.Namespace, head: Sequence[str] = ()
) -> int:
    """Print the numbers a user asked for and give the exit status."""
    if parallel.is_root():
        if options.json:
            # In ASCII, which a terminal of any encoding can show.
            say(json.dumps(json.loads(result.to_json()), indent=2))
        else:
            say("\n".join((*head, *summary(result, out))))
    if not result.converged:
        raise NotConverged(result.reason)
    decision = None if result.verdict is None else result.verdict.decision
    if options.strict and decision in ("above limit", "undecided"):
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
