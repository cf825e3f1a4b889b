"""fem-seal schema: the schema of scene files, for editors."""

import argparse
import json

from fem_seal.cli.printing import say


def add(command: argparse.ArgumentParser) -> None:
    """Let the command print the schema."""
    command.set_defaults(command=_schema)


def _schema(options: argparse.Namespace) -> int:
    from fem_seal.scene.schema import scene_schema

    say(json.dumps(scene_schema(), indent=2))
    return 0
