"""docs/measurements/limits.md shows the extremes, and only passed cases get into it."""

import ast
from pathlib import Path

import pytest
from limits_page import Row, tables
from project import ROOT

PAGE = ROOT / "docs/measurements/limits.md"
MODULES = sorted(Path(__file__).parent.glob("test_extreme_*.py"))


def shown_extremes():
    """First sentence of every test that takes the fixture `show`."""
    bodies = (ast.parse(module.read_text(encoding="utf-8")).body for module in MODULES)
    functions = (node for body in bodies for node in body if isinstance(node, ast.FunctionDef))
    return [
        ast.get_docstring(node).partition(".\n")[0].rstrip(".")
        for node in functions
        if node.name.startswith("test_") and "show" in [argument.arg for argument in node.args.args]
    ]


@pytest.mark.parametrize("extreme", shown_extremes())
def test_every_extreme_has_a_row(extreme):
    """Outcomes and numbers may differ from machine to machine."""
    assert f"| {extreme} |" in PAGE.read_text(encoding="utf-8"), "run make limits"


def test_cases_that_end_alike_share_a_row():
    rows = [
        Row("Flow", "Gaps", "1", "right", "a law"),
        Row("Flow", "Gaps", "2", "right", "a law"),
        Row("Flow", "Gaps", "3", "right", "another law"),
        Row("Flow", "Gaps", "4", "refused", "4 is | too much"),
        Row("Flow", "Gaps", "5", "refused", "5 is too much"),
        Row("Input", "Files", "", "right", "a law"),
    ]
    text = tables(rows)
    assert "| Gaps | 1, 2 | right | a law |\n| Gaps | 3 | right | another law |\n" in text
    assert "| Gaps | 4, 5 | refused | 4 is / too much |\n" in text
    assert text.count("| extreme | cases | outcome | evidence |") == 2
