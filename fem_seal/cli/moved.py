"""Commands that have become scripts of demos/: each ends with a sentence that names its script."""

import argparse

from fem_seal.errors import InvalidInput

COMMANDS = {
    "letter": "python -m demos.letter.reproduce --size 256",
    "percolation": "python -m demos.letter.reproduce --only thresholds",
}
STUDIES = {
    "saddle": "python demos/closing_saddle.py",
    "closing": "python demos/closing_contact.py",
}


def add(subparsers: argparse._SubParsersAction, moved: dict[str, str]) -> None:
    """Add commands or studies by the scripts that they are now; any words behind are accepted."""
    for name, script in moved.items():
        # With another prefix character options are words like any other.
        command = subparsers.add_parser(name, add_help=False, prefix_chars="\0")
        command.add_argument("words", nargs="*")
        command.set_defaults(command=_refuse, moved=name, script=script)


def _refuse(options: argparse.Namespace) -> int:
    raise InvalidInput(
        f"{options.moved} is a script now: {options.script}, from a checkout of the project "
        "(docs/theory/letter.md, docs/guide/pictures.md)"
    )
