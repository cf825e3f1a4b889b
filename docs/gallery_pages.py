"""Sphinx extension that makes a page of each demo: its text, its code, its words and pictures.

A demo is a Python file in the percent format: a cell begins with `# %%`, and one of text with
`# %% [markdown]`. Its function `main(out)` prints what was found and draws into the folder `out`.
"""

import inspect
import re
import runpy
import sys
from contextlib import redirect_stdout
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PROGRESS = logging.getLogger(__name__)
DOCS = Path(__file__).parent
DEMOS = DOCS.parent / "demos"
INDEX = """# Gallery

Each demo asks one question, answers it with a picture, and asserts its claims. The files are in
`demos/`; `python demos/NAME.py` runs one.

```{{toctree}}
:maxdepth: 1

{}
```
"""


def setup(app: "Sphinx") -> dict[str, bool]:
    """Write the pages before Sphinx looks for them."""
    app.connect("builder-inited", lambda _: write_pages())
    return {"parallel_read_safe": True}


def write_pages() -> None:
    """Run the demos that have changed since their page was written, and write the pages."""
    names = [path.stem for path in sorted(DEMOS.glob("*.py"))]
    folder = DOCS / "gallery"
    folder.mkdir(exist_ok=True)
    (folder / "index.md").write_text(INDEX.format("\n".join(names)))
    for name in names:
        demo, page = DEMOS / f"{name}.py", folder / f"{name}.md"
        stamp = f"% {sha256(demo.read_bytes()).hexdigest()}\n"
        if not page.is_file() or not page.read_text().startswith(stamp):
            PROGRESS.info("running demos/%s.py", name)
            words, pictures = run(demo, folder / name)
            page.write_text(stamp + "\n".join(page_of(demo.read_text(), words, pictures)))


def run(demo: Path, out: Path) -> tuple[str, list[Path]]:
    """Words and pictures of a demo."""
    words = StringIO()
    before, sys.path[:] = list(sys.path), [str(DEMOS), *sys.path]
    try:
        main = runpy.run_path(str(demo), run_name="demo")["main"]
        with redirect_stdout(words):
            main(**({"out": out} if "out" in inspect.signature(main).parameters else {}))
    finally:
        sys.path[:] = before
    return words.getvalue(), sorted(out.rglob("*.png"))


def page_of(text: str, words: str, pictures: list[Path]) -> list[str]:
    """Lines of a page in Markdown: the first cell of text, the answer, then all other cells."""
    cells = [cell for cell in re.split(r"^# %%", text, flags=re.MULTILINE) if cell.strip()]
    first, *others = map(markdown_of, cells)
    shown = [f"![{path.stem}]({path.relative_to(DOCS / 'gallery')})\n" for path in pictures]
    return [first, "```text", words.rstrip(), "```\n", *shown, *others]


def markdown_of(cell: str) -> str:
    """A cell in Markdown, code in a fence."""
    head, _, body = cell.partition("\n")
    if "[markdown]" in head:
        return re.sub(r"^# ?", "", body, flags=re.MULTILINE).strip() + "\n"
    return f"```python\n{body.strip()}\n```\n"
