"""fem-seal schema: the JSON schema of scene files, for editors."""

import argparse
import json

from fem_seal.cli.common import add_command, say


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "schema",
        "print the JSON schema of scene files, by which editors complete and check them",
        "fem-seal schema > scene.schema.json",
    )
    command.set_defaults(command=_schema)


def _schema(options: argparse.Namespace) -> int:
    from fem_seal.scene.schema import scene_schema

    say(json.dumps(scene_schema(), indent=2))
    return 0
