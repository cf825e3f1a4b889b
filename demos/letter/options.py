"""Options of the letter's script."""

import argparse
from collections.abc import Callable
from pathlib import Path

from fem_seal.cli.options import add_work

PARTS = {
    "thresholds": "where contact percolates",
    "currents": "leak rates of Fig. 3",
    "differences": "finite differences in Fig. 3",
    "grids": "error of the contact's grid in Fig. 3, for the first seed",
    "pictures": "Figs. 1 and 2",
    "cascade": "start of the cascade",
}


def parser() -> argparse.ArgumentParser:
    """Command line."""
    top = argparse.ArgumentParser(
        prog="python -m demos.letter.reproduce",
        description="The 2012 letter on percolation and leakage of rough contacts, with errors.",
        epilog="Parts: " + "; ".join(f"{name}: {text}" for name, text in PARTS.items()) + ".",
    )

    def several(kind: type) -> Callable[[str], tuple]:
        read = lambda text: tuple(kind(part) for part in text.split(","))  # noqa: E731
        read.__name__ = f"list of {kind.__name__}"  # for argparse's message
        return read

    cases = "; thresholds for all values, the rest for the first"
    for name, kind, default, metavar, text in (
        ("size", several(int), (256,), "V1,V2,…", f"samples along a side (256){cases}"),
        ("hurst", several(float), (0.8,), "V1,V2,…", f"Hurst exponent (0.8){cases}"),
        ("short", several(float), (1.0,), "V1,V2,…", f"short cut-off, in samples (1){cases}"),
        ("long", several(float), (0.125,), "V1,V2,…", f"long cut-off over the side (0.125){cases}"),
        ("seeds", int, 3, "N", "surfaces 1 to N (3)"),
        ("rtol", float, 0.1, "RTOL", "width of certified brackets (0.1)"),
        ("areas", several(float), None, "V1,…", "A/A0 of Fig. 3 (0.02 to closing)"),
        ("refine", int, 2, "FACTOR", "finer grids (2)"),
        ("resolution", float, 0.002, "A", "of thresholds, in A/A0 (0.002)"),
        ("out", Path, Path("results/letter"), "DIR", "folder; its points stay (results/letter)"),
    ):
        top.add_argument(f"--{name}", type=kind, default=default, metavar=metavar, help=text)
    top.add_argument(
        "--only",
        nargs="+",
        default=tuple(PARTS),
        metavar="PART",
        choices=tuple(PARTS),
        help="parts to compute (all); a later run adds others",
    )
    add_work(top)
    return top
