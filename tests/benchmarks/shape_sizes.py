"""What a size field that follows the channels saves: unknowns at one tolerance, and the answer.

A rough contact on a square strip, meshed by gmsh with equal triangles and with triangles that grow
away from the contact; the bounds of the pixel triangulation are the reference for the gap itself.

    python tests/benchmarks/shape_sizes.py [samples]
"""

import sys

from rough_gaps import FLUID

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.scene.shape import Strip
from fem_seal.shaped import shaped_film
from fem_seal.surface import Spectrum, self_affine

L = 100e-6
# Largest and smallest edges in pixels; None: all are equal.
SIZES = (
    *((1, None), (0.5, None)),
    *((2, 1), (4, 1), (8, 1), (2, 0.5), (4, 0.5), (8, 0.5)),
)


def row(name: str, film: GridFilm | MeshFilm, reference: float) -> None:
    """Unknowns where the tolerance is reached, and the estimate."""
    flow = leak_rate(film, FlowSettings(rtol=0.05, **FLUID), every_dual=True)
    first, last = flow.levels[0], flow.levels[-1]
    print(
        f"{name:34} {first.unknowns:8} {last.unknowns:8} {100 * last.half_width:7.2f} "
        f"{flow.value:11.4e} {100 * (flow.value / reference - 1):+7.1f}"
    )


def main(n: int) -> None:
    """Print a table for each contact area; shortest wavelength eight samples."""
    surface = self_affine(Spectrum(0.8, L / 4, 8 * L / n), (n, n), (L, L), rms_slope=0.1, seed=3)
    for area in (0.1, 0.3):
        grid = press(surface, ElasticSolid(1e7), Load("area_fraction", area)).gap
        exact = leak_rate(GridFilm(grid), FlowSettings(rtol=0.01, **FLUID)).value
        print(f"\ncontact area {area:g}, {n} samples, pixel triangulation {exact:.4e} m³/s")
        print(f"{'mesh':34} {'first':>8} {'last':>8} {'±%':>7} {'m³/s':>11} {'off %':>7}")
        row("pixel triangulation", GridFilm(grid), exact)
        for largest, smallest in SIZES:
            sizes = {"mesh_size": largest * L / n, "smallest_size": smallest and smallest * L / n}
            strip = Strip(kind="strip", length=L, width=L, **sizes)
            growth = "equal," if smallest is None else f"{smallest:g} to"
            row(f"gmsh, {growth} {largest:g} pixels", shaped_film(strip, grid), exact)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 128)
