"""fem-seal report: a result folder as one HTML page."""

import argparse

from fem_seal.cli.options import add_path
from fem_seal.cli.printing import say


def add(command: argparse.ArgumentParser) -> None:
    """Add the folder."""
    add_path(command, "folder", "DIR", "folder of fem-seal run or leak --out")
    command.set_defaults(command=_report)


def _report(options: argparse.Namespace) -> int:
    from fem_seal.render.report import report

    say(f"{report(options.folder)}")
    return 0
