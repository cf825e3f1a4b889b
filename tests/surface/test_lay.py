"""The lay of a surface: exact waves, stretched and turned surfaces, and what is no lay."""

from functools import cache
from math import exp

import numpy as np
import pytest

from fem_seal import cli
from fem_seal.grid import GridField
from fem_seal.surface import Lay, Spectrum, self_affine

STEP = 1e-6


@cache
def rough(seed=1, stretch=1, angle=0.0):
    """Gaussian surface, stretched along an axis at an angle [degrees] from x, of 240² points."""
    rng, n = np.random.default_rng(seed), 240
    x, y = np.indices((n, n)) / n
    along = x * np.cos(np.radians(angle)) + y * np.sin(np.radians(angle))
    across = y * np.cos(np.radians(angle)) - x * np.sin(np.radians(angle))
    q = 2 * np.pi * rng.uniform(3, 12, 300) * np.exp(2j * np.pi * rng.random(300))
    waves = (
        np.cos(along * a.real / stretch + across * a.imag + phase)
        for a, phase in zip(q, 2 * np.pi * rng.random(300), strict=True)
    )
    return GridField(1e-7 * sum(waves), (STEP, STEP), False)


@pytest.mark.parametrize(("m", "n"), [(1, 0), (0, 2), (3, 4), (-2, 3)])
def test_wave(m, n):
    """A wave has no slope along its crests; ∇h of bilinear cells is that of the wave to (q d)²."""
    x, y = np.indices((128, 128)) * 2 * np.pi / 128
    lay = Lay.of(GridField(np.cos(m * x + n * y), (STEP, STEP), True))
    assert lay.ratio > 1e3
    crests = np.degrees(np.arctan2(m, -n)) % 180
    assert abs((lay.angle - crests + 90) % 180 - 90) < np.degrees((max(abs(m), abs(n)) / 20) ** 2)
    # <cos'²> = q²/2, and sin²(q d/2) in place of (q d/2)²
    slopes = np.sqrt(2) * np.abs(np.sin(np.pi * np.array([m, n]) / 128)) / STEP
    np.testing.assert_allclose(lay.slopes, slopes, rtol=2 / 128, atol=1e-12)


@pytest.mark.parametrize("angle", [0, 30, 90, 150])
def test_stretched_surface(angle):
    """Stretching by s divides the slopes along it by s.

    The ratio scatters by 11 %, the angle by 1.7 degrees: 5 % and 0.7 from 300 waves, as
    √(<q⁴>/(600 <q²>²)), the rest since few wavelengths are on the map. Three times both is allowed.
    """
    lay = Lay.of(rough(stretch=4, angle=angle))
    assert lay.ratio == pytest.approx(4, rel=3 * 0.11)
    assert abs((lay.angle - angle + 90) % 180 - 90) < 3 * 1.7
    # A tilt is no lay, and turning the map turns it.
    field = rough(stretch=4, angle=angle)
    tilted = field.values + 1e-7 * np.arange(240)
    other = Lay.of(GridField(tilted, field.spacing, False))
    assert (other.ratio, other.angle) == pytest.approx((lay.ratio, lay.angle), rel=1e-6)
    turned = Lay.of(GridField(np.rot90(field.values), field.spacing, False))
    assert turned.ratio == pytest.approx(lay.ratio, rel=1e-9)
    assert (turned.angle - lay.angle) % 180 == pytest.approx(90, abs=1e-6)


def test_isotropic_surfaces_have_none():
    """Whatever the pixels: long ones must not look like a lay.

    A finite map has a ratio by chance. Over 40 seeds its logarithm has an rms of 0.018 for the
    rough surface, 0.032 for every third column of it and 0.012 for the noise. Three times the
    largest is allowed.
    """
    values = self_affine(
        Spectrum(0.8, 64 * STEP, 2 * STEP), (256, 256), (256 * STEP,) * 2, rms_slope=0.1, seed=1
    ).values
    noise = np.random.default_rng(0).normal(size=(200, 100))
    for heights, dy in ((values, 1), (values[:, ::3], 3), (noise, 1), (noise, 4), (noise * 0, 1)):
        assert Lay.of(GridField(heights, (STEP, dy * STEP), False)).ratio < exp(3 * 0.032), (
            heights.shape
        )


def test_slopes_of_oblong_pixels_name_their_lengths(here, capsys):
    """Neighbours along x are ten times as far apart: the slopes of noise along y are ten times as
    large, while over equal lengths they are as large as those along x, to the chance of 40 seeds:
    an rms of 0.0036, of which three times is allowed."""
    noise = 1e-9 * np.random.default_rng(0).normal(size=(200, 1000))
    np.savez("map.npz", heights=noise, spacing=(10 * STEP, STEP), periodic=False)
    assert cli.main(["surface", "map.npz"]) == 0
    rows = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines() if line)
    assert " along x over 10 um, " in rows["slopes"]
    assert rows["slopes"].endswith(" along y over 1 um")
    _, lay = rows["lay"].split(": slopes over 10 um across it are ")
    assert float(lay.split()[0]) < exp(3 * 0.0036)


def test_two_columns_have_no_longer_differences(here, capsys):
    """Neighbours along x are ten times as far apart as the two columns: the lay is that of these,
    and no longer difference is named."""
    noise = 1e-9 * np.random.default_rng(0).normal(size=(200, 2))
    np.savez("map.npz", heights=noise, spacing=(10 * STEP, STEP), periodic=False)
    assert cli.main(["surface", "map.npz"]) == 0
    assert " over 10 um" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("angle", "settings", "words"),
    [
        (0, [], "along x, runs along it, and with surface.turn = 90 across"),
        (90, [], "along x, runs across it, and with surface.turn = 90 along"),
        (90, ["surface.turn=90"], "along x, runs along it, and with surface.turn = 180 across"),
        (40, [], "degrees to it, and with surface.turn = 90 at "),
        (40, ["surface.make_periodic=mirror"], "mirroring bends such a lay into chevrons"),
        (0, ["surface.make_periodic=mirror"], "along it, and with surface.turn = 90 across\n"),
    ],
)
def test_which_way_the_flow_runs(angle, settings, words, here, capsys):
    field = rough(stretch=4, angle=angle)
    heights = field.values.copy()
    heights[60:180:20, 50::60] += 1e-5  # spikes, whose slopes have no direction
    np.savez("map.npz", heights=heights, spacing=field.spacing, periodic=False)
    sets = [part for setting in settings for part in ("--set", setting)]
    assert cli.main(["surface", "map.npz", *sets]) == 0
    said = capsys.readouterr().out
    assert words in said
    assert "slopes              " in said
