"""The mutation check changes one thing at a time, and only what runs."""

import ast
from pathlib import Path

from mutations import mutations, of_same_name
from project import ROOT


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
