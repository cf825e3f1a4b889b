"""One surface through several formats: the same leak rate to rounding, each named by its digest."""

import json

import layouts
import numpy as np
import pytest
from project import write_toml

from fem_seal import cli
from fem_seal.surface import Spectrum, self_affine

SIZE = (32e-6, 32e-6)
SURFACE = self_affine(Spectrum(0.8, 16e-6, 4e-6), (32, 32), SIZE, rms_slope=0.1, seed=1)


def as_npz(folder):
    np.savez(folder / "a.npz", heights=SURFACE.values, spacing=SURFACE.spacing)
    return "a.npz", {}


def as_netcdf(folder):
    """As SurfaceTopography writes it, in micrometres."""
    size = [length * 1e6 for length in SIZE]
    layouts.topography_nc(folder / "a.nc", SURFACE.values * 1e6, size, "um")
    return "a.nc", {}


def as_hdf5(folder):
    """As the contact mechanics challenge has it: heights alone, here in nanometres."""
    layouts.plain_h5(folder / "a.h5", "surface", SURFACE.values * 1e9)
    return "a.h5", {"unit": "nm", "size": ["32 um", "32 um"]}


def as_npy(folder):
    np.save(folder / "a.npy", SURFACE.values * 1e6)
    return "a.npy", {"unit": "um", "size": ["32 um", "32 um"]}


def as_instrument(folder):
    """Bytes that only SurfaceTopography can tell from their contents."""
    as_netcdf(folder)
    (folder / "a.nc").rename(folder / "a.dat")
    return "a.dat", {}


def result_of(folder, *arguments):
    assert cli.main([*map(str, arguments), "--out", str(folder / "out")]) == 0
    return json.loads((folder / "out" / "result.json").read_text())


FORMATS = [as_npz, as_netcdf, as_hdf5, as_npy, as_instrument]


def test_same_leak_rate_of_a_surface(small_scene, tmp_path):
    """Dry contact included. The contact is solved to 1e-6 of its energy, and stops alike if the
    heights differ by rounding; what is left is the rounding of heights times its condition.
    """
    small_scene["contact"] = {"pressure": "0.2 MPa"}
    small_scene["flow"]["lift"] = "none"
    rates = []
    for write in FORMATS:
        folder = tmp_path / write.__name__
        folder.mkdir()
        path, said = write(folder)
        small_scene["surface"] = {"kind": "file", "path": path, **said}
        scene = write_toml(folder / "scene.toml", small_scene)
        rates.append(result_of(folder, "run", scene)["leak_rate"]["value"])
    assert rates[0] > 0
    np.testing.assert_allclose(rates, rates[0], rtol=1e-9)


@pytest.mark.parametrize("write", FORMATS)
def test_input_is_named_by_its_digest(write, small_scene, tmp_path):
    path, said = write(tmp_path)
    small_scene["surface"] = {"kind": "file", "path": path, **said}
    scene = write_toml(tmp_path / "scene.toml", small_scene)
    inputs = result_of(tmp_path, "run", scene)["provenance"]["inputs"]
    assert list(inputs) == [str(tmp_path / path)]
