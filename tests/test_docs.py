"""Documentation and program have the same keys, options and files."""

import argparse
import inspect
import re
import runpy
import tomllib
from importlib import import_module
from types import UnionType
from typing import Annotated, Union, get_args, get_origin

from project import ROOT
from pydantic import BaseModel

from fem_seal import cli
from fem_seal.render import __all__ as pictures
from fem_seal.results import Result
from fem_seal.scene import Scene
from fem_seal.sweep.point import COLUMNS

WRITTEN = [
    path
    for path in sorted((ROOT / "docs").rglob("*.md"))
    if path.relative_to(ROOT / "docs").parts[0] not in ("_build", "gallery")
]
PAGES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in (ROOT / "README.md", *WRITTEN)
}
ENDINGS = {"csv", "html", "md", "npy", "npz", "png", "py", "toml", "vtu"}
EVERYTHING = "\n".join(PAGES.values())


def models(annotation):
    """Pydantic models and dataclasses in an annotation, unions and containers opened."""
    if get_origin(annotation) in (Union, UnionType, Annotated, tuple, list, dict):
        return [found for part in get_args(annotation) for found in models(part)]
    is_record = isinstance(annotation, type) and (
        issubclass(annotation, BaseModel) or hasattr(annotation, "__dataclass_fields__")
    )
    return [annotation] if is_record else []


def fields(model):
    """Name (as written in files) and annotation of each field."""
    if issubclass(model, BaseModel):
        return {f.alias or name: f.annotation for name, f in model.model_fields.items()}
    return {name: f.type for name, f in model.__dataclass_fields__.items()}


SECTIONS = {
    name: {key for model in models(annotation) for key in fields(model)}
    for name, annotation in fields(Scene).items()
}


def listings(page):
    """Sections and keys of a page's TOML, with the alternatives that are commented out."""
    named = {}
    for block in re.findall(r"```toml\n(.*?)```", PAGES[page], re.DOTALL):
        # Line by line: an alternative may stand beside what it replaces.
        for line in block.splitlines():
            if match := re.match(r"\[(\w+)\]", line):
                keys = named.setdefault(match[1], set())
            elif match := re.match(r"(?:# )?(\w+)(?:\.\w+)? = ", line):
                keys.add(match[1])
    return named


def test_every_key_of_a_scene_is_listed_and_every_key_listed_exists():
    scene, shapes = listings("docs/reference/scene.md"), listings("docs/guide/shapes.md")
    assert scene | {"shape": shapes["shape"]} == SECTIONS


def test_fields_that_a_page_names_exist():
    """`flow.rtol`, in the text as in --set."""
    key_of_a_section = re.compile(rf"(?<![\w./-])({'|'.join(SECTIONS)})\.([a-z]\w+)\b(?![/(])")
    of_results = set(leaves(Result))
    assert not [
        (page, section, key)
        for page, text in PAGES.items()
        for section, key in key_of_a_section.findall(text)
        if key not in ENDINGS | SECTIONS[section]
        # `seal` is a section of a scene and of a result.
        and not (page.endswith("results.md") and f"{section}.{key}" in of_results)
    ]


def test_toml_of_the_pages_is_toml():
    blocks = re.findall(r"```toml\n(.*?)```", EVERYTHING, re.DOTALL)
    assert blocks
    assert all(tomllib.loads(block) for block in blocks)


def leaves(model, path=""):
    """Path of every key of a result, "leak_rate.value"; records in lists like any other."""
    for name, annotation in fields(model).items():
        yield f"{path}{name}"
        for inner in models(annotation):
            yield from leaves(inner, f"{path}{name}.")


def test_every_key_of_a_result_is_explained():
    """By its last name, in the row of its first one or of its own path."""
    table = PAGES["docs/reference/results.md"].partition("## result.json")[2].partition("## ")[0]
    rows = re.findall(r"^\| (`.*?) \| (.*) \|$", table, re.MULTILINE)
    for leaf in leaves(Result):
        first, last = leaf.partition(".")[0], leaf.rpartition(".")[2]
        texts = (f"{keys} {text}" for keys, text in rows if re.search(rf"`{first}[`.]", keys))
        assert any(re.search(rf"\b{last}\b", text) for text in texts), leaf


def test_results_page_names_only_keys_that_exist():
    table = PAGES["docs/reference/results.md"].partition("## result.json")[2].partition("## ")[0]
    known = set(leaves(Result))
    for keys in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE):
        first, *more = re.findall(r"`([\w.]+)`", keys)
        stem = first.rpartition(".")[0]
        assert first in known
        assert {stem + name if name.startswith(".") else name for name in more} <= known


def test_columns_of_a_sweep_are_those_of_its_page():
    text = PAGES["docs/reference/results.md"].partition("## sweep.csv")[2]
    named = re.split(r"A\s+number\s+that", text.partition("in SI units:")[2])[0]
    stated = re.findall(r"`([\w.]+)`", named)
    assert [name for name in stated if name != "verdict"] == list(COLUMNS)


def commands(parser, name=("fem-seal",)):
    """Parsers by the words that call them."""
    yield name, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, inner in action.choices.items():
                yield from commands(inner, (*name, word))


PARSERS = dict(commands(cli.parser()))


def test_commands_and_options_that_the_pages_name_exist():
    for line in re.findall(r"fem-seal(?: [^\s`|,;:.)]+)+", EVERYTHING):
        words = line.split()
        if not re.fullmatch(r"--\w+|[a-z-]+", words[1]):
            continue  # prose: fem-seal is the subject of a sentence
        depth = next(k for k in (3, 2, 1) if k == 2 or tuple(words[:k]) in PARSERS)
        name = ("fem-seal",) if words[1].startswith("--") else tuple(words[:depth])
        assert name in PARSERS, line
        if words[1] == "study" and len(words) > 2 and not words[2].startswith("-"):
            assert tuple(words[:3]) in PARSERS, line
        options = PARSERS[name]._option_string_actions
        for word in words:
            if word.startswith("--"):
                assert word.partition("=")[0] in options, line


def test_every_command_is_in_the_readme():
    names = {words[1] for words in PARSERS if len(words) == 2} - set(cli.MOVED)
    assert {name for name in names if f"fem-seal {name}" not in PAGES["README.md"]} == set()


def anchors(page):
    """Anchors of a page's headings, as a browser of repositories makes them."""
    headings = re.findall(r"^#+ (.*)$", PAGES[page], re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


def leads_somewhere(page, link):
    """Whether the file that a link names exists, and has its heading."""
    name, _, anchor = link.partition("#")
    target = ((ROOT / page).parent / name).resolve() if name else ROOT / page
    return target.exists() and (not anchor or anchor in anchors(str(target.relative_to(ROOT))))


def test_links_lead_somewhere():
    assert not [
        (page, link)
        for page, text in PAGES.items()
        for link in re.findall(r"\]\(([^)\s]+)\)", text)
        if not link.startswith("https://") and not leads_somewhere(page, link)
    ]


def test_files_that_the_pages_name_are_there():
    places = r"(?:demos|docs|fem_seal|meshes|tests)/[\w./*-]*\w"
    names = set(re.findall(rf"(?<![\w./-])({places})", EVERYTHING))
    assert not [name for name in names if not list(ROOT.glob(name))]


def test_every_page_is_reached_from_the_first_one():
    """README for who reads the files; docs/index.md for the site."""
    index = PAGES["docs/index.md"]
    trees = re.findall(r"```{toctree}\n(?::[^\n]*\n)*(.*?)```", index, re.DOTALL)
    listed = {f"docs/{name}.md" for tree in trees for name in tree.split()}
    assert listed - {"docs/gallery/index.md"} == PAGES.keys() - {"README.md", "docs/index.md"}
    for page in PAGES.keys() - {"README.md", "docs/index.md"}:
        assert f"({page})" in PAGES["README.md"] or page.startswith("docs/reference/"), page


def test_imports_of_the_pages_work():
    found = re.findall(
        r"^(?:    )?from (fem_seal[\w.]*) import ([\w, ]+)$", EVERYTHING, re.MULTILINE
    )
    assert found
    for module, names in found:
        for name in names.split(", "):
            assert hasattr(import_module(module), name), (module, name)


def test_formulas_theorems_and_references_of_the_mathematics_are_numbered():
    """In order, each theorem in the table of all, and each number that is cited exists."""
    page = PAGES["docs/theory/mathematics.md"]
    formulas = [int(n) for n in re.findall(r"^\$\$ \((\d+)\)$", page, re.MULTILINE)]
    theorems = [int(n) for n in re.findall(r"^### [A-Z]\w+ (\d+) ", page, re.MULTILINE)]
    rows = [int(n) for n in re.findall(r"^\| \[(\d+)\]\(#", page, re.MULTILINE)]
    text, _, listed = page.partition("## References")
    references = [int(n) for n in re.findall(r"^(\d+)\. ", listed, re.MULTILINE)]
    for numbers in (formulas, theorems, references):
        assert numbers == list(range(1, len(numbers) + 1))
    assert rows == theorems
    assert {int(n) for n in re.findall(r"(?<=[\s(\[])\((\d+)\)", text)} <= set(formulas)
    cited = re.findall(r" \[([\d, ]+)\](?!\()", text)
    assert {int(n) for group in cited for n in group.split(",")} == set(references)


# Sphinx reads |g| as the name of a substitution, and a * that begins a word as emphasis.
LITERAL = re.compile(r"``.*?``|`[^`]*`", re.DOTALL)
SUBSTITUTION = re.compile(r"(?<![\w|])\|\w[^|\n]*\|")
EMPHASIS = re.compile(r"(?:^|[\s'\"(/<:-])\*[^\s*]")


def test_docstrings_of_the_reference_name_no_substitution():
    assert SUBSTITUTION.search("at most |g| there")
    assert not SUBSTITUTION.search(LITERAL.sub("", "at most ``|p g|`` there"))
    for module in re.findall(r"automodule:: (fem_seal[\w.]*)", PAGES["docs/reference/python.md"]):
        public = import_module(module)
        for name in public.__all__:
            text = inspect.getdoc(getattr(public, name)) or ""
            assert not SUBSTITUTION.search(LITERAL.sub("", text)), f"{module}.{name}"


def test_help_of_commands_has_no_emphasis():
    assert EMPHASIS.search("a pattern, maps/*.npz")
    assert not EMPHASIS.search("a pattern, maps/m*.npz")
    for words, parser in PARSERS.items():
        for action in parser._actions:
            assert not EMPHASIS.search(action.help or ""), (words, action.dest)


def test_every_picture_of_the_pages_has_its_command():
    """Those of docs/images in make.py, which is named beside them; others by a command of ours."""
    made = runpy.run_path(str(ROOT / "docs/images/make.py"))["PICTURES"]
    images = ROOT / "docs/images"
    assert {path.name for path in images.glob("*.png")} == {n for n in made if "/" not in n}
    assert all((images / name).is_file() for name in made)
    for page, text in PAGES.items():
        for name in re.findall(r"images/(\w+\.png)", text):
            arguments = made[name][1].removeprefix("-m fem_seal").split()
            assert "images/make.py" in text or " ".join(arguments[:2]) in text, (page, name)
        for name in re.findall(r"letter/(\w+)\.png", text):
            command = r"demos[./](letter\.reproduce|closing_saddle\.py) -"
            assert re.search(command, text), (page, name)


def test_every_picture_is_explained():
    for name in set(pictures) - {"require_gl"}:
        assert f"`{name}(" in PAGES["docs/guide/pictures.md"]
