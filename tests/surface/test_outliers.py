"""Spikes of an instrument: found, said, and taken away; none are found where there are none."""

import numpy as np
import pytest

from fem_seal import cli
from fem_seal.field_file import FieldMap
from fem_seal.surface import Preparation, Spectrum, outliers, prepare, self_affine

STEP = 1e-6
RNG = np.random.default_rng(4)


def rough(hurst, shortest, shape):
    size = tuple(n * STEP for n in shape)
    spectrum = Spectrum(hurst, min(shape) / 2 * STEP, shortest * STEP)
    return self_affine(spectrum, shape, size, rms_height=1.0, seed=3).values.copy()


def found(values):
    return outliers(FieldMap(values, (STEP, STEP), None))


def test_no_point_of_a_gaussian_surface_is_an_outlier():
    """1e-9 are expected (spikes.py); white noise has the least correlation of neighbours."""
    for values in (RNG.normal(size=(1000, 1000)), rough(0.8, 4, (300, 300))):
        assert not found(values).any()


def shapes():
    """Faces with edges, corners and lines, which are no spikes, exact and with noise."""
    pocket = np.zeros((90, 80))
    pocket[20:50, 10:40] = -1
    scratch = np.zeros((90, 80))
    scratch[30] = scratch[:, 7] = -1
    x, y = np.indices(pocket.shape)
    spheres = np.maximum(0, 1 - ((x % 15 - 7) ** 2 + (y % 15 - 7) ** 2) / 9)
    honed = np.minimum(rough(0.8, 4, (90, 80)), 0)
    steps = 1e-7 * np.round(RNG.normal(scale=0.2, size=pocket.shape))  # a hundredth is one step off
    exact = [pocket, scratch, spheres, honed, (x + y) % 2.0, steps, np.zeros((9, 9)), 1e-7 * x]
    return [*exact, *(face + RNG.normal(scale=0.01, size=face.shape) for face in exact[:5])]


@pytest.mark.parametrize("face", shapes())
def test_edges_corners_and_scratches_are_none(face):
    assert not found(face).any()


@pytest.mark.parametrize("tilt", [0, 1])
def test_spikes_are_found_beside_holes_and_at_the_border_and_no_others(tilt):
    values = rough(0.8, 4, (240, 320))
    spikes = np.zeros(values.shape, dtype=bool)
    spikes[RNG.integers(240, size=18), RNG.integers(320, size=18)] = True
    spikes[0, 0] = spikes[-1, 100] = spikes[100:103, 200:203] = True
    values[spikes] += RNG.choice([-1, 1], size=spikes.sum()) * RNG.uniform(5, 12, spikes.sum())
    values[100:103, 200:203] = 9  # a group of nine
    values[40:60, 50:80] = np.nan
    spikes[40:60, 50:80] = False
    values += tilt * np.arange(240)[:, None]
    np.testing.assert_array_equal(found(values), spikes)
    # Neither scale nor offset of the heights matters.
    np.testing.assert_array_equal(found(1e-9 * values - 1e-3), spikes)


def test_spikes_become_missing_before_the_trend_is_fitted():
    plane = FieldMap(np.add.outer(np.arange(40.0), 2 * np.arange(30.0)), (STEP, STEP), None)
    plane.values[:] += RNG.normal(scale=1e-3, size=plane.values.shape)
    plane.values[5, 7] += 1e3
    prepared = prepare(plane, Preparation(outliers="missing", detrend="plane", fill="harmonic"))
    assert [step.name for step in prepared.steps[1:3]] == ["outliers missing", "detrend plane"]
    assert prepared.steps[1].missing == 1
    assert np.abs(prepared.field.values).max() < 6e-3  # six standard deviations of the noise


def test_spikes_are_said_unless_they_are_taken_away(here, capsys):
    heights = 1e-7 * rough(0.8, 8, (48, 40))
    heights[[5, 20, 30], [7, 9, 30]] = 5e-6
    np.savez("map.npz", heights=heights, spacing=(STEP, STEP), periodic=True)
    said = "3 points stand out far from the neighbours"
    assert cli.main(["surface", "map.npz"]) == 0
    assert said in capsys.readouterr().out
    assert cli.main(["new", "map.npz"]) == 0
    assert "3 of them spikes" in capsys.readouterr().out
    run = ["run", "map.toml", "--overwrite", "--set", "output.leak_rate_unit="]
    run += ["--set", 'output.products=["contact"]']
    assert cli.main(run) == 0
    assert said not in capsys.readouterr().out
    assert cli.main([*run, "--set", "surface.outliers="]) == 0
    assert said in " ".join(capsys.readouterr().out.split())
