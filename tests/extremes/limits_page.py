"""`make limits`: run the extremes and write their rows into docs/measurements/limits.md.

A row of the page stands for all cases of an extreme that end alike: with the same evidence, or
refused. If any case fails, the page stays as it is.
"""

import sys
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import pytest

sys.path.append(str(Path(__file__).parents[1]))

from project import with_part

from fem_seal.tables import markdown


class Row(NamedTuple):
    """A case: where it stands, what was asked for, how it ended, and how that is known."""

    part: str
    extreme: str
    case: str
    outcome: str
    evidence: str

    @property
    def end(self) -> tuple[str, str, str]:
        """What the cases of one row of the page share; refusals name the value they refuse."""
        return self.extreme, self.outcome, "" if self.outcome == "refused" else self.evidence


class Recorder:
    """A plugin that collects what the fixture `show` records."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the rows of a case that has passed."""
        if report.when == "call" and report.passed:
            self.rows += [Row(*row) for name, row in report.user_properties if name == "row"]


def tables(rows: list[Row]) -> str:
    """Tables of the page, one for each part, of rows in the order of the cases."""
    sections = []
    for part, of_part in groupby(rows, lambda row: row.part):
        lines = []
        for _, cases in groupby(of_part, lambda row: row.end):
            first, *others = cases
            names = ", ".join(row.case for row in (first, *others))
            cells = (first.extreme, names, first.outcome, first.evidence)
            lines.append([cell.replace("|", "/") for cell in cells])
        table = markdown(("extreme", "cases", "outcome", "evidence"), lines)
        sections.append(f"## {part}\n\n{table}")
    return "\n\n".join(sections)


def main(page: Path) -> int:
    """Run all cases and write the page; the exit status is that of pytest."""
    recorder = Recorder()
    here = Path(__file__).parent
    # The test of the page would fail on every new extreme, before it can be written.
    cases = [str(here), f"--ignore={here / 'test_limits_page.py'}", "-q"]
    status = pytest.main(cases, plugins=[recorder])
    if status == 0:
        text = with_part(page.read_text(encoding="utf-8"), "limits", tables(recorder.rows))
        page.write_text(text, encoding="utf-8")
        print(f"{len(recorder.rows)} cases in {page}")
    return int(status)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
