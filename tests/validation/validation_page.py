"""`make validation`: compute the numbers of docs/validation.md and its figures.

    python tests/validation/validation_page.py docs/validation.md

Rows of other codes are computed where `make peers` has installed them, and stay elsewhere.
"""

import csv
import re
import shlex
import sys
from pathlib import Path
from shutil import copy
from statistics import median
from tempfile import TemporaryDirectory

from validation_rows import ROWS, Row, lifted_rate

from fem_seal import cli
from fem_seal.render.plot import new_figure
from fem_seal.tables import markdown


def filled(page: str, rows: dict[str, Row]) -> str:
    """The page with both numbers of each row, how far they are apart, and what would show."""
    for name, row in rows.items():
        numbers = f"{row.ours} | {row.reference} | {row.distance:+.2f} | {row.least_shown}"
        line = rf"^(\| `{name}` \| [^|]* \|)" + r" [^|]* \|" * 4
        page, count = re.subn(line, rf"\g<1> {numbers} |", page, flags=re.MULTILINE)
        assert count == 1, f"docs/validation.md has {count} rows `{name}`"
    return page


def with_part(page: str, part: str, text: str) -> str:
    """The page with `text` in a part that the Makefile writes; ValueError if it lacks one."""
    begin, end = f"<!-- {part}: written by make validation -->", f"<!-- end of {part} -->"
    before, rest = page.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n\n{text}\n\n{end}{after}"


def parts(page: str) -> dict[str, str]:
    """The heading above each row."""
    found, part = {}, ""
    for line in page.splitlines():
        if line.startswith("## "):
            part = line[3:]
        elif row := re.match(r"\| `([\w-]+)` \|", line):
            found[row[1]] = part
    return found


def lifted_grids() -> str:
    """Leak rates of one lifted patch on finer and finer grids of the contact."""
    rates = {n: lifted_rate(n) for n in (32, 64, 128, 256)}
    finest = rates[256].value
    lines = [
        (f"{n}²", str(rate), f"{100 * (rate.value / finest - 1):+.1f} %")
        for n, rate in rates.items()
    ]
    header = "contact grid", "leak rate with all counted errors [10⁻¹⁵ m³/s]", "from 256²"
    return markdown(header, lines)


def claims(page: str, picture: Path) -> str:
    """Run the study whose command the page names; a line for each method, and its picture."""
    command = re.search(r"    fem-seal (study (?:.*\\\n)*.*)", page)[1]
    words = shlex.split(command.replace("\\\n", " "))
    with TemporaryDirectory() as out:
        cli.main([*words, "--out", out])
        copy(Path(out) / "cross_validation.png", picture)
        with (Path(out) / "cross_validation.csv").open(newline="") as file:
            table = list(csv.DictReader(file))
    finest = max(table, key=lambda row: int(row["squares"]))["squares"]
    # The adaptive method has one grid, and bounds claim nothing: their mean does.
    claiming = [row["method"] for row in table if row["squares"] == finest and row["distance"]]
    lines = []
    for method in dict.fromkeys(claiming):
        rows = [row for row in table if row["method"] == method]
        claimed = [float(row["effectivity"]) for row in rows if row["effectivity"]]
        errors = [abs(float(row["error"])) for row in rows if row["squares"] == finest]
        wrong = sum(row["verdict"] == "disagrees" for row in rows)
        shares = f"{min(claimed):.2g}", f"{median(claimed):.2g}"
        lines.append((method, f"{100 * max(errors):.0f} %", *shares, f"{wrong} of {len(claimed)}"))
    header = f"largest error on {finest}²", "least effectivity", "median", "contradicted"
    return markdown(("method", *header), lines)


def figure(rows: dict[str, Row], part_of: dict[str, str], path: Path) -> None:
    """Both numbers of each row about the reference, in units of the sum of their errors."""
    with new_figure((7.5, 1.2 + 0.24 * len(rows)), path) as drawn:
        axes = drawn.subplots()
        axes.axvspan(-1, 1, color="0.93", zorder=0)
        axes.axvline(0, color="0.6", lw=0.8)
        parts = dict.fromkeys(part_of[name] for name in rows)
        colours = {part: f"C{k}" for k, part in enumerate(parts)}
        for k, (name, row) in enumerate(rows.items()):
            both = row.ours.half + row.reference.half
            share = row.ours.half / both if 0 < both < float("inf") else 0.0
            style = {"fmt": "o", "ms": 4, "capsize": 2, "color": colours[part_of[name]]}
            axes.errorbar(row.distance, k, xerr=share, **style)
        for part, colour in colours.items():
            axes.plot([], [], "o", ms=4, color=colour, label=part)
        drawn.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=8)
        axes.set_yticks(range(len(rows)), rows, fontsize=8)
        axes.set(ylim=(len(rows) - 0.5, -0.5), xlim=(-2.2, 2.2))
        axes.set_xlabel(
            "(fem_seal - reference) / (sum of both errors); bar: fem_seal's share of that sum"
        )


def main(page: Path) -> None:
    """Compute all rows and the study of claims, and write the page and its figures."""
    rows = {}
    for name in ROWS:
        rows[name] = ROWS[name](True)
        print(f"{name}: {rows[name].distance:+.2f}", flush=True)
    text = filled(page.read_text(encoding="utf-8"), rows)
    figure(rows, parts(text), page.with_suffix(".png"))
    claimed = claims(text, page.with_name("validation-claims.png"))
    text = with_part(with_part(text, "claims", claimed), "lifted", lifted_grids())
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
