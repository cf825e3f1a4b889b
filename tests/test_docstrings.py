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
NAMES = r"\*{0,2}\w+(?:,\s+\*{0,2}\w+)*"
ENTRY = re.compile(rf"^({NAMES}) : ", re.MULTILINE)
# Arguments that are described elsewhere, such as "As in `solve`", have no type.
ARGUMENT = re.compile(rf"^({NAMES})(?: : |\n +\S)", re.MULTILINE)


def modules():
    for name in FINISHED:
        path = PACKAGE / name
        yield from sorted(path.rglob("*.py")) if path.is_dir() else [path]


def entries(docstring, *sections, entry=ENTRY):
    """Names that the sections of a docstring describe."""
    bodies = [body for title, body in SECTION.findall(docstring) if title in sections]
    groups = [group for body in bodies for group in entry.findall(body)]
    return {name.lstrip("*") for group in groups for name in re.split(r",\s+", group)}


def arguments(function):
    """Names of the arguments of a function, without that of the object or class of a method."""
    of = function.args
    several = [argument for argument in (of.vararg, of.kwarg) if argument]
    names = {argument.arg for argument in [*of.posonlyargs, *of.args, *of.kwonlyargs, *several]}
    return names - {"self", "cls"}


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
        if isinstance(node, ast.FunctionDef) and "\nParameters\n---" in docstring:
            described = entries(docstring, "Parameters", entry=ARGUMENT)
            if other := described ^ arguments(node):
                yield f"{node.name}: described, or an argument, but not both: {sorted(other)}"
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


def mean(gap, weight):
    """Mean gap.

    Parameters
    ----------
    gap : height [m]
    weights : of each sample
    """
'''
    assert len(list(faults(ast.parse(source)))) == 3
