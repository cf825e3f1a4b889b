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
from pathlib import Path

from project import ROOT

OPPOSITES = (
    (ast.Add, "+", ast.Sub, "-"),
    (ast.Mult, "*", ast.Div, "/"),
    (ast.Lt, "<", ast.GtE, ">="),
    (ast.LtE, "<=", ast.Gt, ">"),
    (ast.Eq, "==", ast.NotEq, "!="),
    (ast.Is, "is", ast.IsNot, "is not"),
    (ast.In, "in", ast.NotIn, "not in"),
    (ast.And, "and", ast.Or, "or"),
)
OPERATORS: dict[type[ast.AST], tuple[str, str]] = {ast.Pow: ("**", "*"), ast.FloorDiv: ("//", "*")}
for _one, _text, _other, _other_text in OPPOSITES:
    OPERATORS |= {_one: (_text, _other_text), _other: (_other_text, _text)}
NO_CODE = ("annotation", "returns", "decorator_list")
LEFT_OUT = (".git", ".*cache", ".venv", "__pycache__", "*.egg-info")


@dataclass(frozen=True, order=True)
class Mutation:
    """Bytes `start` to `end` of a file, and the text that replaces them."""

    path: Path
    start: int
    end: int
    text: str

    def apply(self, source: bytes) -> bytes:
        return source[: self.start] + self.text.encode() + source[self.end :]

    def shown(self, source: bytes) -> str:
        """Number of the line, and the line before and after the change."""
        number = source[: self.start].count(b"\n")
        old, new = (text.split(b"\n")[number].decode() for text in (source, self.apply(source)))
        return f"{self.path}:{number + 1}\n    - {old.strip()}\n    + {new.strip()}"


def mutations(path: Path, source: bytes) -> Iterator[Mutation]:
    """All small changes of a source: operators, comparisons, numbers, truth values, `not`, `-`."""
    lines = [0, *(k + 1 for k, byte in enumerate(source) if byte == ord("\n"))]

    def start(node: ast.expr) -> int:
        return lines[node.lineno - 1] + node.col_offset

    def end(node: ast.expr) -> int:
        return lines[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)

    def replaced(before: ast.expr, operator: ast.AST, after: ast.expr) -> Iterator[Mutation]:
        if type(operator) in OPERATORS:
            old, new = OPERATORS[type(operator)]
            place = source.index(old.encode(), end(before), start(after))
            yield Mutation(path, place, place + len(old), new)

    for node in _of_code(ast.parse(source)):
        match node:
            case ast.BinOp():
                yield from replaced(node.left, node.op, node.right)
            case ast.Compare():
                sides = [node.left, *node.comparators]
                for k, operator in enumerate(node.ops):
                    yield from replaced(sides[k], operator, sides[k + 1])
            case ast.BoolOp():
                for before, after in zip(node.values, node.values[1:], strict=False):
                    yield from replaced(before, node.op, after)
            case ast.UnaryOp(op=ast.Not() | ast.USub()):
                yield Mutation(path, start(node), start(node.operand), "")
            case ast.Constant(value=bool() as value):
                yield Mutation(path, start(node), end(node), str(not value))
            case ast.Constant(value=int() as value):
                yield Mutation(path, start(node), end(node), str(value + 1))
            case ast.Constant(value=float() as value):
                yield Mutation(path, start(node), end(node), repr(2 * value or 1.0))


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
    every = [m for file in files for m in mutations(file.relative_to(ROOT), file.read_bytes())]
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
        for mutation in sorted(chosen):
            source = (copy / mutation.path).read_bytes()
            (copy / mutation.path).write_bytes(mutation.apply(source))
            survived = pass_in(copy, tests, longest)
            (copy / mutation.path).write_bytes(source)
            survivors += survived
            print(f"{'SURVIVED' if survived else 'caught'}: {mutation.shown(source)}", flush=True)
    print(f"{survivors} of {len(chosen)} survived, out of {len(every)} possible changes")


if __name__ == "__main__":
    main()
