"""Sphinx extension that makes a page of each demo and of each scene: text, answer, pictures, code.

A demo is a Python file in the percent format: a cell begins with `# %%`, and one of text with
`# %% [markdown]`. Its function `main(out)` prints what was found and draws into the folder `out`. A
scene is run by `fem-seal run`; its first comment is its text.
"""

import inspect
import re
import runpy
import subprocess
import sys
from contextlib import redirect_stdout
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from sphinx.util import logging

from fem_seal.files import digest_of_sources

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PROGRESS = logging.getLogger(__name__)
DOCS = Path(__file__).parent
DEMOS = DOCS.parent / "demos"
GALLERY = DOCS / "gallery"
INDEX = """# Gallery

## Demos

Each asks one question, answers it with a picture, and asserts its claims: `python demos/NAME.py`.

```{{toctree}}
:maxdepth: 1

{demos}
```

## Scenes

Each is one file: `fem-seal run demos/scenes/NAME.toml`.

```{{toctree}}
:maxdepth: 1

{scenes}
```
"""


def setup(app: "Sphinx") -> dict[str, bool]:
    """Write the pages before Sphinx looks for them."""
    app.connect("builder-inited", lambda _: write_pages())
    return {"parallel_read_safe": True}


def write_pages() -> None:
    """Run the demos and scenes that have changed since their page was written; write the pages."""
    demos, scenes = sorted(DEMOS.glob("*.py")), sorted((DEMOS / "scenes").glob("*.toml"))
    (GALLERY / "scenes").mkdir(parents=True, exist_ok=True)
    names = {
        "demos": "\n".join(path.stem for path in demos),
        "scenes": "\n".join(f"scenes/{path.stem}" for path in scenes),
    }
    (GALLERY / "index.md").write_text(INDEX.format(**names))
    for source in (*demos, *scenes):
        make = page_of_demo if source.suffix == ".py" else page_of_scene
        folder = GALLERY / source.parent.relative_to(DEMOS) / source.stem
        page = folder.with_suffix(".md")
        stamp = f"% {sha256(source.read_bytes()).hexdigest()} {digest_of_sources()}\n"
        if not page.is_file() or not page.read_text().startswith(stamp):
            PROGRESS.info("running demos/%s", source.relative_to(DEMOS))
            page.write_text(stamp + make(source, folder))


def page_of_demo(demo: Path, out: Path) -> str:
    """Page of a demo: the first cell of text, the answer, then all other cells."""
    words = StringIO()
    before, sys.path[:] = list(sys.path), [str(DEMOS), *sys.path]
    try:
        main = runpy.run_path(str(demo), run_name="demo")["main"]
        with redirect_stdout(words):
            main(**({"out": out} if "out" in inspect.signature(main).parameters else {}))
    finally:
        sys.path[:] = before
    cells = re.split(r"^# %%", demo.read_text(), flags=re.MULTILINE)
    first, *others = (markdown_of(cell) for cell in cells if cell.strip())
    return "\n".join([first, fenced(words.getvalue(), "text"), pictures(out), *others])


def page_of_scene(scene: Path, out: Path) -> str:
    """Page of a scene: its comment, what the command prints, the pictures, the file."""
    command = ["run", str(scene), "--out", str(out), "--overwrite"]
    done = subprocess.run(
        [sys.executable, "-m", "fem_seal", *command], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"fem-seal run {scene.name}: {done.stderr}")
    comment, _, rest = scene.read_text().partition("\n\n")
    text = re.sub(r"^# ?", "", comment, flags=re.MULTILINE)
    # The last lines name the cost on this machine and the folder.
    lines = [ln for ln in done.stdout.splitlines() if not ln.startswith(("cost ", "result "))]
    answer = fenced("\n".join(lines), "text")
    return "\n".join([f"# {scene.stem}\n", text, "", answer, pictures(out), fenced(rest, "toml")])


def pictures(out: Path) -> str:
    """The pictures in a folder, each a paragraph."""
    shown = sorted(out.rglob("*.png"))
    return "".join(f"![{path.stem}]({path.relative_to(out.parent)})\n\n" for path in shown)


def markdown_of(cell: str) -> str:
    """A cell of a demo in Markdown, code in a fence."""
    head, _, body = cell.partition("\n")
    if "[markdown]" in head:
        return re.sub(r"^# ?", "", body, flags=re.MULTILINE).strip() + "\n"
    return fenced(body, "python")


def fenced(text: str, language: str) -> str:
    """Text in a fence."""
    return f"```{language}\n{text.strip()}\n```\n"
