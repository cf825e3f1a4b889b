"""The preconditioner's extension beyond the free set: its algebra, its gain, its safeguard."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, rough_surface

from fem_seal.contact import free_set_cg, solve
from fem_seal.contact.extension import Extension
from fem_seal.errors import NotConverged

RNG = np.random.default_rng(5)


# Blocks of rows hold 32768 samples: the last shape has three blocks, the last of them shorter.
@pytest.mark.parametrize("shape", [(6, 8), (7, 5), (2, 3), (300, 257)])
def test_transpose(shape):
    """<E x, y> = <x, E' y> for every x on the free set, up to rounding."""
    free = (RNG.random(shape) < 0.4).astype(float)
    extension = Extension(free)
    extension.update()
    x, y, extended = RNG.standard_normal(shape) * free, RNG.standard_normal(shape), np.empty(shape)
    extension.extend(x, extended)
    gathered = y.copy()
    extension.gather(gathered)
    scale = np.linalg.norm(x) * np.linalg.norm(y)
    assert abs(np.vdot(extended, y) - np.vdot(x, gathered)) < 1e-14 * scale
    assert np.array_equal(extended * free, x)


def test_periodic_means():
    """By hand: one free point gives 1/4 to its neighbours, 1/16 (once or twice) beyond."""
    free = np.zeros((8, 8))
    free[0, 0] = 1
    extension = Extension(free)
    extension.update()
    extended = np.empty((8, 8))
    extension.extend(free.copy(), extended)
    wanted = np.zeros((8, 8))
    wanted[0, 0] = 1
    for i, j in [(0, 1), (1, 0), (0, -1), (-1, 0)]:
        wanted[i, j] = 1 / 4
        wanted[2 * i, 2 * j] = 1 / 16
    for i, j in [(1, 1), (1, -1), (-1, 1), (-1, -1)]:
        wanted[i, j] = 2 / 16
    assert np.array_equal(extended, wanted)


def test_saves_iterations(monkeypatch):
    """Same contact from fewer iterations; the number without grows faster with the grid."""
    height = rough_surface((256, 256), hurst=0.4, short=1, long=32)
    pressure = 0.2 * E_STAR * SLOPE
    extended = solve(height, E_STAR, pressure=pressure)
    monkeypatch.setattr(free_set_cg, "SETTLED", 0.0)
    cut_off = solve(height, E_STAR, pressure=pressure)
    assert np.count_nonzero(extended.contact != cut_off.contact) <= 1
    assert extended.iterations < 0.8 * cut_off.iterations


def test_safeguard(monkeypatch):
    """Extended before the free set has settled it may not converge at all: it is left out again."""
    height = rough_surface((256, 256), hurst=0.2, short=1, long=32)
    pressure = 0.2 * E_STAR * SLOPE
    default = solve(height, E_STAR, pressure=pressure)
    monkeypatch.setattr(free_set_cg, "SETTLED", 1.2)
    saved = solve(height, E_STAR, pressure=pressure)
    assert np.count_nonzero(saved.contact != default.contact) <= 1
    monkeypatch.setattr(free_set_cg, "PATIENCE", 10**6)
    with pytest.raises(NotConverged):
        solve(height, E_STAR, pressure=pressure, max_iterations=4 * saved.iterations)
