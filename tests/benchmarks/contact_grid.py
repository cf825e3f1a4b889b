"""How well the entry "contact grid" holds, for docs/guide/contact-grid.md.

    python tests/benchmarks/contact_grid.py [--count 100] [--lift | --area] [--samples 4 6 8]
    python tests/benchmarks/contact_grid.py --sealed [--count 100] [--samples 1 2 3 4 6]

Random contacts from open to closing, on 64² samples and every fifth on 128². Each is solved on 4n
samples as well. A line a contact: what was claimed, and how far the finer grid is. Or dry contacts
of 16² to 32² samples under 1 to 2 times the load that seals them, of which a line tells whether
they are said to stay sealed, and whether 2n and 4n samples leak.
"""

import argparse
import random
from dataclasses import replace
from math import inf, log
from pathlib import Path
from statistics import median

from fem_seal.errors import NotConverged
from fem_seal.grid_series import (
    change_of,
    critical_gap,
    error_of_sealed,
    estimated_error,
    on_half,
    rate_range,
    unresolved,
)
from fem_seal.patch import Given, Patch
from fem_seal.scene import Scene
from fem_seal.surface.resampling import resample
from fem_seal.threshold import sealing_load

FIRST, LENGTH = Path(__file__).parents[2] / "demos" / "scenes" / "first.toml", 1e-4
FINER, RTOL = 4, 0.015  # the reference: samples over those of the contact, tolerance of its flow


def scene(number: int, lift: bool, shortest: list[int], by_area: bool = False) -> Scene:
    """A rubber on a random surface, dry or lifted by a fluid of up to most of the load.

    With `by_area` the dry contact has an area in place of a load.
    """
    chosen = random.Random(number)
    n = 64 if number % 5 else 128
    samples, waves = chosen.choice(shortest), chosen.choice([2, 4, 8])
    while n / samples < 1.5 * waves:
        waves //= 2
    hurst, load = chosen.choice([0.5, 0.8, 0.8, 1.0]), 1e6 * chosen.uniform(0.04, 0.32)
    drop = chosen.choice([2e4, 5e4, 1e5]) if lift else 1e5
    pressed = {"pressure": max(load, 1.3 * drop) if lift else load}
    if by_area:
        pressed = {"area_fraction": chosen.uniform(0.05, 0.38)}
    surface = {"shape": [n, n], "hurst": hurst, "seed": 1000 + number}
    surface |= {"long_wavelength": LENGTH / waves, "short_wavelength": LENGTH * samples / n}
    changes = {f"surface.{key}": value for key, value in surface.items()}
    changes |= {"flow.pressure_drop": drop, "flow.lift": "resolved" if lift else "none"}
    return Scene.from_file(FIRST).with_({"contact": pressed, **changes})


def logarithm(one: float, other: float) -> float:
    """Ln of a ratio of leak rates, of which the second leaks."""
    return log(one / other) if one > 0 else -inf


def sealed_contacts(first: int, count: int, shortest: list[int]) -> None:
    """Print sealed contacts, and how many that are said to stay so leak on finer grids."""
    claimed, wrong = 0, 0
    for number in range(first, first + count):
        chosen = random.Random(number)
        of = scene(number, False, shortest)
        n, samples = chosen.choice([16, 24, 32]), chosen.choice(shortest)
        waves = min(chosen.choice([1, 2, 4]), n / samples / 1.2)
        surface = {"shape": [n, n], "hurst": chosen.uniform(0.1, 1)}
        surface |= {"long_wavelength": LENGTH / waves, "short_wavelength": LENGTH * samples / n}
        of = of.with_({f"surface.{key}": value for key, value in surface.items()})
        seals = sealing_load(Patch(of))
        if not seals:
            continue
        for part in (1, 1.02, 1.05, 1.1, 1.2, 1.3, 1.5, 2):
            patch = Patch(of.with_({"contact.pressure": part * seals}))
            stays = patch.sealed and error_of_sealed(patch).upper == 1
            finer = [
                patch.with_(Given(surface=resample(patch.surface, (k * n, k * n))))
                for k in (2, FINER)
            ]
            leaks = not any(one.sealed for one in finer)
            claimed, wrong = claimed + stays, wrong + (stays and leaks)
            said = "stays sealed" if stays else "may leak"
            true = "leaks" if leaks else "sealed"
            print(f"{number:5d} {samples} samples, {part} of the load: {said}; {true}", flush=True)
    print(f"{claimed} said to stay sealed, of which {wrong} leak on 2n and 4n samples")


def main(first: int, count: int, lift: bool, by_area: bool, shortest: list[int]) -> None:
    """Print contacts until so many leak, and how often the claims held."""
    leaking, held, ratios, closed, sealed = 0, 0, [], [], [0, 0, 0]
    for number in range(first, first + 10 * count):
        if leaking == count:
            break
        try:
            patch = Patch(scene(number, lift, shortest, by_area))
            leak = patch.leak_rate
            if leak.state == "lifted off" or not leak.converged:
                continue
            error = estimated_error(patch)
            surface = patch.surface
            many = resample(surface, tuple(FINER * n for n in surface.shape))
            finer = patch.with_(
                Given(surface=many, flow_settings=replace(patch.flow_settings, rtol=RTOL))
            )
            reference = finer.leak_rate
        except NotConverged as failure:
            print(f"{number}: {failure}")
            continue
        if not reference.converged:
            continue
        area = patch.film_contact.contact_area_fraction
        if leak.state == "sealed":
            sealed[0] += 1
            sealed[1] += error.upper == 1
            sealed[2] += error.upper == 1 and reference.value > 0
            continue
        leaking += 1
        true = logarithm(reference.value, leak.value)
        low = -inf if error.lower is None else log(error.lower)
        high = inf if error.upper is None else log(error.upper)
        held += low <= true <= high
        if area < 0.4:
            closed.append(error.log_error < inf)
        if error.log_error < inf and true:
            ratios.append(error.log_error / abs(true))
        change = change_of(rate_range(on_half(patch)), rate_range(patch))
        print(
            f"{number:5d} {'held' if low <= true <= high else 'MISSED':6} A/A0 {area:.3f}, "
            f"u/g {unresolved(surface) / critical_gap(patch):.3f}, change {change:.3f}, "
            f"claim {low:+.3f} to {high:+.3f}, finer grid {true:+.3f}",
            flush=True,
        )
    print(f"{leaking} leak: {held} held; below A/A0 = 0.4 {sum(closed)} of {len(closed)} closed;")
    print(f"claim over error {median(ratios):.1f}")
    print(f"{sealed[0]} sealed: {sealed[1]} said to stay so, of which {sealed[2]} leak")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--count", type=int, default=100)
    kind = options.add_mutually_exclusive_group()
    kind.add_argument("--lift", action="store_true")
    kind.add_argument("--area", action="store_true")
    kind.add_argument("--sealed", action="store_true")
    options.add_argument("--samples", type=int, nargs="+", default=[4, 6, 8])
    given = options.parse_args()
    if given.sealed:
        sealed_contacts(given.first, given.count, given.samples)
    else:
        main(given.first, given.count, given.lift, given.area, given.samples)
