"""The in-place transforms against numpy's, and the plans kept on disk."""

import json

import numpy as np
import pyfftw
import pytest

from fem_seal.contact import transform
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.transform import RealTransform, wisdom_path


@pytest.mark.parametrize("shape", [(8, 8), (7, 9), (5, 8), (8, 1), (1, 6), (13, 4)])
@pytest.mark.parametrize(("precision", "rounding"), [("float64", 1e-14), ("float32", 1e-5)])
def test_against_numpy(shape, precision, rounding):
    values = np.random.default_rng(0).normal(size=shape)
    work = RealTransform(shape, precision, threads=2)
    work.values[...] = values
    work.forward()
    assert np.abs(work.modes - np.fft.rfft2(values)).max() < rounding * values.size
    work.backward()
    assert np.abs(work.values / values.size - values).max() < rounding


def test_curvature_is_parsevals():
    """<p, S p> from half a transform is the sum over the grid."""
    half_space = HalfSpace((12, 15), (1.0, 0.7), precision="double")
    pressure = np.random.default_rng(1).normal(size=(12, 15))
    direct = float(np.sum(pressure * half_space.displacement(pressure)))
    spent = half_space.pairs
    half_space.steer.values[...] = pressure
    assert half_space.curvature() == pytest.approx(direct, rel=1e-12)
    assert half_space.pairs - spent == 0.5


def test_pressure_inverts_displacement():
    half_space = HalfSpace((12, 15), (1.0, 0.7))
    pressure = np.random.default_rng(1).normal(size=(12, 15))
    back = half_space.pressure(half_space.displacement(pressure).copy())
    assert np.abs(back - (pressure - pressure.mean())).max() < 1e-13


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """A process that knows no plans, with an empty cache folder."""
    known = pyfftw.export_wisdom()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    transform._load_wisdom.cache_clear()
    pyfftw.forget_wisdom()
    yield tmp_path
    pyfftw.import_wisdom(known)
    transform._load_wisdom.cache_clear()


def test_wisdom_is_kept(own_cache):
    RealTransform((34, 38), "float64", threads=1, measured_from=1)
    assert wisdom_path() == own_cache / "fem_seal" / "fftw-wisdom.json"
    kept = wisdom_path().read_bytes()
    assert [path.name for path in wisdom_path().parent.iterdir()] == ["fftw-wisdom.json"]
    pyfftw.forget_wisdom()
    transform._load_wisdom.cache_clear()
    RealTransform((34, 38), "float64", threads=1, measured_from=1)
    # The plans were read back: nothing new had to be measured and kept.
    assert wisdom_path().read_bytes() == kept


@pytest.mark.parametrize("content", ["", "[1, 2", '["no", "wisdom", "here"]'])
def test_foreign_wisdom_only_costs_time(own_cache, content):
    wisdom_path().parent.mkdir()
    wisdom_path().write_text(content)
    RealTransform((8, 8), "float64", threads=1, measured_from=1)
    assert len(json.loads(wisdom_path().read_text())) == 3
