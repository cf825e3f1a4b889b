"""What contacts, bounds, lifts, shapes and the refinement's numbers cost: docs/measurements.

    python tests/benchmarks/costs.py bounds [--sizes 1024 --area 0.37 --rtol 0.02]
    python tests/benchmarks/costs.py refinement [--rtol 0.04] [--only "theta 0.8"]
    python tests/benchmarks/costs.py lift [--sizes 256]
    python tests/benchmarks/costs.py shapes [--sizes 128]
    python tests/benchmarks/costs.py areas pressure area_fraction [--sizes 256 512]

`bounds`: elastic contacts between side walls. `refinement`: each number of the adaptive refinement
on 13 gaps, over those as shipped. `lift`: CPU time and peak memory over those of the
dry run, rough rubber at three loads from open to next to closing, the fluid at 5 to 80 % of each.
`shapes`: what a size field that follows the channels saves, on gmsh's meshes of a square strip;
"off" is from the answer on the pixel triangulation. `areas`: pairs of transforms of a contact by
area over those by the same pressure. `pressure`, `area_fraction`: of 20 warm-started loads over 20
cold solves; pairs do not depend on the machine. The memory is that of the process with the
libraries (0.2 GB).
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from rough_gaps import FLUID, VARIETY, Case, cost_of

from fem_seal import Scene
from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.contact.predictor import extrapolated
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, Limits, Tuning, leak_rate
from fem_seal.patch import Patch
from fem_seal.scene.shape import Strip
from fem_seal.shaped import shaped_film
from fem_seal.surface import Spectrum, self_affine

BUDGETS = [
    *((256, 0.41, 0.05), (256, 0.41, 0.02), (256, 0.23, 0.03), (512, 0.40, 0.03)),
    *((512, 0.22, 0.02), (1024, 0.37, 0.02), (2048, 0.37, 0.02), (4096, 0.20, 0.06)),
    (4096, 0.37, 0.06),
]
OTHERS = {
    **{"chi": (0.01, 0.3), "theta": (0.5, 0.8, 0.95), "theta_blocked": (0.5, 0.85, 0.0)},
    **{"theta_residual": (0.0, 0.9), "ahead": (0, 1, 4), "cut": (1e-1, 1e-3), "floor": (1e-2,)},
    **{"ceiling": (20.0, np.inf), "tolerance": (1e-6, 1e-10), "coarsest": (16, 64)},
}
CHOICES = {"as shipped": Tuning()} | {
    f"{name} {value:g}": replace(Tuning(), **{name: value})
    for name, values in OTHERS.items()
    for value in values
}
SCENE = Path(__file__).parents[2] / "demos" / "scenes" / "first.toml"
AREAS = (0.01, 0.05, 0.18, 0.4, 0.7)
SURFACES = [(0.8, 1), (0.4, 1), (0.4, 4)]  # Hurst exponent, short cut-off in samples
PATHS = {  # p / (E* h'rms), or A/A0
    "pressure": {
        "0.0125 to 0.025, equal steps": np.linspace(0.0125, 0.025, 20),
        "0.2 to 0.4, equal steps": np.linspace(0.2, 0.4, 20),
        "0.02 to 0.4, equal steps": np.linspace(0.02, 0.4, 20),
        "0.004 to 0.4, equal ratios": np.geomspace(0.004, 0.4, 20),
    },
    "area_fraction": {
        "0.03 to 0.06, equal steps": np.linspace(0.03, 0.06, 20),
        "0.4 to 0.6, equal steps": np.linspace(0.4, 0.6, 20),
        "0.05 to 0.6, equal steps": np.linspace(0.05, 0.6, 20),
    },
}
SOLID = ElasticSolid(10.0)  # so that E* h'rms = 1
Rows = Iterator[dict[str, object]]


def bounds(given: argparse.Namespace) -> Rows:
    """Unknowns and CPU time of the gaps of `BUDGETS`, or of others."""
    for n, a, r in [(n, given.area, given.rtol) for n in given.sizes] or BUDGETS:
        film, settings = GridFilm(Case(n, 0.8, 4, a, 1).gap()), FlowSettings(rtol=r, **FLUID)
        leak, cpu, memory = cost_of(lambda: leak_rate(film, settings))  # noqa: B023
        seconds = [sum(level.seconds.values()) for level in leak.levels]
        last = leak.levels[-1]
        yield {
            **{"n": n, "A/A0": a, "half-width": f"±{100 * last.half_width:.2f} %"},
            **{"unknowns": leak.unknowns, "levels": len(leak.levels)},
            "CG": max(i for level in leak.levels for i in level.iterations.values()),
            **{"CPU s": f"{cpu:.1f}", "all levels / last": f"{sum(seconds) / seconds[-1]:.1f}"},
            "both solves / one": f"{1 + last.seconds['dual'] / last.seconds['primal']:.1f}",
            "GB": f"{memory / 1e9:.2f}",
        }


def refinement(given: argparse.Namespace) -> Rows:
    """All choices on one gap, then the next: a machine that is slower for a while is so for all."""
    ratios: dict[str, list[tuple[float, float]]] = {name: [] for name in given.only or CHOICES}
    settings = FlowSettings(rtol=given.rtol, limits=Limits(unknowns=400_000), **FLUID)
    for case in VARIETY:
        film, shipped = GridFilm(case.gap(), sides="periodic"), None
        for name, of_choice in ratios.items():
            tuning = CHOICES[name]
            leak, seconds, _ = cost_of(lambda: leak_rate(film, settings, tuning=tuning))  # noqa: B023
            shipped = shipped or (leak.unknowns, seconds)
            of_choice.append((leak.unknowns / shipped[0], seconds / shipped[1]))
            means = np.exp(np.mean(np.log(of_choice), axis=0))
            yield {
                **{"gap": case, "choice": name, "unknowns": leak.unknowns},
                **{"half-width": f"±{100 * leak.levels[-1].half_width:.2f} %"},
                **{"levels": len(leak.levels), "CPU s": f"{seconds:.1f}"},
                "CG": max(i for level in leak.levels for i in level.iterations.values()),
                "means so far: unknowns, CPU": "× {:.2f}, × {:.2f}".format(*means),
                "ended by": leak.reason,
            }


def lift(given: argparse.Namespace) -> Rows:
    """Scenes of demos/scenes/first.toml, with their dry runs and the geometric means."""
    ratios = []
    shares = 0.05, 0.2, 0.5, 0.8  # of the fluid's pressure in the load
    for n, load, share in product(given.sizes or [256], (0.08e6, 0.15e6, 0.22e6), shares):
        settings = [f"surface.shape=[{n}, {n}]", f"contact.pressure={load}"]
        settings += [f"flow.pressure_drop={share * load}", 'output.products=["leak_rate"]']
        costs = []
        # The first one again: nothing is compiled in what is timed.
        for how in ("none", "none", "resolved"):
            patch = Patch(Scene.from_file(SCENE, [*settings, f"flow.lift={how}"]))
            _, seconds, memory = cost_of(lambda: patch.leak_rate)  # noqa: B023
            costs.append((seconds, memory, patch.film.contact_area_fraction))
        (dry, low, area), (lifted, high, lifted_area) = costs[1:]
        ratios.append((lifted / dry, high / low))
        yield {
            **{"n": n, "P0 [MPa]": load / 1e6, "p_in/P0": share, "dry A/A0": f"{area:.3f}"},
            **{"lifted": f"{lifted_area:.3f}", "steps": patch.lifted.steps},
            **{"settled": patch.lifted.converged, "CPU dry [s]": f"{dry:.2f}"},
            **{"CPU": f"{ratios[-1][0]:.2f}", "memory": f"{ratios[-1][1]:.2f}"},
            "means so far": "{:.2f} {:.2f}".format(*np.exp(np.mean(np.log(ratios), axis=0))),
        }


def shapes(given: argparse.Namespace) -> Rows:
    """Meshes with equal triangles and with triangles that grow away from the contact."""
    L = 100e-6
    # Largest and smallest edges in pixels; None: all are equal.
    edges = [(1, None), (0.5, None), *product((2, 4, 8), (1, 0.5))]
    for n, area in product(given.sizes or [128], (0.1, 0.3)):
        surface = self_affine(
            Spectrum(0.8, L / 4, 8 * L / n), (n, n), (L, L), rms_slope=0.1, seed=3
        )
        grid = press(surface, ElasticSolid(1e7), Load("area_fraction", area)).gap
        exact = leak_rate(GridFilm(grid), FlowSettings(rtol=0.01, **FLUID)).value
        films = {"pixel triangulation": GridFilm(grid)}
        for largest, smallest in edges:
            lengths = {"mesh_size": largest * L / n, "smallest_size": smallest and smallest * L / n}
            strip = Strip(kind="strip", length=L, width=L, **lengths)
            growth = "equal," if smallest is None else f"{smallest:g} to"
            films[f"gmsh, {growth} {largest:g} pixels"] = shaped_film(strip, grid)
        for name, film in films.items():
            flow = leak_rate(film, FlowSettings(rtol=0.05, **FLUID), every_dual=True)
            first, last = flow.levels[0], flow.levels[-1]
            yield {
                **{"n": n, "A/A0": area, "mesh": name, "first": first.unknowns},
                **{"last": last.unknowns, "half-width": f"±{100 * last.half_width:.2f} %"},
                **{"m³/s": f"{flow.value:.4e}", "off": f"{100 * (flow.value / exact - 1):+.1f} %"},
            }


def areas(given: argparse.Namespace) -> Rows:
    """Contacts by area, λ_s of four samples; all states have a certificate of 1e-6."""
    for n, hurst, area in product(given.sizes or [256], (0.4, 0.8), AREAS):
        heights = Case(n, hurst, 4, 0, 1).heights()
        found = press(heights, SOLID, Load("area_fraction", area))
        again = press(heights, SOLID, Load("pressure", found.mean_pressure))
        ratio = f"{found.fft_pairs / again.fft_pairs:.2f}"
        pairs = {"by area": found.fft_pairs, "by pressure": again.fft_pairs, "ratio": ratio}
        yield {"n": n, "H": hurst, "A/A0": area} | pairs


def path(given: argparse.Namespace, kind: str) -> Rows:
    """Loads one after another."""
    for n, (hurst, short), (name, loads) in product(
        given.sizes or [256], SURFACES, PATHS[kind].items()
    ):
        heights = Case(n, hurst, short, 0, 1).heights()
        states, cold, warm = [], 0.0, 0.0
        for load in (Load(kind, x) for x in loads):
            cold += press(heights, SOLID, load).fft_pairs
            state = press(heights, SOLID, load, start=extrapolated(load.value, states))
            states.append((load.value, state))
            warm += state.fft_pairs
        cells = {"cold pairs": f"{cold / len(loads):.1f}", "warm / cold": f"{warm / cold:.2f}"}
        yield {"n": n, "H": hurst, "λs": short, kind: name} | cells


def main() -> None:
    """Print each row of each part as soon as it is known."""
    parts = {"bounds": bounds, "refinement": refinement, "lift": lift}
    parts |= {"shapes": shapes, "areas": areas} | {kind: partial(path, kind=kind) for kind in PATHS}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="+", choices=parts)
    parser.add_argument("--sizes", type=int, nargs="+", default=[])
    parser.add_argument("--area", type=float, default=0.4, help="of bounds with --sizes")
    parser.add_argument("--rtol", type=float, default=0.05, help="the same, and of refinement")
    parser.add_argument("--only", nargs="*", choices=CHOICES, help="choices of refinement")
    given = parser.parse_args()
    for part in given.parts:
        for k, row in enumerate(parts[part](given)):
            lines = [row.values()] if k else [row, ["---"] * len(row), row.values()]
            for line in lines:
                print("|", " | ".join(map(str, line)), "|", flush=True)


if __name__ == "__main__":
    main()
