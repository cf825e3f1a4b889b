"""Docstrings in the dialect that numpydoc renders: arguments and fields stand in sections."""

import ast
import re

import pytest
from project import ROOT

PACKAGE = ROOT / "fem_seal"
# Packages and modules whose docstrings are in this dialect throughout.
FINISHED = [
    *("upscaling", "film", "theory", "finite_difference", "mesh", "render", "surface"),
    *("verification", "field_file", "quantities", "results", "files", "flow", "contact"),
    *("letter", "sweep", "points", "scene", "cli", "coupling"),
    *("digits.py", "expression.py", "fenicsx.py", "fluid.py", "grid.py", "leak_rate.py"),
    *("doctor.py", "gap_file.py", "parallel.py", "progress.py", "units.py", "accuracy.py"),
    *("limits.py", "memory.py", "errors.py", "interrupts.py", "installed.py", "tables.py"),
    *("job.py", "patch.py", "steps.py", "registry.py"),
]

SECTION = re.compile(r"^([A-Z]\w+)\n-{3,}\n(.*?)(?=\n\n|\Z)", re.MULTILINE | re.DOTALL)
ENTRY = re.compile(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*) : ", re.MULTILINE)


def modules():
    for name in FINISHED:
        path = PACKAGE / name
        yield from sorted(path.rglob("*.py")) if path.is_dir() else [path]


def entries(docstring, *sections):
    """Names that the sections of a docstring describe."""
    bodies = [body for title, body in SECTION.findall(docstring) if title in sections]
    groups = [group for body in bodies for group in ENTRY.findall(body)]
    return {name for group in groups for name in group.split(", ")}


def outside_sections(docstring):
    """Lines `name : description` that are in no section."""
    head = re.split(r"^[A-Z]\w+(?: \w+)?\n-{3,}$", docstring, maxsplit=1, flags=re.MULTILINE)[0]
    return [line for line in head.splitlines()[1:] if ENTRY.match(line)]


def is_dataclass(node):
    names = (d.func if isinstance(d, ast.Call) else d for d in node.decorator_list)
    return any(isinstance(name, ast.Name) and name.id == "dataclass" for name in names)


def faults(tree):
    for node in ast.walk(tree):
        if not isinstance(node, ast.ClassDef | ast.FunctionDef):
            continue
        docstring = ast.get_docstring(node) or ""
        if lines := outside_sections(docstring):
            yield f"{node.name}: outside a section: {lines}"
        if isinstance(node, ast.ClassDef) and is_dataclass(node) and node.name[0] != "_":
            fields = {f.target.id for f in node.body if isinstance(f, ast.AnnAssign)}
            described = entries(docstring, "Parameters", "Attributes")
            if missing := fields - described:
                yield f"{node.name}: not described: {sorted(missing)}"


@pytest.mark.parametrize("path", list(modules()), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_fields_are_described_in_sections(path):
    assert not list(faults(ast.parse(path.read_text(encoding="utf-8"))))


def test_faults_are_noticed():
    source = '''
@dataclass
class Film:
    """A film.

    gap : height [m]
    """

    gap: float
'''
    assert len(list(faults(ast.parse(source)))) == 2
