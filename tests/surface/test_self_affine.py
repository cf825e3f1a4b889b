"""Random surfaces: amplitude, spectrum, one stream of numbers, same surface on all grids."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from fem_seal.surface import Spectrum, rms_height, rms_slope, self_affine, synthesis

BAND = Spectrum(0.8, 1 / 4, 1 / 20)
SHAPES = [(64, 64), (63, 65), (61, 61), (48, 96), (50, 75)]


@pytest.mark.parametrize("shape", SHAPES)
def test_exact_scaling(shape):
    # A sum of up to 5000 squares: a few hundred roundings of 1e-16.
    by_height = self_affine(BAND, shape, (1, 1), rms_height=2e-6, seed=1)
    assert rms_height(by_height) == pytest.approx(2e-6, rel=1e-13)
    by_slope = self_affine(BAND, shape, (1, 1), rms_slope=0.3, seed=1)
    assert rms_slope(by_slope) == pytest.approx(0.3, rel=1e-13)
    assert abs(by_slope.values.mean()) < 1e-15 * abs(by_slope.values).max() * by_slope.values.size


def test_ensemble_scaling():
    """The mean square over seeds has the amplitude asked for; that of one sample scatters."""
    squares = np.array(
        [
            rms_slope(self_affine(BAND, (48, 48), (1, 1), rms_slope=1, scaling="ensemble", seed=k))
            ** 2
            for k in range(200)
        ]
    )
    standard_error = squares.std() / np.sqrt(len(squares))
    assert squares.std() > 1e-2
    assert abs(squares.mean() - 1) < 4 * standard_error


def test_one_surface_on_every_grid():
    """A coarser grid that resolves the short cut-off has the same heights at common points."""
    grids = [self_affine(BAND, (n, n), (1, 1), rms_slope=1, seed=7).values for n in (44, 88, 176)]
    for coarse, fine in pairwise(grids):
        assert np.abs(fine[::2, ::2] - coarse).max() < 1e-13 * np.abs(fine).max()


def test_stream_is_the_published_philox():
    """Pins the generator: words of numpy's Philox (counter-based, Salmon et al. 2011), seed 0.

    The first and the third place of shell 1 are the wave vectors (-1, 1) and (1, 1), of the same
    wavenumber: their waves are those numbers times one factor, to the rounding of a transform.
    """
    words = np.random.Philox(0).random_raw(3)[[0, 2]]
    radius = np.sqrt(-np.log(((words >> np.uint64(32)) + 0.5) / 2**32))
    waves = radius * np.exp(2j * np.pi * (words % np.uint64(2**32)) / 2**32)
    heights = self_affine(Spectrum(0.8, 8, 2), (8, 8), (8, 8), rms_height=1.0, seed=0).values
    factors = np.fft.fft2(heights)[[-1, 1], 1] / waves
    assert factors.real.min() > 0
    np.testing.assert_allclose(factors, factors[0].real, rtol=1e-13)


@pytest.mark.parametrize("shape", [(16, 16), (16, 15), (15, 16)])
def test_nyquist_modes_are_zero(shape):
    """Also with a cut-off of one sample: a grid represents only the cosine of such a wave. Every
    other wave is there, with a phase of its own."""
    nx, ny = shape
    heights = self_affine(Spectrum(0.8, 16, 1), shape, shape, rms_height=1.0, seed=3).values
    modes = np.fft.fft2(heights)
    there = np.abs(modes) > 1e-12 * np.abs(modes).max()
    if nx % 2 == 0:
        assert not there[nx // 2].any()
    if ny % 2 == 0:
        assert not there[:, ny // 2].any()
    # All but the mean, each with its complex conjugate; phases are known to 1e-12 or so.
    kept_x, kept_y = ((n - 1) // 2 * 2 + 1 for n in shape)
    phases = np.angle(modes[there]).round(9)
    assert len(phases) == len(np.unique(phases)) == kept_x * kept_y - 1


@pytest.mark.parametrize("shape", [(512, 512), (2048, 4), (4, 2048)])
def test_memory_is_refused_by_all_that_is_taken(shape, monkeypatch):
    """A long grid draws more random numbers than it has samples: 16 MB beside 0.5 MB."""
    refused = []
    monkeypatch.setattr(synthesis, "refuse_too_large", lambda size, _: refused.append(size))
    tracemalloc.start()
    self_affine(Spectrum(0.8, 4.0, 2.0), shape, shape, rms_height=1.0, seed=0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak <= refused[0]
