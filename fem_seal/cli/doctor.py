"""fem-seal doctor: checks of the installation, and remedies."""

import argparse

from fem_seal.cli.common import add_command, say
from fem_seal.errors import MissingPackage


def add(subparsers: argparse._SubParsersAction) -> None:
    """Add the command."""
    command = add_command(
        subparsers,
        "doctor",
        "say what works here, and what to install",
        "fem-seal doctor",
    )
    command.set_defaults(command=_doctor)


def _doctor(options: argparse.Namespace) -> int:
    from fem_seal.doctor import examine, table

    findings = list(examine())
    say(table(findings))
    broken = [finding.name for finding in findings if finding.required and not finding.works]
    if broken:
        raise MissingPackage(f"not working here: {', '.join(broken)}; the table says what to do")
    return 0
