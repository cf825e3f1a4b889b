"""External links of the pages are well formed, and each address is written in one way.

Whether they answer needs the internet: `make links`. Links between pages are checked by
`test_docs.py` and by Sphinx.
"""

import re
from urllib.parse import urlsplit

from project import ROOT

NAMES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff", "pyproject.toml")
PAGES = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in (*(ROOT / name for name in NAMES), *sorted((ROOT / "docs").rglob("*.md")))
    if path.relative_to(ROOT).parts[:2] not in {("docs", "_build"), ("docs", "gallery")}
}
ADDRESS = re.compile(r"\b\w+://[^\s)>\"'`\]]+")
LINKS = sorted({(link, name) for name, text in PAGES.items() for link in ADDRESS.findall(text)})
# Identifiers whose form their registries define.
FORMS = {
    "doi.org": re.compile(r"/10\.\d{4,9}/[\w.();:/-]+\w"),
    "arxiv.org": re.compile(r"/abs/\d{2}(0[1-9]|1[0-2])\.\d{4,5}"),
}


def faults(link: str) -> list[str]:
    """What is wrong with an address."""
    parts = urlsplit(link)
    found = []
    if parts.scheme != "https":
        found.append("not https")
    if not re.fullmatch(r"([a-z0-9-]+\.)+[a-z]{2,}", parts.netloc):
        found.append("no host of the internet")
    if link[-1] in ".,;:":
        found.append("ends in a mark of the sentence around it")
    form = FORMS.get(parts.netloc)
    if form and not form.fullmatch(parts.path):
        found.append(f"no identifier of {parts.netloc}")
    return found


def plain(link: str) -> str:
    """An address without what makes no difference to the page."""
    parts = urlsplit(link)
    host = parts.netloc.removeprefix("www.").removeprefix("dx.")
    return f"{host}{parts.path.rstrip('/')}?{parts.query}".lower()


def test_links_are_well_formed():
    assert LINKS
    assert not [f"{page}: {link}" for link, page in LINKS if faults(link)]


def test_each_address_is_written_in_one_way():
    written = {}
    for link, _ in LINKS:
        written.setdefault(plain(link), set()).add(link.partition("#")[0])
    assert not [forms for forms in written.values() if len(forms) > 1]


def test_every_address_of_a_page_is_a_link():
    """Markdown shows a bare address as text: nobody can follow it."""
    pages = "\n".join(text for name, text in PAGES.items() if name.endswith(".md"))
    text = re.sub(r"```.*?```|`[^`\n]*`", "", pages, flags=re.DOTALL)
    assert not [
        match[0]
        for match in ADDRESS.finditer(text)
        if not text[max(match.start() - 2, 0) : match.start()].endswith(("](", "<"))
    ]
