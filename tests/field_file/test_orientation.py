"""Maps that are turned and transposed: where their slopes point, and which way they leak."""

import json

import numpy as np
import pytest

from fem_seal import cli
from fem_seal.field_file import FieldMap, Stated
from fem_seal.gap_file import load_gap
from fem_seal.surface import measured_surface

# A plane of slopes (2, 3) on an oblong grid; the origin is of no matter to slopes.
X, Y = np.meshgrid(0.5 * np.arange(4), 0.25 * np.arange(6), indexing="ij")
PLANE = FieldMap(2 * X + 3 * Y, (0.5, 0.25), None)


def slopes(field):
    return tuple(np.diff(field.values, axis=k).mean() / field.spacing[k] for k in (0, 1))


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
@pytest.mark.parametrize("transpose", [False, True])
def test_slopes_turn_with_the_map(turn, transpose):
    """The gradient of a turned map is the turned gradient; all numbers here are dyadic."""
    angle = np.radians(turn)
    rotation = np.rint([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    gradient = np.array([3, 2] if transpose else [2, 3])
    turned = PLANE.oriented(turn, transpose)
    assert slopes(turned) == tuple(rotation @ gradient)


def test_statements_are_about_the_file_and_crop_about_the_turned_map(tmp_path):
    np.save(tmp_path / "a.npy", PLANE.values)
    stated = Stated(unit="um", size=(2e-6, 1.5e-6), turn=90)
    field = measured_surface(tmp_path / "a.npy", stated).field
    assert field.shape == (6, 4)
    assert field.spacing == pytest.approx((0.25e-6, 0.5e-6), rel=1e-15)
    assert load_gap(tmp_path / "a.npy", stated).shape == (6, 4)


def test_leak_across_and_along_grooves(tmp_path, capsys):
    """Rows of pixels 1 or 2 um high between walls: along x channels of g³ in parallel, along y all
    in series; a transposed map leaks the other. Either pressure is linear on each pixel, so that
    only CG errs, by 1e-8 of the energy.
    """
    gap = np.where(np.arange(17) % 2, 1e-6, 2e-6)[None, :] * np.ones((17, 1))
    np.savez(tmp_path / "gap.npz", gap=gap, spacing=[1e-6, 1e-6])
    leak = ["leak", str(tmp_path / "gap.npz"), "--json", "--representation", "constant"]
    rates = []
    for option in ([], ["--transpose", "yes"], ["--turn", "90"], ["--turn", "180"]):
        assert cli.main([*leak, *option]) == 0
        rates.append(json.loads(capsys.readouterr().out)["leak_rate"]["value"])
    parallel, series = 1e-18 * (9 * 8 + 8) / 17, 1e-18 * 17 / (9 / 8 + 8)
    expected = [1e5 * mean / 12e-3 for mean in (parallel, series, series, parallel)]
    assert rates == pytest.approx(expected, rel=2e-8)
