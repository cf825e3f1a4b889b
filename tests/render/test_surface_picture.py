"""fem-seal surface: table and picture, also of surfaces without a power law."""

import numpy as np
import pytest
from drawn_fields import drawn_pixels
from matplotlib.figure import Figure
from project import ROOT, write_toml

from fem_seal import cli
from fem_seal.digits import with_error
from fem_seal.render.surface import draw_heights, draw_spectrum
from fem_seal.surface import Spectrum, fit_spectrum, self_affine

BLASTED = ROOT / "demos" / "scenes" / "blasted.toml"
ROUGH = self_affine(Spectrum(0.8, 64e-6, 4e-6), (128, 96), (128e-6, 96e-6), rms_slope=0.1, seed=1)


def scene_of(folder, surface):
    """File of a scene that cuts a surface by a plane."""
    contact = {"model": "bearing", "mean_gap": 1.0}
    scene = {"surface": surface, "contact": contact, "output": {"products": ["contact"]}}
    return write_toml(folder / "scene.toml", scene)


def test_heights_are_drawn_at_their_position():
    """First axis to the right, about the mean, in readable units."""
    figure = Figure()
    axes = figure.subplots()
    draw_heights(figure, axes, ROUGH)
    (image,) = axes.images
    shown = np.asarray(image.get_array())
    heights = ROUGH.values - ROUGH.values.mean()
    np.testing.assert_allclose(shown, heights.T * 1e6, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(image.get_extent(), [0, 128e-6, 0, 96e-6], rtol=1e-14)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [µm], flow →", "y [µm]")


def test_spectrum_shows_rings_fit_and_cut_offs():
    fit = fit_spectrum(ROUGH)
    axes = Figure().subplots()
    draw_spectrum(axes, fit)
    rings, line, long, short = axes.lines
    q, density = rings.get_data()
    assert set(q) <= set(fit.spectrum.wavenumber)
    assert density.min() > 1e-4 * fit.density.min()
    assert np.array_equal(line.get_data(), [fit.wavenumber, fit.density])
    assert long.get_xdata()[0] == pytest.approx(2 * np.pi / fit.long_wavelength)
    assert short.get_xdata()[0] == pytest.approx(2 * np.pi / fit.short_wavelength)
    assert line.get_label() == f"H = {with_error(fit.hurst, fit.hurst_error)}"


@pytest.mark.render
def test_command_prints_and_draws(tmp_path, capsys):
    assert cli.main(["surface", str(BLASTED), "--out", str(tmp_path / "a.png")]) == 0
    lines = capsys.readouterr().out.splitlines()
    steps = [line.split("  ")[0] for line in lines[1:5]]
    assert steps == ["read", "detrend quadratic", "fill harmonic", "mirror"]
    assert [line.split()[0] for line in lines[6:]] == [
        "sides", "slopes", "lay", "longest", "hurst", "long", "roll-off", "short", "result"
    ]  # fmt: skip
    pixels = drawn_pixels(tmp_path / "a.png")
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_command_says_that_a_map_cannot_be_pressed(capsys):
    """It may be looked at all the same, and the ways out are named."""
    assert cli.main(["surface", str(BLASTED), "--set", "surface.make_periodic="]) == 0
    assert "make_periodic = 'mirror'" in capsys.readouterr().out
    assert cli.main(["surface", str(BLASTED)]) == 0
    assert "make_periodic" not in capsys.readouterr().out


def test_spectrum_as_csv(tmp_path, capsys):
    """∫ C d²q over the rings is Sq² of a periodic surface without power beyond them (Parseval)."""
    np.savez(tmp_path / "a.npz", heights=ROUGH.values, spacing=ROUGH.spacing, periodic=True)
    path = scene_of(tmp_path, {"kind": "file", "path": "a.npz"})
    assert cli.main(["surface", str(path), "--csv", str(tmp_path / "a.txt")]) == 2
    assert "must end in .csv" in capsys.readouterr().err
    assert cli.main(["surface", str(path), "--csv", str(tmp_path / "a.csv")]) == 0
    assert f"result              {tmp_path / 'a.csv'}\n" in capsys.readouterr().out
    lines = (tmp_path / "a.csv").read_text().splitlines()
    named = dict(line[2:].split(" = ") for line in lines[:3])
    heights = ROUGH.values
    assert float(named["Sq"].removesuffix(" m")) == pytest.approx(heights.std(), rel=1e-12)
    skewness = np.mean((heights - heights.mean()) ** 3) / heights.std() ** 3
    assert float(named["Ssk"]) == pytest.approx(skewness, rel=1e-9, abs=1e-12)
    # rms_slope = 0.1 is that of the waves; differences of samples smooth those of four samples.
    assert 0.08 < float(named["Sdq"]) < 0.1
    assert lines[3] == "q [1/m],C [m^4],modes"
    q, C, modes = np.array([line.split(",") for line in lines[4:]], dtype=float).T
    assert (np.diff(q) > 0).all()
    cell = (2 * np.pi) ** 2 / np.prod(ROUGH.size)  # of each wave in the plane of q
    assert np.sum(C * modes) * cell == pytest.approx(heights.var(), rel=1e-9)


def test_no_exponent_is_printed_for_a_poor_fit(tmp_path, capsys):
    """A power law does not fit the spectrum of two waves."""
    x, y = np.arange(64)[:, None] / 64, np.arange(48) / 48
    waves = np.cos(6 * np.pi * x) * np.cos(8 * np.pi * y) + np.sin(2 * np.pi * (5 * x + 2 * y))
    np.savez(tmp_path / "a.npz", heights=waves, spacing=[1, 1])
    scene = scene_of(tmp_path, {"kind": "file", "path": "a.npz"})
    assert cli.main(["surface", str(scene)]) == 0
    said = capsys.readouterr().out
    assert "no power law: the best one has a misfit of" in said
    assert "hurst" not in said


@pytest.mark.parametrize(("samples", "few"), [(48, True), (192, False)])
def test_an_exponent_beyond_those_of_self_affine_surfaces_is_marked(samples, few, tmp_path, capsys):
    """H = 0.8 is fitted well on 24 rings of waves between the cut-offs, and as 2.8 on eight."""
    surface = {
        **{"kind": "self-affine", "shape": [samples, samples], "size": [40e-6, 60e-6]},
        **{"hurst": 0.8, "long_wavelength": 20e-6, "short_wavelength": 5e-6 * 48 / samples},
        **{"rms_slope": 0.1, "seed": 3},
    }
    assert cli.main(["surface", str(scene_of(tmp_path, surface))]) == 0
    said = capsys.readouterr().out
    assert ("beyond 0 to 1" in said) == few
