"""docs/validation.md: every row holds, can fail, and has the same numbers on the page."""

import re
from dataclasses import replace
from math import inf

import pytest
from project import ROOT
from validation_page import filled, parts
from validation_rows import PEER_ROWS, ROWS, Number, Row

PAGE = (ROOT / "docs/validation.md").read_text(encoding="utf-8")
# Other codes, where `make peers` has installed them, take half a minute. What the other slow rows
# compare has tests in coupling/, flow/, contact/ and test_fluid.py.
SLOW = {*PEER_ROWS, "finite-differences", "helium-molecular", "helium-viscous"}
SLOW |= {"lifted-channel", "lifted-grids", "sealing-load", "stiff-wedge", "gap-exponent"}
NAMES = [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in ROWS]
NUMBER = r"-?\d[\d.]*(?:e[-+]?\d+)?"


def printed(name: str) -> list[str]:
    """Cells of a row of the page."""
    rows = [line for line in PAGE.splitlines() if line.startswith(f"| `{name}` |")]
    assert len(rows) == 1, f"{name}: run make validation"
    return [cell.strip() for cell in rows[0].split("|")[1:-1]]


@pytest.mark.parametrize("name", NAMES)
def test_row(name):
    """Both intervals overlap, to rounding: some bounds are exact. A reference that is wrong by a
    factor of two is noticed: the errors are not that wide. The interval of the page, of more
    samples or seeds, overlaps this one."""
    row, cells = ROWS[name](False), printed(name)
    assert abs(row.distance) <= 1 + 1e-6, (str(row.ours), str(row.reference))
    for factor in (0.5, 2.0):
        ends = sorted(factor * end for end in (row.reference.lower, row.reference.upper))
        wrong = replace(row, reference=Number(factor * row.reference.value, *ends))
        noticed = abs(wrong.distance) > 1
        assert noticed or row.reference.upper == inf, (str(row.ours), str(wrong.reference))
    for cell, number in zip(cells[2:4], (row.ours, row.reference), strict=True):
        ends = [float(end) for end in re.findall(NUMBER, cell)]
        lower, upper = (ends[-2], ends[-1]) if "to" in cell else (ends[0], ends[0])
        slack = 1e-3 * max(abs(lower), abs(upper))  # digits of the page
        assert lower - slack <= number.upper
        assert number.lower <= upper + slack


def test_rows_of_the_page_are_those_of_the_program():
    rows = {name: Row(Number.exact(1.0), Number.exact(2.0)) for name in ROWS}
    assert list(parts(PAGE))[: len(ROWS)] == list(ROWS)
    assert filled(PAGE, rows).count("| 1 | 2 | -") == len(ROWS)
    assert filled(filled(PAGE, rows), rows) == filled(PAGE, rows)
