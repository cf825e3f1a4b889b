"""A docstring adds shapes, units, meaning and sources; types are said once, in the annotations."""

import ast
import re

from project import PACKAGE, trees

from fem_seal.scene import Scene

SECTION = re.compile(r"^([A-Z]\w+)\n-{3,}\n(.*?)(?=\n\n|\Z)", re.MULTILINE | re.DOTALL)
NAMES = r"\*{0,2}\w+(?:,\s+\*{0,2}\w+)*"
ENTRY = re.compile(rf"^({NAMES})(?: : (.*))?$", re.MULTILINE)
DOTTED = re.compile(r"`([a-z_]+(?:\.\w+)+)`")
# What may stand behind the name of an entry: a shape, with its kind of number, or a foreign class.
SHAPE = re.compile(r"\([^()]*\)( \w+)?|dolfinx\.[\w.]+")


def entries(docstring, *sections):
    """Names that the sections of a docstring describe, and the rest of their lines."""
    for title, body in SECTION.findall(docstring):
        if title in sections:
            for names, rest in ENTRY.findall(body):
                yield [name.lstrip("*") for name in re.split(r",\s+", names)], rest


def annotations(node):
    """Annotations of the arguments of a function, or of the fields of a class, by their names."""
    if isinstance(node, ast.ClassDef):
        fields = {f.target.id: f.annotation for f in node.body if isinstance(f, ast.AnnAssign)}
        makers = [f for f in node.body if getattr(f, "name", "") == "__init__"]
        # Attributes that the constructor sets have no annotation.
        names = {a.attr: None for f in makers for a in ast.walk(f) if isinstance(a, ast.Attribute)}
        return names | next(map(annotations, makers), {}) | fields
    of = node.args
    several = [argument for argument in (of.vararg, of.kwarg) if argument]
    return {a.arg: a.annotation for a in [*of.posonlyargs, *of.args, *of.kwonlyargs, *several]}


def is_dataclass(node):
    names = (d.func if isinstance(d, ast.Call) else d for d in getattr(node, "decorator_list", ()))
    return any(isinstance(name, ast.Name) and name.id == "dataclass" for name in names)


def outside_sections(docstring):
    """Lines `name : description` that are in no section."""
    head = re.split(r"^[A-Z]\w+(?: \w+)?\n-{3,}$", docstring, maxsplit=1, flags=re.MULTILINE)[0]
    return [line for line in head.splitlines()[1:] if re.match(rf"{NAMES} : ", line)]


def faults(tree):
    for node in ast.walk(tree):
        if not isinstance(node, ast.ClassDef | ast.FunctionDef):
            continue
        docstring, known = ast.get_docstring(node) or "", annotations(node)
        for names, rest in entries(docstring, "Parameters", "Attributes", "Raises"):
            if rest and not SHAPE.fullmatch(rest):
                yield f"{node.name}: {names}: put {rest!r} below the name, indented"
        for names, _ in entries(docstring, "Parameters", "Attributes"):
            if other := [name for name in names if name not in known]:
                yield f"{node.name}: no argument or field {other}"
            elif is_dataclass(node):
                yield f"{node.name}: describe {names} by a comment `#:` at the field"
        for title, body in SECTION.findall(docstring):
            if title == "Returns" and not SHAPE.fullmatch(first := body.split("\n")[0]):
                yield f"{node.name}: a shape in place of {first}: the type stands in the annotation"
        if lines := outside_sections(docstring):
            yield f"{node.name}: outside a section: {lines}"


def test_types_are_said_once_and_names_exist():
    wrong = [
        f"{path.relative_to(PACKAGE)}: {fault}"
        for path, tree in trees().items()
        for fault in faults(tree)
    ]
    assert not wrong, "\n".join(wrong)


def test_modules_in_docstrings_exist():
    """`film.law`, `film.law.CUBE` and `law.py`; not `flow.rtol` and the like, keys of a scene."""
    known = set()
    for path, tree in trees().items():
        module = "." + ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        module = module.removesuffix(".__init__")
        names = {getattr(n, "name", getattr(n, "id", "")) for n in ast.walk(tree)}
        known |= {module} | {f"{module}.{name}" for name in (*names, "py")}
    modules = {part for name in known for part in name.split(".")[:-1]} - set(Scene.model_fields)
    wrong = [
        f"{path.relative_to(PACKAGE)}: {name}"
        for path in trees()
        for name in DOTTED.findall(path.read_text(encoding="utf-8"))
        if name.split(".")[0] in modules or name.endswith(".py")
        if not any(one.endswith(f".{name}") for one in known)
    ]
    assert not wrong, "\n".join(wrong)
