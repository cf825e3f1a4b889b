"""`make validation`: compute the rows and write their tables and their figure into docs/.

    python tests/validation/validation_page.py docs/validation.md

Rows of other codes are computed where `make peers` has installed them; elsewhere the page says so.
"""

import sys
from itertools import groupby
from pathlib import Path

from bounds_study import study
from project import with_part
from validation_rows import ROWS, Row, lifted_rate

from fem_seal.render.plot import new_figure
from fem_seal.tables import markdown

HEADER = (
    "row",
    "claim",
    "fem_seal",
    "reference",
    "apart",
    "shows",
    "source",
    "the two errors",
    "also in",
)


def tables(rows: dict[str, Row]) -> str:
    """A table for each part, in the order of the rows."""
    sections = []
    for part, group in groupby(rows.items(), lambda item: item[1].part):
        lines = [
            (
                *(f"`{name}`", row.claim, str(row.ours), str(row.reference)),
                *(
                    f"{row.distance:+.2f}",
                    row.least_shown,
                    row.source,
                    row.errors,
                    f"`{row.tests}`",
                ),
            )
            for name, row in group
        ]
        sections.append(f"## {part[0].upper()}{part[1:]}\n\n{markdown(HEADER, lines)}")
    return "\n\n".join(sections)


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


def figure(rows: dict[str, Row], path: Path) -> None:
    """Both numbers of each row about the reference, in units of the sum of their errors."""
    with new_figure((7.5, 1.2 + 0.24 * len(rows)), path) as drawn:
        axes = drawn.subplots()
        axes.axvspan(-1, 1, color="0.93", zorder=0)
        axes.axvline(0, color="0.6", lw=0.8)
        parts = dict.fromkeys(row.part for row in rows.values())
        colours = {part: f"C{k}" for k, part in enumerate(parts)}
        for k, row in enumerate(rows.values()):
            both = row.ours.half + row.reference.half
            share = row.ours.half / both if 0 < both < float("inf") else 0.0
            style = {"fmt": "o", "ms": 4, "capsize": 2, "color": colours[row.part]}
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
    """Compute all rows and the study of the bounds, and write the page and its figures."""
    rows = {}
    for name in ROWS:
        rows[name] = ROWS[name](True)
        print(f"{name}: {rows[name].distance:+.2f}", flush=True)
    figure(rows, page.with_suffix(".png"))
    bounds = study(64, page.with_name("validation-bounds.png"))
    text = with_part(page.read_text(encoding="utf-8"), "rows", tables(rows))
    text = with_part(with_part(text, "bounds", bounds), "lifted", lifted_grids())
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
