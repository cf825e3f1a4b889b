"""What no function of a surface takes: one sentence names the argument and its fault."""

from functools import partial

import numpy as np
from project import refused_calls

from fem_seal.field_file import FieldMap
from fem_seal.grid import GridField
from fem_seal.surface import (
    IsotropicSpectrum,
    Preparation,
    Spectrum,
    cropped,
    detrended,
    fill,
    fit_spectrum,
    periodic_cell,
    prepare,
    profile_spectrum,
    resample,
    rms_slope,
    self_affine,
    twin,
)

NOISE = np.random.default_rng(0).normal(size=(64, 64))
REPEATS = GridField(NOISE, (1.0, 1.0), periodic=True)
ENDS = GridField(NOISE, (1.0, 1.0))
HOLED = NOISE.copy()
HOLED[5, 5] = np.nan
# A sine of one period has a plane of least squares, and a jump where that is taken away.
SINE = np.sin(2 * np.pi * np.arange(64) / 64)[:, None] * np.ones(64)
INF, NAN = float("inf"), float("nan")


def field_map(values, periodic=None):
    return FieldMap(np.asarray(values, dtype=float), (1.0, 1.0), periodic)


def synthesised(band=(0.8, 1 / 4, 1 / 20), **change):
    arguments = {"shape": (64, 64), "size": (1, 1), "rms_slope": 1.0, "seed": 0}
    return self_affine(Spectrum(*band), **arguments | change)


def fitted(values):
    return fit_spectrum(GridField(values, (1, 1), periodic=True))


test_one_sentence = refused_calls(
    *((partial(Spectrum, *band), "hurst") for band in ((h, 1.0, 0.1) for h in (0.0, 1.2, NAN))),
    *((partial(Spectrum, 0.8, *ends), "short_wa") for ends in ((0.1, 1), (1, 1), (1, -0.1))),
    (partial(Spectrum, 0.8, INF, 0.1), "long_wavelength"),
    (partial(Spectrum, 0.8, 1.0, 0.1, 2.0), "rolloff_wavelength"),
    (partial(Spectrum, 0.8, 1.0, 0.1, None, -1.0), "plateau"),
    (partial(synthesised, rms_slope=None), "either rms_height or rms_slope, got neither"),
    (partial(synthesised, rms_height=1, rms_slope=1), "either rms_height or rms_slope"),
    (partial(synthesised, shape=(8, 8)), "finer than the grid"),
    (partial(synthesised, size=(0.01, 0.01)), "does not fit into the cell"),
    (partial(synthesised, shape=(64, 0)), "shape"),
    (partial(synthesised, size=(1, -1)), "size"),
    (partial(synthesised, seed=-1), "seed"),
    (partial(synthesised, seed=1.5), "seed"),
    (partial(synthesised, scaling="mean"), "exact, ensemble"),
    (partial(synthesised, rms_slope=NAN), "rms_slope = nan must be a positive number"),
    (partial(synthesised, band=(0.8, 1 / 1.6, 1 / 1.9)), "no wave"),
    (partial(profile_spectrum, np.zeros((2, 8)), 1.0), "at least 16 samples, got 8"),
    (partial(profile_spectrum, np.zeros((2, 32)), 1.0), "flat profiles"),
    (partial(profile_spectrum, 3.3 + np.arange(64).reshape(2, 32), 1.0), "flat profiles"),
    (partial(profile_spectrum, np.full((2, 32), NAN), 1.0), "64 samples of the profiles are missi"),
    (partial(profile_spectrum, np.ones((2, 32)), 0.0), "step = 0.0 must be a positive number"),
    *(
        (partial(IsotropicSpectrum, np.array(edges), np.array(values), np.array(values)), words)
        for edges, values, words in (
            ([2.0, 1.0], [1.0], "ascending wavenumbers"),
            ([1.0, 2.0], [1.0, 1.0], r"m \+ 1 ascending"),
            ([1.0, 2.0], [-1.0], "not negative, got -1 m"),
        )
    ),
    *((partial(fitted, np.full((33, 31), z)), "a flat surface has no spec") for z in (0.0, 3.3e-6)),
    (partial(fitted, NOISE[:2, :2]), "a map of 2 x 2 samples has no spectrum"),
    (partial(fitted, NOISE), "shows no power law"),
    (partial(fitted, NOISE[:6, :6]), "6 x 6 samples shows no power law"),
    (partial(rms_slope, ENDS), "periodic"),
    (partial(resample, ENDS, (80, 80)), "periodic"),
    (partial(resample, REPEATS, (0, 10)), "shape"),
    (partial(twin, ENDS, 0), "a twin needs a periodic surface; set make_periodic"),
    (partial(twin, REPEATS, -1), "seed must be a non-negative integer, got -1"),
    (partial(detrended, field_map(NOISE), "cubic"), "'cubic' is unknown; choose from mean, plane"),
    (partial(periodic_cell, ENDS, "wrap"), "make_periodic = 'wrap' is unknown; choose from cut"),
    (partial(detrended, field_map(NAN * NOISE), "mean"), "all 4096 points are missing"),
    *(
        (partial(detrended, field_map(SINE, True), t), f"a jump at its seam without its {t} trend")
        for t in ("plane", "quadratic")
    ),
    (
        partial(fill, field_map(HOLED), 0.9 / 4096),
        r"1 of 4096 points are missing \(0.024 %\)",
    ),
    (partial(fill, field_map(np.full((2, 2), NAN)), 0.99), "all 4 points are missing"),
    (
        partial(prepare, field_map(HOLED), Preparation(fill="spline")),
        "fill = 'spline' is unknown; choose from harmonic",
    ),
    (
        partial(prepare, field_map(HOLED), Preparation(detrend="plane")),
        r"1 of 4096 points are missing; .*fill = 'harmonic'",
    ),
    (
        partial(prepare, field_map(NOISE, True), Preparation(make_periodic="cut")),
        "repeats already; leave make_periodic out",
    ),
    (
        partial(cropped, field_map(NOISE), ((0, 70), (0, 10))),
        "crop in x from 0 m to 70 m leaves the map, which is 64 m long",
    ),
    (
        partial(cropped, field_map(NOISE), ((0, 10), (9.5, 10.5))),
        "crop in y .* fewer than two of the samples, which are 1 m",
    ),
)
