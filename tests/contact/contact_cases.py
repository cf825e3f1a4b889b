"""Surfaces that the contact tests share, and the equilibrium computed independently in SI units."""

import numpy as np
import pytest

from fem_seal.contact import ContactState, ElasticSolid, Load, press
from fem_seal.contact.methods import USUAL_STOPPING
from fem_seal.contact.predictor import extrapolated
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, rms_height, self_affine

E_STAR = 3e6
SOLID = ElasticSolid(E_STAR)
SLOPE = 0.1


def rough_surface(shape=(64, 64), hurst=0.8, short=4, seed=1, pixel=1e-6, long=None):
    """Self-affine heights of rms slope 0.1; cut-offs in samples."""
    long = max(shape) / 4 if long is None else long
    size = tuple(n * pixel for n in shape)
    spectrum = Spectrum(hurst, long * pixel, short * pixel)
    return self_affine(spectrum, shape, size, rms_slope=SLOPE, seed=seed)


def pressed(height, part, *settings, **start):
    """Contact under a part of E* times the rms slope."""
    return press(height, SOLID, Load("pressure", part * E_STAR * SLOPE), *settings, **start)


def load_path(height, solid, loads, stopping=USUAL_STOPPING):
    """Yield the contact under one load after the other, each from the prediction of the others."""
    states = []
    for load in loads:
        state = press(height, solid, load, stopping, start=extrapolated(load.value, states))
        states.append((load.value, state))
        yield state


def compliance(field: GridField, E_star: float = E_STAR) -> np.ndarray:
    """2 / (E* q) on the full FFT grid, zero for the mean."""
    (nx, ny), (dx, dy) = field.shape, field.spacing
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(nx, dx)[:, None], np.fft.fftfreq(ny, dy)[None, :])
    return np.divide(2, E_star * q, out=np.zeros_like(q), where=q > 0)


def displacement(pressure: GridField, E_star: float = E_STAR) -> np.ndarray:
    """Displacement of zero mean under a pressure [m]."""
    modes = np.fft.fft2(pressure.values) * compliance(pressure, E_star)
    return np.fft.ifft2(modes).real


def energy_distance(one: GridField, other: GridField, E_star: float = E_STAR) -> float:
    """Mean of dp·S dp / 2 [J/m^2]."""
    change = GridField(one.values - other.values, one.spacing, periodic=True)
    return float(np.mean(change.values * displacement(change, E_star)) / 2)


def check_equilibrium(
    state: ContactState, height: GridField, tolerance: float, mean_gap: float | None = None
) -> None:
    """Signorini's conditions and the certificate, from SI arrays and numpy's FFT alone."""
    pressure, gap = state.pressure.values, state.gap.values
    assert pressure.min() >= 0
    assert gap.min() >= 0
    assert not np.any(pressure * gap)
    assert np.array_equal(state.contact, gap == 0)
    free_gap = displacement(state.pressure, state.contact_modulus) - height.values
    unit = rms_height(height)
    certificate = np.sum(pressure * (free_gap - free_gap.min())) / (unit * pressure.sum())
    if mean_gap is not None:
        own_gap = free_gap + height.values.mean() + mean_gap
        work = np.sum(pressure * own_gap) / (unit * pressure.sum())
        certificate = max(certificate, abs(work))
    assert certificate <= tolerance * 1.001 + 1e-12
    assert state.certificate == pytest.approx(certificate, rel=1e-3, abs=1e-11)
    # The gap is the elastic one up to a constant, apart from what was set to zero: open samples
    # exactly, pressed samples in the mean that the certificate bounds and each within 1e-4 of the
    # rms height, a limit that does not depend on the tolerance.
    change, pressed = free_gap - gap, pressure > 0
    change -= np.mean(change[~state.contact if not state.contact.all() else pressed])
    assert np.abs(change[~state.contact]).max(initial=0) < 1e-9 * unit
    assert np.sum(pressure * np.abs(change)) < 4 * tolerance * unit * pressure.sum()
    assert -change.min() < min(4 * tolerance, 1.01e-4) * unit
    assert np.abs(change[pressed]).max() < 1.01e-4 * unit
    # The weighted mean that `pressed_gap` refers to is within the certificate of that constant.
    deepest = np.abs(change[pressed]).max() / unit
    assert state.pressed_gap == pytest.approx(deepest, rel=1e-3, abs=4 * tolerance)
