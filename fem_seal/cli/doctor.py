"""fem-seal doctor and fem-seal schema: checks of the installation, and the schema for editors."""

import argparse
import json

from fem_seal.cli.common import add_command, say
from fem_seal.errors import MissingPackage


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add both commands."""
    command = add_command(
        subparsers,
        "doctor",
        "say what works here, and what to install",
        "fem-seal doctor",
    )
    command.set_defaults(command=_doctor)
    command = add_command(
        subparsers,
        "schema",
        "print the JSON schema of scene files, by which editors complete and check them",
        "fem-seal schema > scene.schema.json",
    )
    command.set_defaults(command=_schema)


def _doctor(options: argparse.Namespace) -> int:
    from fem_seal.doctor import examine, table

    findings = list(examine())
    say(table(findings))
    broken = [finding.name for finding in findings if finding.required and not finding.works]
    if broken:
        raise MissingPackage(f"not working here: {', '.join(broken)}; the table says what to do")
    return 0


def _schema(options: argparse.Namespace) -> int:
    from fem_seal.scene.schema import scene_schema

    say(json.dumps(scene_schema(), indent=2))
    return 0
