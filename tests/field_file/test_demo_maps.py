"""The maps of demos/scenes are what their scripts make, and are read."""

import runpy

import numpy as np
import pytest
from project import ROOT

from fem_seal.field_file import HEIGHT_NAMES, read_map

SCENES = ROOT / "demos" / "scenes"


@pytest.mark.parametrize(
    ("script", "name", "step"),
    [
        *(("blasted", f"blasted.{kind}", 1e-12) for kind in ("nc", "h5", "npz")),
        ("o-ring-measured", "o-ring-measured.txt", 1e-9),
    ],
)
def test_map_is_that_of_the_script(script, name, step, tmp_path):
    """To the step in which the script counts, whatever FFT it was run with."""
    module = runpy.run_path(str(SCENES / f"{script}.py"))
    module["write"](tmp_path)
    kept, made = (read_map(folder / name, HEIGHT_NAMES) for folder in (SCENES, tmp_path))
    np.testing.assert_allclose(kept.values, made.values, rtol=0, atol=1.01 * step)
    assert kept.spacing == made.spacing
