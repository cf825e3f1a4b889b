"""The entry "contact grid": what a finer grid changes, estimated from half of the samples."""

from dataclasses import replace
from math import exp, inf, log

import numpy as np
import pytest
from project import scene_of_samples

from fem_seal.errors import NotConverged
from fem_seal.grid_series import (
    MOST,
    error_from_half,
    error_of_map,
    grid_error,
    half_solver,
    on_half,
)
from fem_seal.patch import Given, Patch
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.scene import Scene
from fem_seal.surface.resampling import resample


def scene(pressure="0.1 MPa", samples=32, rtol=0.05, **sections):
    """A dry rubber with four samples in the shortest wave."""
    waves = {"shape": [samples, samples], "long_wavelength": "8 um", "seed": 3}
    rubber = scene_of_samples(32, **waves) | {"contact": {"pressure": pressure}}
    rubber["flow"] = {"pressure_drop": 1e5, "sides": "periodic", "rtol": rtol, "lift": "none"}
    rubber["output"] = {"products": ["leak_rate"]}
    return Scene.from_mapping(rubber | sections)


def entry(patch):
    (found,) = (entry for entry in error_budget(patch) if entry.key == "contact_grid")
    return found


def test_four_times_the_samples_lie_within_the_factors():
    """The rule was calibrated on other contacts (tests/benchmarks/contact_grid.py)."""
    patch = Patch(scene("0.15 MPa"))
    grid = entry(patch)
    finer = patch.with_(
        Given(
            surface=resample(patch.surface, (128, 128)),
            flow_settings=replace(patch.flow_settings, rtol=0.02),
        )
    )
    assert grid.kind == "estimated"
    assert grid.lower < finer.leak_rate.value / patch.leak_rate.value < grid.upper


@pytest.mark.parametrize("seed", [100, 138])
def test_ways_through_the_corners_of_pixels(seed, monkeypatch):
    """Half of the samples and the heights between them say too little; the linear gap enough."""
    waves = {"size": [1e-4, 1e-4], "long_wavelength": 5e-5, "short_wavelength": 1.25e-5}
    surface = scene().to_mapping()["surface"] | waves | {"seed": seed}
    pixels = scene().to_mapping()["flow"] | {"representation": "constant", "rtol": 0.1}
    patch = Patch(scene("0.1 MPa", surface=surface, flow=pixels))
    grid, finer = entry(patch), patch.with_(Given(surface=resample(patch.surface, (128, 128))))
    monkeypatch.setattr("fem_seal.grid_series.between_pixels", lambda *_: 0.0)
    without = error_from_half(patch, half_solver(patch)())
    assert grid.lower < finer.leak_rate.value / patch.leak_rate.value < without.lower


@pytest.mark.parametrize(
    ("n", "samples", "hurst", "waves", "seed", "pressure"),
    [
        (32, 2.01, 0.13, 1, 303053, "0.26 MPa"),
        (24, 1.01, 0.78, 1, 428322, "0.19 MPa"),
    ],
)
def test_a_sealed_grid_that_lacks_short_waves_says_that_finer_ones_may_leak(
    n, samples, hurst, waves, seed, pressure
):
    """Two of the random contacts of `contact_grid.py sealed` (tests/benchmarks).

    At up to 1.3 of the load that seals them they are sealed on half of the samples too; 2n and 4n
    leak, or nothing is shown.
    """
    surface = {"shape": [n, n], "hurst": hurst, "seed": seed, "long_wavelength": 1e-4 / waves}
    surface |= {"short_wavelength": 1e-4 * samples / n, "size": [1e-4, 1e-4]}
    patch = Patch(scene(pressure, surface=scene().to_mapping()["surface"] | surface))
    finer = [patch.with_(Given(surface=resample(patch.surface, (k * n, k * n)))) for k in (2, 4)]
    assert patch.sealed
    assert not any(one.sealed for one in finer)
    assert entry(patch).upper is None


def test_a_sealed_patch_that_is_not_solved_under_less_load_may_leak(monkeypatch):
    def fails(patch, part):
        raise NotConverged("the certificate is 1e-3")

    monkeypatch.setattr("fem_seal.grid_series.sealed_under", fails)
    grid = entry(Patch(scene("0.5 MPa")))
    assert (grid.lower, grid.upper) == (1.0, None)
    assert "the certificate is 1e-3" in grid.sentence


def test_a_map_that_is_sealed_on_half_of_its_samples_may_leak_much_more_or_less():
    """As a rough surface whose constriction may close; else a verdict would count nothing."""
    of_map, rough = error_of_map(inf, 0.0), grid_error(inf, 0.0)
    assert (of_map.lower, of_map.upper) == (rough.lower, rough.upper) == (None, exp(MOST))


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_a_measured_map_says_what_half_of_its_samples_change(tmp_path, representation):
    """Constant pixels also count the gap that is linear between the samples."""
    patch = Patch(scene())
    spacing = patch.surface.spacing
    np.savez(tmp_path / "map.npz", heights=patch.surface.values, spacing=spacing, periodic=True)
    surface = {"kind": "file", "path": str(tmp_path / "map.npz")}
    flow = scene().to_mapping()["flow"]
    measured, linear = (
        Patch(scene(surface=surface, flow=flow | {"representation": one}))
        for one in (representation, "linear")
    )
    half, value = on_half(measured).leak_rate.value, measured.leak_rate.value
    change = abs(log(value / half)) + abs(log(value / linear.leak_rate.value))
    grid = entry(measured)
    assert (grid.lower, grid.upper) == pytest.approx((exp(-change), exp(change)), rel=1e-9)
    (instrument,) = (e for e in error_budget(measured) if e.key == "instrument")
    assert instrument.kind == "not covered"


@pytest.mark.parametrize(
    "sections",
    [
        {"accuracy": {"contact_grid": False}},
        {"contact": {"model": "bearing", "area_fraction": 0.2}},
    ],
)
def test_no_other_grid_is_solved_where_none_is_wanted(sections, monkeypatch):
    monkeypatch.setattr(Patch, "with_", lambda self, **other: pytest.fail("another grid"))
    assert entry(Patch(scene(**sections))).kind == "not covered"
