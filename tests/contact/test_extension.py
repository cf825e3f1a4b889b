"""The preconditioner's extension beyond the free set: its algebra, its gain, its safeguard."""

from itertools import pairwise

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, rough_surface

from fem_seal.contact import extension as extension_module
from fem_seal.contact import free_set_cg, solve
from fem_seal.contact.extension import Extension
from fem_seal.contact.halving import WHOLE, Halving
from fem_seal.errors import NotConverged

RNG = np.random.default_rng(5)


def interpolation(n):
    """From n cells, every second of them with its right neighbour: weights 3/4 and 1/4, dense."""
    cells = (n + 1) // 2
    weights = np.zeros((2 * cells, cells))
    for i in range(cells):
        weights[2 * i, i] += 3 / 4
        weights[2 * i, (i - 1) % cells] += 1 / 4
        weights[2 * i + 1, i] += 3 / 4
        weights[2 * i + 1, (i + 1) % cells] += 1 / 4
    return weights[:n]


def in_two_directions(shape):
    return np.kron(interpolation(shape[0]), interpolation(shape[1]))


# Blocks of rows hold 32768 samples of the coarser grid: the last shape has two of them.
@pytest.mark.parametrize("shape", [(6, 8), (7, 5), (2, 3), (1, 4), (600, 257)])
def test_halving(shape):
    """Against the matrix; rows and columns apart where the matrix would be large."""
    halving = Halving(shape)
    coarse, fine = RNG.standard_normal(halving.coarse), RNG.standard_normal(shape)
    weights, base, out = RNG.random(shape), RNG.standard_normal(shape), np.empty(shape)
    rows, columns = interpolation(shape[0]), interpolation(shape[1])
    halving.interpolate(coarse, base, out, weights)
    assert out == pytest.approx(base + weights * WHOLE * (rows @ coarse @ columns.T), abs=1e-13)
    restricted = np.empty(halving.coarse)
    halving.restrict(fine, restricted, weights)
    wanted = WHOLE * rows.T @ (weights * fine) @ columns
    assert restricted == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("shape", [(6, 8), (7, 5), (2, 3), (300, 257)])
def test_transpose(shape):
    """<E x, y> = <x, E' y> for every x on the free set, up to rounding; E x is x there."""
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


@pytest.mark.parametrize("shape", [(8, 8), (6, 7)])
@pytest.mark.parametrize("fade", [1.0, 0.5])
def test_two_levels(monkeypatch, shape, fade):
    """The filling from coarser grids, written with dense matrices."""
    monkeypatch.setattr(extension_module, "LEVELS", 2)
    monkeypatch.setattr(extension_module, "FADE", fade)
    free = (RNG.random(shape) < 0.4).astype(float)
    x, extended = RNG.standard_normal(shape) * free, np.empty(shape)
    shares, values, spreads = [free.ravel()], [x.ravel()], []
    for grid in (shape, tuple((n + 1) // 2 for n in shape)):
        spread = in_two_directions(grid)
        mean = spread.T @ shares[-1] / 4
        weight = mean + fade * (1 - mean)
        values.append(spread.T @ values[-1] / 4 / weight)
        shares.append(mean / weight)
        spreads.append(spread)
    middle = values[1] + (1 - shares[1]) * (spreads[1] @ values[2])
    wanted = values[0] + (1 - shares[0]) * (spreads[0] @ middle)
    extension = Extension(free)
    extension.update()
    extension.extend(x, extended)
    assert extended.ravel() == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("shape", [(256, 64), (250, 61)])
def test_fades(shape):
    """Beside a free strip: smooth at its edge, falling with the distance over its width."""
    width = 8
    free = np.zeros(shape)
    free[:width] = 1
    extension = Extension(free)
    extension.update()
    extended = np.empty(shape)
    extension.extend(free.copy(), extended)
    beside = extended[width : shape[0] // 2]
    assert np.all(np.diff(beside, axis=0) < 0)
    # A cut-off falls by 1 at once.
    assert beside[0].min() > 0.8
    assert beside[width].max() < 0.6
    assert beside[4 * width].max() < 0.25
    assert beside.min() >= 0


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
    for early in ("SETTLED", "SETTLED_AT_START"):
        monkeypatch.setattr(free_set_cg, early, 1.2)
    saved = solve(height, E_STAR, pressure=pressure)
    assert np.count_nonzero(saved.contact != default.contact) <= 1
    for patience in ("RISES", "PATIENCE"):
        monkeypatch.setattr(free_set_cg, patience, 10**6)
    with pytest.raises(NotConverged):
        solve(height, E_STAR, pressure=pressure, max_iterations=4 * saved.iterations)


def test_good_start_is_extended_at_once(monkeypatch):
    """A start that is nearly right needs not settle again."""
    height = rough_surface((256, 256), hurst=0.4, short=1, long=32)
    pressure = 0.2 * E_STAR * SLOPE
    start = solve(height, E_STAR, pressure=0.97 * pressure)
    at_once = solve(height, E_STAR, pressure=pressure, start=start)
    monkeypatch.setattr(free_set_cg, "SETTLED_AT_START", 0.0)
    later = solve(height, E_STAR, pressure=pressure, start=start)
    assert free_set_cg.SETTLED < at_once.residuals[0] < 0.2
    assert at_once.iterations < later.iterations
    assert np.count_nonzero(at_once.contact != later.contact) <= 1


def test_conjugation(monkeypatch):
    """Fletcher and Reeves's factor until the free set has settled, then Polak and Ribière's.

    With z = M r, r restricted to the free set: <r, z> and <r - r_old, z> over <r_old, z_old>. Both
    are one as long as the free set and M stay as they are.
    """
    search, seen = free_set_cg._Search, []

    class Recorded(search):
        def precondition(self):
            found = super().precondition()
            arrays = (self.residual, self.steer, self.previous)
            seen.append([self.extended, *(np.array(a, dtype=float) for a in arrays)])
            return found

        def turn(self, conjugation):
            seen[-1].append(conjugation)
            return super().turn(conjugation)

    monkeypatch.setattr(free_set_cg, "_Search", Recorded)
    height = rough_surface((128, 128), hurst=0.4, short=1)
    solve(height, E_STAR, pressure=0.2 * E_STAR * SLOPE, start=np.ones(height.shape))
    differ = {True: 0.0, False: 0.0}
    for (before, old, z_old, *_), (extended, r, z, previous, factor, *_) in pairwise(seen):
        if extended != before:
            assert factor == 0
            continue
        assert np.array_equal(previous, old)
        reeves, ribiere = (np.vdot(a, z) / np.vdot(old, z_old) for a in (r, r - old))
        # Sums of products in single precision.
        wanted = max(ribiere, 0) if extended else reeves
        assert factor == pytest.approx(wanted, rel=1e-4, abs=1e-4)
        differ[extended] = max(differ[extended], abs(reeves - ribiere))
    # What is told apart above does differ, with the extension and without.
    assert min(differ.values()) > 0.01
