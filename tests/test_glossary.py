"""Every identifier of the glossary exists in the package."""

import ast
import re

from project import ROOT, trees

PAGE = (ROOT / "docs/reference/glossary.md").read_text(encoding="utf-8")
SYMBOLS = PAGE.partition("## Terms")[0]
ROWS = [line.split("|")[1:-1] for line in SYMBOLS.splitlines() if line.startswith("| ")]
IDENTIFIERS = sorted({name for row in ROWS for name in re.findall(r"`([\w.]+)`", row[1])})


def names_in(tree):
    """Names that a module defines: functions, classes, arguments, variables and members."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        if isinstance(node, ast.ClassDef):
            yield from (f"{node.name}.{member}" for member in members(node))


def members(definition):
    """Fields, methods and properties that the body of a class defines."""
    for node in definition.body:
        if isinstance(node, ast.AnnAssign):
            yield node.target.id
        elif isinstance(node, ast.FunctionDef):
            yield node.name


def test_rows_are_complete():
    """Symbol, identifier, meaning, unit; at least the quantities of the leak rate are listed."""
    assert {len(row) for row in ROWS} == {4}
    assert {"gap", "viscosity", "leak_rate", "contact_modulus"} <= set(IDENTIFIERS)


def test_identifiers_exist():
    defined = {name for tree in trees().values() for name in names_in(tree)}
    assert set(IDENTIFIERS) - defined == set()
    assert not {"LeakRate.lowest", "stream_of_nothing"} & defined
