"""Errors and orders over a series of grids: reynoldsflow, our finite differences and elements.

    make peers
    .venv/bin/python tests/benchmarks/grid_series_peer.py

The same gaps for all: three whose leak rate is known exactly, and one elastic contact, linear
between its samples, whose leak rate is known to ±0.5 % from its bounds. reynoldsflow takes the gap
at the centres of n × n squares, our methods at their corners; sides are periodic. Errors in per
cent, in brackets the order from the grid before. The elastic contacts themselves are solved by
Tamaas too, on three grids, and the leak rates of both gaps are compared.
"""

import argparse
import sys
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from peer_codes import contact, flow, gap_of, linear_samples
from rough_gaps import Case

from fem_seal.contact import press
from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.flow import FlowSettings, Limits, leak_rate
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine
from fem_seal.surface.resampling import resample
from fem_seal.theory import closed_forms

SIDES = "periodic"
SETTING = {"viscosity": 1 / 12, "pressure_drop": 1.0}
SMOOTH = 0.5 * np.log(1e4)
WAVE = 0.6
# Gap over the unit square, and its leak rate.
EXACT: dict[str, tuple[Callable, float]] = {
    "wave across the flow": (
        lambda x, y: 1 + WAVE * np.cos(2 * np.pi * x) + 0 * y,
        closed_forms.cosine_channel(WAVE, across=True),
    ),
    "wave along the flow": (
        lambda x, y: 1 + WAVE * np.cos(2 * np.pi * y) + 0 * x,
        closed_forms.cosine_channel(WAVE, across=False),
    ),
    "smooth checkerboard, contrast 1e4": (
        lambda x, y: np.cbrt(closed_forms.smooth_checkerboard(x, y, SMOOTH)),
        1.0,
    ),
}


def at_corners(gap: Callable, n: int) -> GridField:
    """Samples at the corners of n × n squares of the unit square."""
    x = np.linspace(0, 1, n + 1)
    return GridField(gap(x[:, None], x[None, :]), (1 / n, 1 / n))


def at_centres(gap: Callable, n: int) -> np.ndarray:
    """Samples at their centres."""
    x = (np.arange(n) + 0.5) / n
    return gap(x[:, None], x[None, :])


def ours(film: GridFilm) -> dict[str, float]:
    """Leak rates of one grid."""
    bounds = leak_rate(
        film, FlowSettings(method="uniform", rtol=1e-9, limits=Limits(unknowns=1), **SETTING)
    )
    return {
        "FD harmonic": by_differences(film, links="harmonic", **SETTING).value,
        "FD linear-gap": by_differences(film, **SETTING).value,
        "P1 upper": bounds.upper,
        "P1 lower": bounds.lower,
        "√(lo·hi)": bounds.value,
    }


def series(name: str, rows: dict[int, dict[str, float]], truth: float, known: float) -> None:
    """Print errors in per cent with orders, a line a method; the truth is `known` to that part."""
    sizes = list(rows)
    print(f"\n| {name} | " + " | ".join(f"{n}²" for n in sizes) + " |")
    print("| --- |" + " --- |" * len(sizes))
    for method in rows[sizes[0]]:
        errors = [rows[n][method] / truth - 1 for n in sizes]
        cells = [f"{100 * errors[0]:+.3g} %"]
        for coarse, fine in pairwise(errors):
            order = (
                ""
                if min(abs(coarse), abs(fine)) < known
                else f" ({np.log2(abs(coarse / fine)):.1f})"
            )
            cells.append(f"{100 * fine:+.2g} %{order}")
        print(f"| {method} | " + " | ".join(cells) + " |", flush=True)


def exact_cases(sizes: list[int]) -> None:
    """Gaps whose leak rate is known."""
    for name, (gap, exact) in EXACT.items():
        rows = {
            n: {"reynoldsflow": flow(at_centres(gap, n))["value"]}
            | ours(GridFilm(at_corners(gap, n), SIDES))
            for n in sizes
        }
        series(name, rows, exact, 1e-7)


def rough_case(n: int, area: float, finest: int) -> None:
    """One elastic contact; finer grids are finer samples of the same linear gap."""
    from fem_seal.verification.exact_cases import finer_film

    gap = Case(n, 0.8, 4, area, 3).gap()
    unit = GridField(gap.values / gap.values.max(), (1 / n, 1 / n), True)
    film = GridFilm(unit, SIDES)
    bracket = leak_rate(film, FlowSettings(rtol=0.01, **SETTING))
    rows = {
        n * 2**k: {"reynoldsflow": flow(linear_samples(unit.values, 2**k))["value"]}
        | ours(finer_film(film, k))
        for k in range(finest)
    }
    series(f"elastic contact, A/A0 = {area:g}", rows, bracket.value, 0.005)
    loose = leak_rate(film, FlowSettings(rtol=0.1, **SETTING))
    off = 100 * (loose.value / bracket.value - 1)
    print(f"adaptive, rtol 0.1: {off:+.2g} % with {loose.unknowns} unknowns, certified ±5 %")


def contacts(n: int, load: float) -> None:
    """Contact of the same surface on n, 2n and 4n points by Tamaas and by us, and their leaks."""
    heights = self_affine(Spectrum(0.8, n / 8, 4), (n, n), (n, n), rms_slope=0.1, seed=3)
    print("\n| contact grid | A/A0 ours | A/A0 Tamaas | Q Tamaas / Q ours - 1 | Q / Q on 4n |")
    print("| --- | --- | --- | --- | --- |")
    rows = []
    for m in (n, 2 * n, 4 * n):
        here = resample(heights, (m, m))
        own = press(here, 1.0, pressure=load, tolerance=1e-8).gap
        pressure, _ = contact("tamaas", here, load, 1e-8)
        gap, _ = gap_of(pressure, here, load)
        theirs = GridField(np.where(pressure > 0, 0, np.maximum(gap, 0)), here.spacing, True)
        leaks = [
            leak_rate(GridFilm(gap), FlowSettings(rtol=0.02, **SETTING)).value
            for gap in (own, theirs)
        ]
        rows.append((m, *(float(np.mean(g.values == 0)) for g in (own, theirs)), *leaks))
    for m, a, b, q, r in rows:
        print(f"| {m}² | {a:.4f} | {b:.4f} | {100 * (r / q - 1):+.2g} % | {q / rows[-1][3]:.3f} |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[16, 32, 64, 128])
    parser.add_argument("--n", type=int, default=128, help="samples of the elastic contact")
    options = parser.parse_args()
    exact_cases(options.sizes)
    for area in (0.2, 0.38):
        rough_case(options.n, area, 3)
    contacts(options.n // 2, 0.02)


if __name__ == "__main__":
    sys.exit(main())
