"""The mutation check changes one thing at a time, and only what runs."""

import ast
from pathlib import Path

import pytest
from mutations import mutations, of_same_name
from project import ROOT


def changed(source):
    return {m.apply(source.encode()).decode() for m in mutations(Path("a.py"), source.encode())}


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a + (b)", {"a - (b)"}),
        ("(a) < b <= 1.5", {"(a) >= b <= 1.5", "(a) < b > 1.5", "(a) < b <= 3.0"}),
        ("η is not a and b", {"η is a and b", "η is not a or b"}),
        ("if not a in b: c", {"if a in b: c", "if not a not in b: c"}),
        ("-x ** 2", {"x ** 2", "-x * 2", "-x ** 3"}),
        ("def f(a: 'L[1]' = True) -> 1: 'text'", {"def f(a: 'L[1]' = False) -> 1: 'text'"}),
        ("raise E(f'{1 + x}')", set()),
    ],
)
def test_small_changes(source, expected):
    assert changed(source) == expected


def test_every_change_is_a_program():
    """Of a whole module: each change compiles, and to another program."""
    source = (ROOT / "fem_seal" / "film" / "law.py").read_bytes()
    every = list(mutations(Path("law.py"), source))
    assert len(every) > 50
    before = ast.dump(ast.parse(source))
    for mutation in every:
        assert ast.dump(ast.parse(mutation.apply(source))) != before


def test_every_package_has_of_same_name_its_name():
    packages = {path.parent.name for path in (ROOT / "fem_seal").glob("*/__init__.py")}
    assert {name for name in packages if not of_same_name(name)} == set()
