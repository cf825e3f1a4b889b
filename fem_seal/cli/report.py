"""fem-seal report: a result folder as one HTML page."""

import argparse
from pathlib import Path

from fem_seal.cli.common import add_command, say


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "report",
        "gather a result folder in one HTML page, pictures inside",
        "fem-seal report results/first",
    )
    command.add_argument(
        "folder", type=Path, metavar="DIR", help="folder of fem-seal run or leak --out"
    )
    command.set_defaults(command=_report)


def _report(options: argparse.Namespace) -> int:
    from fem_seal.render.report import report

    say(f"{report(options.folder)}")
    return 0
