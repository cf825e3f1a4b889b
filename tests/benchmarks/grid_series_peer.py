"""Errors and orders over a series of grids: reynoldsflow, our finite differences and elements.

    make peers
    .venv/bin/python tests/benchmarks/grid_series_peer.py

The same gaps for all: three whose leak rate is known exactly, and elastic contacts, linear between
their samples, whose leak rate is known to ±0.5 % from its bounds. reynoldsflow takes the gap at the
centres of n × n squares with periodic sides, our methods at their corners (`study exact`). Errors
in per cent, in brackets the order from the grid before.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from peer_codes import flow, linear_samples
from rough_gaps import Case

from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.grid import GridField
from fem_seal.tables import markdown
from fem_seal.verification.cross_validation import Row, StudiedGap, compare
from fem_seal.verification.exact_cases import CASES

OURS = ("harmonic", "linear-gap", "uniform")


def error_at_centres(name: str, n: int) -> float:
    """Relative error of reynoldsflow on the centres of n × n squares of an exact case."""
    [film] = CASES[name].films(2 * n)
    samples = film.gap.values[1::2, 1::2]
    times = n // samples.shape[1]  # half of a channel that is the same across it
    return flow(np.tile(samples, (1, times)))["value"] / (times * CASES[name].exact) - 1


def show(name: str, rows: Sequence[Row], theirs: dict[int, float], known: float) -> None:
    """Print errors with orders, a line a method; their orders where errors are above `known`."""
    cells = {"reynoldsflow": [f"{100 * error:+.2g} %" for error in theirs.values()]}
    for k, (coarse, fine) in enumerate(pairwise(theirs.values()), start=1):
        if min(abs(coarse), abs(fine)) > known:
            cells["reynoldsflow"][k] += f" ({np.log2(abs(coarse / fine)):.1f})"
    for row in rows:
        order = "" if row.order is None else f" ({row.order:.1f})"
        cells.setdefault(row.method, []).append(f"{100 * row.error:+.2g} %{order}")
    # The adaptive method has one grid.
    lines = [(method, *line, *[""] * (len(theirs) - len(line))) for method, line in cells.items()]
    print(markdown((name, *(f"{n}²" for n in theirs)), lines), flush=True)


def rough_case(n: int, area: float, finest: int) -> None:
    """One elastic contact; finer grids are finer samples of the same linear gap."""
    gap = Case(n, 0.8, 4, area, 3).gap()
    unit = GridField(gap.values / gap.values.max(), (1 / n, 1 / n), True)
    film, settings = GridFilm(unit, "periodic"), FlowSettings(1 / 12, 1.0, rtol=0.01)
    studied = StudiedGap.of_film(film, settings, finest)
    rows, reference = compare([studied], (*OURS, "adaptive"))[0]
    theirs = {
        n * 2**k: flow(linear_samples(unit.values, 2**k))["value"] / reference.value - 1
        for k in range(finest)
    }
    show(f"elastic contact, A/A0 = {area:g}", rows, theirs, 0.005)
    loose = leak_rate(film, replace(settings, rtol=0.1))
    off = 100 * (loose.value / reference.value - 1)
    print(f"adaptive, rtol 0.1: {off:+.2g} % with {loose.unknowns} unknowns, guaranteed ±5 %")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[16, 32, 64, 128])
    parser.add_argument("--n", type=int, default=128, help="samples of the elastic contact")
    options = parser.parse_args()
    for name in ("cosine-across", "cosine-along", "smooth-checkerboard"):
        rows, _ = compare([StudiedGap.of_case(CASES[name], options.sizes)], OURS)[0]
        show(name, rows, {n: error_at_centres(name, n) for n in options.sizes}, 1e-7)
    for area in (0.2, 0.38):
        rough_case(options.n, area, 3)


if __name__ == "__main__":
    sys.exit(main())
