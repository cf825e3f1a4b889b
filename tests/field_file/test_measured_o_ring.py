"""demos/scenes/o-ring-measured.toml: the file is what its script makes, and is read."""

import runpy

import numpy as np
import pytest
from project import ROOT

from fem_seal.field_file import HEIGHT_NAMES, read_map

SCENES = ROOT / "demos" / "scenes"
NAME = "o-ring-measured"


def test_map_is_that_of_the_script(tmp_path):
    """To the step of 1 nm in which the file counts, whatever FFT it was made with."""
    script = runpy.run_path(str(SCENES / f"{NAME}.py"))
    script["write"](tmp_path)
    kept, made = (read_map(folder / f"{NAME}.txt", HEIGHT_NAMES) for folder in (SCENES, tmp_path))
    np.testing.assert_allclose(kept.values, made.values, rtol=0, atol=1.01e-9)
    # Half a step of rounding against the heights themselves, x first.
    np.testing.assert_allclose(kept.values, script["heights"]() * 1e-6, rtol=0, atol=0.51e-9 + 1e-9)
    assert kept.spacing == pytest.approx((0.78125e-6, 0.78125e-6), rel=1e-15)
    assert 0.029 < kept.missing / kept.values.size < 0.033
