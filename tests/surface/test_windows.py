"""Windows of a map: what they keep of its roughness, and when `fem-seal new` writes them."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.special import spherical_jn

from fem_seal import cli
from fem_seal.digits import with_prefix
from fem_seal.error_budget import may_open
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.quantities.patch_size import scale_entries
from fem_seal.scene import Scene
from fem_seal.surface import Spectrum, kept_roughness, longest_wavelength, self_affine
from fem_seal.surface.windows import MOST_LOST, WAVES

SIDE, STEP = 300, 1e-6  # samples along a side of the map, and their distance [m]


def kept_share(q, side):
    """Part of the mean square of a wave, of any phase, that is left after levelling by a plane.

    Mean and tilts of a square window are orthogonal; their parts are j0(a)² j0(b)², 3 j1(a)² j0(b)²
    and 3 j0(a)² j1(b)², with the spherical Bessel functions and a, b = q_x W/2, q_y W/2.
    """
    j0, j1 = (spherical_jn(order, np.abs(q) * side / 2) ** 2 for order in (0, 1))
    return 1 - j0[0] * j0[1] - 3 * j1[0] * j0[1] - 3 * j0[0] * j1[1]


@pytest.mark.parametrize("waves", [0.5, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("direction", [0.0, 0.7])
def test_kept_roughness_of_a_wave(waves, direction):
    window, number = 40, 10
    q = 2 * np.pi * waves / window * np.array([np.cos(direction), np.sin(direction)])
    x = np.arange(window * number)
    phase = np.add.outer(q[0] * x, q[1] * x)
    # A sine and a cosine have each phase equally often, so that only their sum is compared.
    squares = np.zeros(2)
    for wave in (np.sin(phase), np.cos(phase)):
        field = GridField(wave, (STEP, STEP), False)
        squares += kept_roughness(field, (window * STEP, window * STEP), "plane") ** 2, 1.0
    # Sums over samples differ from integrals by (q d)²/12 < 4 % of the lost part. The levelled map,
    # at least five waves wide, has lost 0.2 % itself.
    lost, expected = 1 - squares[0] / squares[1], 1 - kept_share(q, window)
    assert lost == pytest.approx(expected, rel=0.08, abs=2e-3)


def test_limit_of_the_loss():
    """A window as wide as `new` wants loses far less than the run warns of, one wave wide more."""
    directions = np.linspace(0, 2 * np.pi, 720, endpoint=False)

    def lost(waves):
        q = 2 * np.pi * waves * np.array([np.cos(directions), np.sin(directions)])
        return 1 - np.sqrt(kept_share(q, 1.0).mean())

    assert lost(WAVES) < MOST_LOST / 10
    assert lost(2.0) < MOST_LOST / 2
    assert lost(1.0) > 4 * MOST_LOST


def write_map(folder, rolloff):
    """A piece of a larger random surface, as an instrument would see it."""
    spectrum = Spectrum(0.8, 512.0, 4.0, rolloff)
    heights = self_affine(spectrum, (512, 512), (512.0, 512.0), rms_height=0.2e-6, seed=1).values
    tilt = 2e-8 * np.arange(SIDE)[:, None]
    np.savez(folder / "map.npz", heights=heights[:SIDE, :SIDE] + tilt, spacing=[STEP, STEP])


def uncommented(text):
    """The scene that `fem-seal new` writes, with its [seal]."""
    head, seal = text.split("# [seal]")
    seal = "\n".join(line.removeprefix("# ") for line in seal.splitlines())
    data = tomllib.loads(f"{head}[seal]{seal}")
    data["output"]["products"] = ["seal"]
    del data["flow"]["rtol"]
    return data


@pytest.mark.parametrize("rolloff", [8.0, 32.0, None])
def test_windows_only_where_they_keep_the_roughness(rolloff, tmp_path, here, capsys):
    """One longest wavelength: printed, in the new scene, and in both entries of the budget.

    Waves longer than λ_r √(0.1 (1 + 1/H))⁻¹ = 2.1 λ_r hold a tenth of the mean square of a spectrum
    with a plateau: 17 or 67 µm, of which a third of the map, 100 µm, is 5.9 or 1.5.
    """
    write_map(tmp_path, rolloff)
    assert cli.main(["new", "map.npz"]) == 0
    text = Path("map.toml").read_text(encoding="utf-8")
    data = uncommented(text)
    assert ("window" in data["seal"]) == (rolloff == 8.0)
    assert ("## no window: " in text) == (rolloff != 8.0)
    data["seal"]["window"] = ["100 um", "100 um"]
    apart, size = scale_entries(Patch(Scene.from_mapping(data)), 1e-3)
    assert size.caution == (rolloff != 8.0)
    assert ("biases the leak rate" in size.sentence) == (rolloff is None)
    # A bias of unknown size: no verdict may rely on the upper end.
    assert may_open(size) == (rolloff is None)
    capsys.readouterr()
    assert cli.main(["surface", "map.npz"]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("longest")]
    printed = line.removeprefix("longest wavelength").strip()
    if rolloff is None:
        assert printed == "longer than the map"
        assert "longer than the map" in apart.sentence
        assert "longer than the map" in size.sentence
        return
    # The lowest rings hold few waves: over 30 seeds it is 1.10 ± 0.06 and 0.95 ± 0.13 times this.
    assert float(printed.split()[0]) == pytest.approx(2.1 * rolloff, rel=0.05 + 3 * 0.13)
    assert f"the longest wavelength, {printed}, is" in apart.sentence
    assert f"of the longest wavelengths wide, {printed} each" in size.sentence
    del data["seal"]["window"]
    whole, map_size = scale_entries(Patch(Scene.from_mapping(data)), 1e-3)
    assert whole == apart
    assert f"patches made of the map, {with_prefix(SIDE * STEP, 'm')} by" in map_size.sentence


def test_longest_wavelength_of_a_wave():
    """Of one wave its wavelength; a tenth of the mean square in a longer one does not count yet."""
    x = np.arange(64) * 1e-6
    wave, longer = (np.cos(2 * np.pi * x / length) for length in (8e-6, 32e-6))
    for share, expected in ((0.0, 8e-6), (0.25, 8e-6), (0.4, 32e-6)):
        heights = 1e-7 * np.tile(wave + share * longer, (64, 1))
        found = longest_wavelength(GridField(heights, (1e-6, 1e-6), True))
        # A ring of the spectrum holds waves of 28 to 42 µm.
        assert found == pytest.approx(expected, rel=0.1)
