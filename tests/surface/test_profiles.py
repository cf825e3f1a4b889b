"""Profiles of a known surface give back its spectrum; surfaces are made with a spectrum."""

from itertools import pairwise

import numpy as np
import pytest
from known_answers import of_slope
from project import scene_of_samples, write_toml

from fem_seal import cli
from fem_seal.errors import InvalidInput
from fem_seal.field_file.profiles import read_profiles
from fem_seal.surface import (
    IsotropicSpectrum,
    ProfileSpectrum,
    Spectrum,
    gaussian_surface,
    isotropic_spectrum,
    profile_spectrum,
    radial_spectrum,
    self_affine,
)

N = 512
SIZE = (1e-4, 1e-4)
STEP = SIZE[0] / N
EPSILON = np.finfo(float).eps
# Long cut-off at the 8th, roll-off at the 16th and short cut-off at the 128th wavenumber.
SPECTRUM = of_slope(Spectrum(0.8, SIZE[0] / 8, SIZE[0] / 128, SIZE[0] / 16), 0.1)


def in_bins(edges, density, error=None):
    """Bins of waves at multiples of the lowest wavenumber, with a density C1(q)."""
    unit = 2 * np.pi / SIZE[0]
    bounds = np.rint(edges / unit + 0.5).astype(int)
    waves = tuple(np.arange(a, b) * unit for a, b in pairwise(bounds))
    means = np.array([np.mean([density(q) for q in part]) for part in waves])
    return ProfileSpectrum(edges, waves, means, means if error is None else error)


EDGES = profile_spectrum(np.eye(1, N, N // 2), STEP).edges


def test_constant_rings_exactly():
    """C1 of a disc of radius b is 2 √(b² - q²): of any rings the inverse is exact."""
    values = 1 + np.arange(len(EDGES) - 1) % 3
    steps = np.diff(np.append(values, 0))  # the discs whose sum the rings are

    def transform(q):
        return -2 * np.sum(steps * np.sqrt(np.maximum(EDGES[1:] ** 2 - q**2, 0)))

    found = isotropic_spectrum(in_bins(EDGES, transform))
    # A triangular system of square roots: cancellation loses some digits of double precision.
    assert found.values == pytest.approx(values, rel=1e-9)


def test_scatter_is_that_of_the_errors():
    """Squared deviations over the claimed variance, of profiles far apart of many surfaces.

    The mean of 12 surfaces of 6 bins is 1 ± √(2/72) = 0.17. Neighbours are correlated: 8 groups of
    12 seeds scatter by 0.23, and three times this is allowed. A piece of the surface is detrended
    and windowed.
    """
    ratios = []
    low, _, high = SPECTRUM.wavenumbers
    for seed in range(12):
        surface = self_affine(SPECTRUM, (N, N), SIZE, rms_slope=0.1, scaling="ensemble", seed=seed)
        # One profile a long wavelength: their heights are next to independent.
        rows = surface.values[:, :: N // 8].T
        found = isotropic_spectrum(profile_spectrum(rows[:, : N // 2], STEP))
        # Bins of a few waves are not Gaussian, and the window smears the cut-offs.
        inside = (found.edges[:-1] > 2.5 * low) & (found.edges[1:] < 0.8 * high)
        middle = np.sqrt(found.edges[1:] * found.edges[:-1])[inside]
        deviation = found.values[inside] - SPECTRUM.density(middle)
        ratios.append((deviation / found.error[inside]) ** 2)
    assert abs(np.mean(ratios) - 1) < 3 * 0.23


def test_surface_of_profiles():
    """Ensemble of the spectrum: rms height, and the power in rings, which hold many waves."""
    rings = IsotropicSpectrum(EDGES, SPECTRUM.density(np.sqrt(EDGES[1:] * EDGES[:-1])), EDGES[1:])
    mean, powers = 0.0, 0.0
    for seed in range(8):
        field = gaussian_surface(rings, (256, 256), SIZE, seed=seed)
        mean += np.mean(field.values**2) / 8
        powers = powers + radial_spectrum(field).density / 8
    # 16 to 32 waves, of variance 1 each, carry most of the power: 3 √(2/(8 · 400)).
    assert mean**0.5 == pytest.approx(rings.rms_height, rel=0.08)
    spectrum = radial_spectrum(field)
    inside = (spectrum.wavenumber > 20 * 2 * np.pi / SIZE[0]) & (spectrum.wavenumber < 7e6)
    expected = rings.density(spectrum.wavenumber)[inside]
    # Of 92 normal numbers the median size is 0.67 ± 0.08. Rings straddle the steps of the spectrum.
    scatter = (2 / (8 * spectrum.modes[inside])) ** 0.5
    assert np.median(abs(powers[inside] / expected - 1) / scatter) < 0.67 + 4 * 0.08
    finer = gaussian_surface(rings, (512, 512), SIZE, seed=7)
    # Its waves beyond the 128th, which the coarser grid leaves out, are without power here.
    assert finer.values[::2, ::2] == pytest.approx(field.values, abs=1e-9 * rings.rms_height)


def test_a_trend_does_not_count():
    """Tilt and height of the instrument leave the spectrum as it is, to rounding.

    Heights are rounded to ε of the tilted ones. Roots of powers differ by no more than that of the
    difference, here that of noise with an rms height of ε max|h|: a rounding has 0.3 of it.
    """
    rough = self_affine(SPECTRUM, (N, N), SIZE, rms_slope=0.1, seed=1).values[:4]
    tilted = rough + 1e-6 + 1e-7 * np.arange(N)
    noise = np.random.default_rng(0).normal(size=rough.shape) * np.abs(tilted).max() * EPSILON
    plain, other, rounding = (
        profile_spectrum(rows, STEP).density ** 0.5 for rows in (rough, tilted, noise)
    )
    assert (np.abs(other - plain) < rounding).all()


def write(path, rows, head="x [mm];z [µm]\n", step=1e-3):
    lines = [";".join([f"{k * step:.6f}", *map(repr, row)]) for k, row in enumerate(rows)]
    path.write_text(head + "\n".join(lines).replace(".", ","))


def test_files_of_profiles(tmp_path):
    """x and heights, heights and x; two files of different lengths, a sample missing at an end.

    Other titles: field_file/test_text.py.
    """
    heights = np.round(np.random.default_rng(0).normal(size=(40, 3)), 4)
    write(tmp_path / "a.txt", heights[:, :2].tolist())
    rows = [f"{z!r};{k * 0.001:.3f}" for k, z in enumerate(heights[:30, 2].tolist())]
    text = "\n".join(["Höhe (µm);x (mm)", "***;0.000", *rows[1:]])
    (tmp_path / "b.txt").write_text(text.replace(".", ","), encoding="utf-8")
    profiles = read_profiles([tmp_path / "a.txt", tmp_path / "b.txt"])
    assert profiles.step == pytest.approx(1e-6, rel=1e-12)
    np.testing.assert_allclose(profiles.heights, heights[1:30].T * 1e-6, rtol=1e-15)


def test_sdf_of_one_profile(tmp_path):
    """Yscale is 0, as one profile has no distance across."""
    head = "aBC-1.0\nNumPoints = 6\nNumProfiles = 1\nXscale = 0.5e-6\nYscale = 0\nZscale = 1e-10"
    (tmp_path / "a.sdf").write_text(f"{head}\n*\n0\n79\n157\nBAD\n314\n393\n*\n")
    profiles = read_profiles([tmp_path / "a.sdf"])
    assert profiles.step == 5e-7
    expected = 1e-10 * np.array([[0, 79, 157, np.nan, 314, 393]])
    np.testing.assert_allclose(profiles.heights, expected, rtol=1e-15)
    with pytest.raises(InvalidInput, match=r"has a step of 5e-07 m, but surface.step = 1e-06 m"):
        read_profiles([tmp_path / "a.sdf"], step=1e-6)
    (tmp_path / "b.sdf").write_text((tmp_path / "a.sdf").read_text().replace("0.5e-6", "0"))
    with pytest.raises(InvalidInput, match="has a step of 0 m, which must be above 0"):
        read_profiles([tmp_path / "b.sdf"])


def test_files_without_x(tmp_path):
    heights = np.random.default_rng(0).normal(size=(40, 2))
    np.savetxt(tmp_path / "a.txt", heights)
    profiles = read_profiles([tmp_path / "a.txt"], unit="um", step=5e-7)
    assert profiles.heights.shape == (2, 40)
    assert profiles.step == 5e-7
    with pytest.raises(InvalidInput, match="does not say the step of its samples"):
        read_profiles([tmp_path / "a.txt"], unit="um")
    with pytest.raises(InvalidInput, match=r"the heights of .* have no unit"):
        read_profiles([tmp_path / "a.txt"], step=1e-6)
    np.savetxt(tmp_path / "b.txt", heights, header="Spacing: 0.5 um\nUnits: um")
    assert read_profiles([tmp_path / "b.txt"]).step == pytest.approx(5e-7, rel=1e-12)
    with pytest.raises(InvalidInput, match=r"has a step of 5e-07 m, but surface.step = 1e-06 m"):
        read_profiles([tmp_path / "b.txt"], step=1e-6)
    np.savetxt(tmp_path / "c.txt", heights, header="Spacing: 0.7 um\nUnits: um")
    with pytest.raises(InvalidInput, match="resample them to the same"):
        read_profiles([tmp_path / "b.txt", tmp_path / "c.txt"])
    # x, or the scene, makes a step in the header needless.
    unclear = "Spacing: 0.5 um (nominal)\nUnits: um"
    np.savetxt(tmp_path / "e.txt", heights, header=unclear)
    with pytest.raises(InvalidInput, match=r"surface.step = .* says 'Spacing: 0.5 um \(nominal\)'"):
        read_profiles([tmp_path / "e.txt"])
    assert read_profiles([tmp_path / "e.txt"], step=7e-7).step == 7e-7
    np.savetxt(tmp_path / "e.txt", np.column_stack([np.arange(40), heights]), header=unclear)
    assert read_profiles([tmp_path / "e.txt"]).step == pytest.approx(1e-6, rel=1e-12)
    np.savetxt(tmp_path / "d.txt", np.column_stack([0.0005 * np.arange(40), heights]))
    with pytest.raises(InvalidInput, match=r"x in .* has no unit, and in 'um', .* rms slope"):
        read_profiles([tmp_path / "d.txt"], unit="um")


def test_coordinates_are_no_profile(tmp_path):
    """x that falls is x; a count beside it, or x behind the heights, would be a flat profile."""
    heights, x = np.random.default_rng(0).normal(size=40), 0.5 * np.arange(40)
    np.savetxt(tmp_path / "down.txt", np.column_stack([x[::-1], heights]))
    profiles = read_profiles([tmp_path / "down.txt"], unit="um")
    assert profiles.step == pytest.approx(5e-7, rel=1e-12)
    np.testing.assert_allclose(profiles.heights, [1e-6 * heights[::-1]], rtol=1e-12)
    counted = np.column_stack([np.arange(1, 41), x, heights])
    for name, table, head, wrong in (
        ("counted", counted, "", 2),
        ("titled", counted, "No\tx [um]\tz [um]", 1),
        ("behind", counted[:, [2, 1]], "", 2),
    ):
        np.savetxt(tmp_path / f"{name}.txt", table, delimiter="\t", header=head, comments="")
        with pytest.raises(InvalidInput, match=rf"column {wrong} of .* rises or falls evenly"):
            read_profiles([tmp_path / f"{name}.txt"], unit="um", step=5e-7)


def test_scene_of_profiles(tmp_path, capsys, here):
    """From a stylus's file to a contact: the spectrum as a table, and the assumption in words."""
    rough = self_affine(SPECTRUM, (N, N), SIZE, rms_slope=0.1, seed=1).values[:, ::64]
    write(tmp_path / "a.txt", (rough * 1e6).tolist(), step=STEP * 1e3)
    profiles = {"kind": "profiles", "path": "a.txt", "shape": [64, 64], "size": [5e-5, 5e-5]}
    path = write_toml(tmp_path / "scene.toml", scene_of_samples(64) | {"surface": profiles})
    assert cli.main(["surface", str(path), "--csv", "a.csv"]) == 0
    assert "the surface is isotropic and Gaussian" in capsys.readouterr().out
    head = (tmp_path / "a.csv").read_text().splitlines()[:3]
    slope = float(head[1].removeprefix("# Sdq = "))
    # Eight profiles of about a hundred waves that carry the slope: 1/√800 of its square, 4 σ.
    assert slope == pytest.approx(0.1, rel=0.07)
    products = "output.products=['leak_rate']"
    assert cli.main(["run", str(path), "--set", products, "--out", "out"]) == 0
    assert "isotropic surface" in " ".join(capsys.readouterr().out.split())
