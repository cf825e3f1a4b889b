"""Break the package at random places, one at a time, and list the changes that no test notices.

    python tests/mutations.py coupling --count 15 --seed 1

A survivor is a missing test, unless the change makes no difference: judge each by hand. Everything
runs in a copy of the project; the checkout stays as it is.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from linecache import getline
from pathlib import Path

from project import ROOT

OPPOSITES = (
    (ast.Add, ast.Sub),
    (ast.Mult, ast.Div),
    (ast.Lt, ast.GtE),
    (ast.LtE, ast.Gt),
    (ast.Eq, ast.NotEq),
    (ast.Is, ast.IsNot),
    (ast.In, ast.NotIn),
    (ast.And, ast.Or),
)
OPERATORS: dict[type[ast.AST], type[ast.AST]] = {ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult}
OPERATORS |= {one: other for pair in OPPOSITES for one, other in (pair, pair[::-1])}
NO_CODE = ("annotation", "returns", "decorator_list")
LEFT_OUT = (".git", ".*cache", ".venv", "__pycache__", "*.egg-info")


@dataclass(frozen=True)
class Mutation:
    """Another value of one field of a node in the syntax tree of a file."""

    path: Path
    tree: ast.Module
    node: ast.expr
    field: str
    value: object

    def apply(self) -> tuple[str, str]:
        """The changed source, and the place with the code before and after; the tree stays."""
        before, value = ast.unparse(self.node), getattr(self.node, self.field)
        setattr(self.node, self.field, self.value)
        source, after = ast.unparse(self.tree), ast.unparse(self.node)
        setattr(self.node, self.field, value)
        line = getline(str(ROOT / self.path), self.node.lineno).strip()
        return source, f"{self.path}:{self.node.lineno}: {line}\n    {before} -> {after}"


def mutations(path: Path) -> Iterator[Mutation]:
    """All small changes of a file: operators, comparisons, numbers, truth values, `not`, `-`."""
    tree = ast.parse(path.read_bytes())
    for node in _of_code(tree):
        for field, value in _changes(node):
            yield Mutation(path.relative_to(ROOT), tree, node, field, value)


def _changes(node: ast.AST) -> Iterator[tuple[str, object]]:
    """Fields of a node and other values of them."""
    match node:
        case ast.BinOp(op=op) | ast.BoolOp(op=op) if type(op) in OPERATORS:
            yield "op", OPERATORS[type(op)]()
        case ast.Compare(ops=ops):
            for k, op in enumerate(ops):
                yield "ops", [*ops[:k], OPERATORS[type(op)](), *ops[k + 1 :]]
        case ast.UnaryOp(op=ast.Not()):
            yield "operand", ast.UnaryOp(ast.Not(), node.operand)
        case ast.UnaryOp(op=ast.USub()):
            yield "op", ast.UAdd()
        case ast.Constant(value=bool() as value):
            yield "value", not value
        case ast.Constant(value=int() as value):
            yield "value", value + 1
        case ast.Constant(value=float() as value):
            yield "value", 2 * value or 1.0


def _of_code(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes below a node, without annotations, decorators, messages, texts with values in them."""
    for name, child in ast.iter_fields(node):
        for each in child if isinstance(child, list) else [child]:
            message = isinstance(each, ast.JoinedStr | ast.Raise)
            if isinstance(each, ast.AST) and not message and name not in NO_CODE:
                yield each
                yield from _of_code(each)


def pass_in(copy: Path, tests: list[str], longest: float | None) -> bool:
    """Whether the tests pass in a copy of the project, and within a time [s]."""
    options = ["-q", "-x", "-p", "no:cacheprovider", "--hypothesis-seed=0"]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    run = partial(subprocess.run, command, cwd=copy, env=os.environ | {"PYTHONPATH": str(copy)})
    try:
        return run(capture_output=True, timeout=longest).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def of_same_name(part: str) -> list[str]:
    """Folder of tests of the name of a package; without one, the modules that begin so."""
    name = Path(Path(part).parts[0]).stem
    folder = Path("tests", name)
    if (ROOT / folder).is_dir():
        return [str(folder)]
    return sorted(str(path.relative_to(ROOT)) for path in ROOT.glob(f"tests/test_{name}*.py"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", help="package or module of fem_seal, such as coupling or grid.py")
    parser.add_argument("--tests", nargs="+", help="what is run (tests of the same name)")
    parser.add_argument("--count", type=int, default=15, help="number of mutations (15)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    part = ROOT / "fem_seal" / options.part
    files = sorted(part.rglob("*.py")) if part.is_dir() else [part]
    every = [mutation for file in files for mutation in mutations(file)]
    chosen = random.Random(options.seed).sample(every, min(options.count, len(every)))
    tests = options.tests or of_same_name(options.part)
    if not tests:
        parser.error(f"no tests are named after {options.part}: name them by --tests")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "project")
        shutil.copytree(ROOT, copy, symlinks=True, ignore=shutil.ignore_patterns(*LEFT_OUT))
        survivors, began = 0, time.monotonic()
        if not pass_in(copy, tests, None):
            sys.exit(f"{' '.join(tests)} must pass before anything is broken")
        longest = 60 + 3 * (time.monotonic() - began)
        for mutation in chosen:
            source, place = mutation.apply()
            (copy / mutation.path).write_text(source, encoding="utf-8")
            survived = pass_in(copy, tests, longest)
            shutil.copy(ROOT / mutation.path, copy / mutation.path)
            survivors += survived
            print(f"{'SURVIVED' if survived else 'caught'}: {place}", flush=True)
    print(f"{survivors} of {len(chosen)} survived, out of {len(every)} possible changes")


if __name__ == "__main__":
    main()
