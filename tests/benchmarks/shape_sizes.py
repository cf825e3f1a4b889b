"""What a size field that follows the channels saves: unknowns at one tolerance, and the answer.

A rough contact on a square strip, meshed by gmsh with equal triangles and with triangles that grow
away from the contact; the bounds of the pixel triangulation are the reference for the gap itself.

    python tests/benchmarks/shape_sizes.py [samples]
"""

import sys

from fem_seal.contact import press
from fem_seal.fenicsx import MPI
from fem_seal.film import GridFilm
from fem_seal.film.shaped import shaped_film
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.grid import GridField
from fem_seal.scene import Scene
from fem_seal.surface import Spectrum, self_affine

L = 100e-6
FLUID = {"viscosity": 1e-3, "pressure_drop": 1e5}
RTOL = 0.05


def contact(n: int, area: float) -> GridField:
    """Elastic contact, shortest wavelength eight samples."""
    surface = self_affine(Spectrum(0.8, L / 4, 8 * L / n), (n, n), (L, L), rms_slope=0.1, seed=3)
    return press(surface, 1e7, area_fraction=area).gap


def shape(largest: float, smallest: float | None) -> Scene:
    """Strip as large as the contact."""
    strip = {"kind": "strip", "length": L, "width": L, "mesh_size": largest}
    if smallest is not None:
        strip["smallest_size"] = smallest
    return Scene.from_mapping(
        {
            "shape": strip,
            "gap": {"path": __file__},  # any file: the gap is handed over below
            "output": {"products": ["contact"]},
        }
    )


def row(name: str, gap, reference: float) -> None:
    """Unknowns where the tolerance is reached, and the estimate."""
    flow = leak_rate(GridFilm(gap), FlowSettings(rtol=RTOL, **FLUID), every_dual=True)
    first, last = flow.levels[0], flow.levels[-1]
    difference = flow.value / reference - 1
    print(
        f"{name:34} {first.unknowns:8} {last.unknowns:8} {100 * last.half_width:7.2f} "
        f"{flow.value:11.4e} {100 * difference:+7.1f}"
    )


def main() -> None:
    """Print the tables."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 128
    pixel = L / n
    for area in (0.1, 0.3):
        grid = contact(n, area)
        exact = leak_rate(GridFilm(grid), FlowSettings(rtol=0.01, **FLUID))
        print(f"\ncontact area {area:g}, {n} samples, pixel triangulation {exact.value:.4e} m³/s")
        print(f"{'mesh':34} {'first':>8} {'last':>8} {'±%':>7} {'m³/s':>11} {'off %':>7}")
        row("pixel triangulation", grid, exact.value)
        for largest, smallest in (
            (1, None),
            (0.5, None),
            (2, 1),
            (4, 1),
            (8, 1),
            (2, 0.5),
            (4, 0.5),
            (8, 0.5),
        ):
            sizes = (largest * pixel, None if smallest is None else smallest * pixel)
            name = (
                f"gmsh, equal, {largest:g} pixels"
                if smallest is None
                else (f"gmsh, {smallest:g} to {largest:g} pixels")
            )
            row(name, shaped_film(shape(*sizes).shape, grid), exact.value)


if __name__ == "__main__" and MPI.COMM_WORLD.rank == 0:
    main()
