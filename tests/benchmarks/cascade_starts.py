"""How well the letter's cascade starts the finest grid, for docs/measurements/letter.md.

    python tests/benchmarks/cascade_starts.py [--largest 512]

Walls, linear-gap links, H = 0.8. Rows of one surface sample the same waves more and more finely.
"""

import argparse
from collections.abc import Iterator

from rough_gaps import Case

from fem_seal.film import GridFilm
from fem_seal.finite_difference.cascade import initial_error
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.grid import GridField
from fem_seal.letter.surfaces import RoughCase, at_area

# Long cut-off over the side where the shortest wave is a sixteenth of it.
LONG = 0.25


def gaps(largest: int) -> Iterator[tuple[str, GridField]]:
    """Gaps of at most so many samples along a side, and what they are."""
    sizes = [n for n in (64, 128, 256, 512) if n <= largest]
    for n in sizes:
        surface = RoughCase(n, short=n // 16, long=LONG).surface(1)
        yield f"no contact, shortest wave {n // 16} samples", at_area(surface, "bearing", 0.0).gap
    for n in [n for n in sizes if n >= 256]:
        surface = RoughCase(n, short=n // 16, long=LONG).surface(1)
        yield f"bearing 0.2, shortest wave {n // 16} samples", at_area(surface, "bearing", 0.2).gap
    for area, seed in ((0.23, 2), (0.38, 1)):
        gap = Case(256, 0.8, 4, area, seed).gap()
        yield f"elastic {area:g}, shortest wave 4 samples", gap
        if area < 0.3 and largest >= 512:
            yield "the same gap interpolated linearly", gap.refined()


def main(largest: int) -> None:
    """Print a row a gap."""
    for name, gap in gaps(largest):
        error = initial_error(flow_grid(GridFilm(gap), 1e-3, "linear-gap"))
        print(
            f"| {name} | {gap.shape[0]}² | {error.mean_field_energy:.2g} → "
            f"{error.cascade_energy:.2g} | {error.energy_reduction:.2g} "
            f"| {error.rms_reduction:.2g} |",
            flush=True,
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest", type=int, default=512)
    main(parser.parse_args().largest)
