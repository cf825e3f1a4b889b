"""Random scenes by the default method, with and without the extension of its preconditioner.

python tests/benchmarks/contact_random.py [--scenes 500] [--sizes 24 160]
"""

import argparse

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.free_set_cg import ExtensionRule, free_set_cg
from fem_seal.contact.problem import Problem
from fem_seal.contact.settings import ElasticSolid
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, self_affine


def scene(seed: int, sizes: tuple[int, int]) -> tuple[GridField, dict[str, float]]:
    """Surface and load, E* = 1: a pressure in three of four scenes, else a mean gap."""
    draw = np.random.default_rng(seed)
    nx, ny = (int(n) for n in draw.integers(*sizes, 2))
    if draw.random() < 0.4:
        ny = nx
    hurst = draw.uniform(0.05, 1)
    long = max(draw.uniform(0.05, 1) * max(nx, ny), 8)
    short = max(draw.uniform(1, long / 3), 1.001) if draw.random() < 0.6 else 1.0
    spectrum = Spectrum(hurst, long, short)
    heights = self_affine(
        spectrum, (nx, ny), (nx, ny), rms_slope=1, seed=int(draw.integers(1_000_000))
    )
    if draw.random() < 0.75:
        return heights, {"pressure": 10 ** draw.uniform(-4, 0.3)}
    return heights, {"mean_gap": heights.values.std() * 10 ** draw.uniform(-1.5, 0.3)}


def iterations(heights: GridField, load: dict[str, float], rule: ExtensionRule) -> float:
    """Iterations from a uniform start to a certificate of 1e-6; nan if 2000 are not enough."""
    pair = ContactPair.prepared(heights, ElasticSolid(1.0))
    mean_gap = load["mean_gap"] / pair.unit_height if "mean_gap" in load else None
    pressure = load["pressure"] / pair.unit_pressure if "pressure" in load else None
    problem = Problem(pair.scaled_heights, pair.half_space, pressure, mean_gap)
    start = np.full(heights.shape, pressure or 0.0)
    for iterate in free_set_cg(problem, start, rule):
        if iterate.error <= 1e-6:
            return iterate.iteration
        if iterate.iteration == 2000:
            return np.nan


def main(scenes: int, sizes: tuple[int, int], first_seed: int) -> None:
    """Print failures, means, and the worst."""
    rules = ExtensionRule(), ExtensionRule(settled=0.0, settled_at_start=0.0)
    rows = []
    for seed in range(first_seed, first_seed + scenes):
        heights, load = scene(seed, sizes)
        rows.append([iterations(heights, load, rule) for rule in rules])
    extended, cut_off = np.transpose(rows)
    print(f"{scenes} scenes; with, without the extension")
    print("failed:", np.isnan(extended).sum(), np.isnan(cut_off).sum())
    print("iterations, mean:", np.nanmean(extended), np.nanmean(cut_off))
    print("iterations, most:", np.nanmax(extended), np.nanmax(cut_off))
    print("more than one iteration slower:", np.sum(extended > cut_off + 1))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--sizes", type=int, nargs=2, default=(24, 160))
    parser.add_argument("--first-seed", type=int, default=1000)
    arguments = parser.parse_args()
    main(arguments.scenes, tuple(arguments.sizes), arguments.first_seed)
