"""demos/scenes/blasted.toml: the map is what its script makes, and three formats leak alike."""

import runpy

import numpy as np
import pytest
from project import ROOT

from fem_seal import Patch, Scene
from fem_seal.field_file import HEIGHT_NAMES, read_map

SCENES = ROOT / "demos" / "scenes"
FORMATS = ["blasted.nc", "blasted.h5", "blasted.npz"]


@pytest.mark.parametrize("name", FORMATS)
def test_map_is_that_of_the_script(name, tmp_path):
    """To half the step of 1 pm in which the script counts, whatever FFT it was run with."""
    runpy.run_path(str(SCENES / "blasted.py"))["write"](tmp_path)
    kept, made = (read_map(folder / name, HEIGHT_NAMES) for folder in (SCENES, tmp_path))
    np.testing.assert_allclose(kept.values, made.values, rtol=0, atol=1.01e-12)
    assert (kept.spacing, kept.periodic) == (made.spacing, False)
    assert kept.spacing == pytest.approx((1e-6, 1e-6), rel=1e-15)
    assert kept.missing == made.missing > 0


def test_twin_of_the_scene_has_its_spectrum():
    of_map, of_twin = (
        Patch(Scene.from_file(SCENES / f"{name}.toml")).surface.values
        for name in ("blasted", "blasted_twin")
    )
    powers = [np.abs(np.fft.rfft2(values)) ** 2 for values in (of_map, of_twin)]
    np.testing.assert_allclose(powers[1], powers[0], rtol=1e-9, atol=1e-13 * powers[0].max())
    assert np.abs(of_map - of_twin).max() > of_map.std()
