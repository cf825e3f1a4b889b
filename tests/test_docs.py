"""Documentation and program have the same keys, options and files."""

import argparse
import ast
import json
import re
import runpy
import tomllib

from project import ROOT, trees

from fem_seal import cli
from fem_seal.field_file.read import READERS
from fem_seal.render import __all__ as pictures
from fem_seal.render.patch import PICTURES
from fem_seal.results import Result
from fem_seal.scene.schema import scene_schema
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


SCENE, RESULT = scene_schema(), Result.model_json_schema()


def inside(node, definitions):
    """Records of a node of a schema: one, or those of a choice, a list or a table."""
    if isinstance(node, dict) and "$ref" in node:
        yield definitions[node["$ref"].rpartition("/")[2]]
    elif isinstance(node, dict | list):
        for inner in node.values() if isinstance(node, dict) else node:
            yield from inside(inner, definitions)


SECTIONS = {
    name: {key for section in inside(node, SCENE["$defs"]) for key in section["properties"]}
    for name, node in SCENE["properties"].items()
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


def test_every_value_that_a_field_may_have_is_listed():
    pages = PAGES["docs/reference/scene.md"] + PAGES["docs/guide/shapes.md"]
    named = set(re.findall(r'["`](\S+?)["`]', pages))
    choices = re.findall(r'"enum": (\[.*?\])|"const": (".*?")', json.dumps(SCENE["$defs"]))
    allowed = set(re.findall(r'"(.*?)"', str(choices)))
    assert "geometric" in allowed
    assert allowed <= named, allowed - named


def test_fields_that_a_page_names_exist():
    """`flow.rtol`, in the text as in --set."""
    key_of_a_section = re.compile(rf"(?<![\w./-])({'|'.join(SECTIONS)})\.([a-z]\w+)\b(?![/(])")
    of_results = set(leaves(RESULT))
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


def leaves(record, path=""):
    """Path of every key of a result, "leak_rate.value"; records in lists like any other."""
    for name, node in record.get("properties", {}).items():
        yield f"{path}{name}"
        for inner in inside(node, RESULT["$defs"]):
            yield from leaves(inner, f"{path}{name}.")


def test_every_key_of_a_result_is_explained_and_every_key_explained_exists():
    """By its last name, in the row of its first one or of its own path."""
    table = PAGES["docs/reference/results.md"].partition("## result.json")[2].partition("## ")[0]
    rows = re.findall(r"^\| (`.*?) \| (.*) \|$", table, re.MULTILINE)
    for leaf in leaves(RESULT):
        first, last = leaf.partition(".")[0], leaf.rpartition(".")[2]
        texts = (f"{keys} {text}" for keys, text in rows if re.search(rf"`{first}[`.]", keys))
        assert any(re.search(rf"\b{last}\b", text) for text in texts), leaf
    known = set(leaves(RESULT))
    for keys, _ in rows:
        first, *more = re.findall(r"`([\w.]+)`", keys)
        stem = first.rpartition(".")[0]
        assert first in known
        assert {stem + name if name.startswith(".") else name for name in more} <= known


def test_every_file_of_a_run_and_every_format_has_a_row():
    files = re.findall(r"`(\w+\.png)`", PAGES["docs/reference/results.md"])
    assert set(PICTURES) <= set(files)
    assert all(f"`{ending}`" in PAGES["docs/guide/surfaces.md"] for ending in READERS)


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
    """And README.md names all commands."""
    names = {words[1] for words in PARSERS if len(words) == 2}
    assert {name for name in names if f"fem-seal {name}" not in PAGES["README.md"]} == set()
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


def test_links_lead_to_files():
    """`make docs` checks their headings."""
    assert not [
        (page, link)
        for page, text in PAGES.items()
        for link in re.findall(r"\]\(([^)\s#]+)", text)
        if not (link.startswith("https://") or ((ROOT / page).parent / link).exists())
    ]


def test_files_that_the_pages_name_are_there():
    places = r"(?:demos|docs|fem_seal|meshes|tests)/[\w./*-]*\w"
    names = set(re.findall(rf"(?<![\w./-])({places})", EVERYTHING))
    assert not [name for name in names if not list(ROOT.glob(name))]


def test_every_picture_is_explained_and_every_one_of_the_pages_has_its_command():
    """Those of docs/images in make.py, which is named beside them; others by a command of ours."""
    assert all(
        f"`{name}(" in PAGES["docs/guide/pictures.md"] for name in {*pictures} - {"require_gl"}
    )
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


def names_in(tree):
    """Names that a module defines: functions, classes and their members, arguments, variables."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.arg(arg=name) | ast.Name(name, ast.Store()):
                yield name
            case ast.ClassDef(name=name, body=body):
                yield name
                fields = [one.target for one in body if isinstance(one, ast.AnnAssign)]
                members = [one.name for one in body if isinstance(one, ast.FunctionDef)]
                yield from (f"{name}.{member}" for member in [*(f.id for f in fields), *members])


def test_identifiers_of_the_glossary_exist():
    symbols = PAGES["docs/reference/glossary.md"].partition("## Terms")[0]
    rows = [line.split("|")[1:-1] for line in symbols.splitlines() if line.startswith("| ")]
    assert {len(row) for row in rows} == {4}  # symbol, identifier, meaning, unit
    named = {name for row in rows for name in re.findall(r"`([\w.]+)`", row[1])}
    assert named - {name for tree in trees().values() for name in names_in(tree)} == set()
