"""The closing saddle: symmetric, in order, and with exponents that approach the published one."""

from itertools import pairwise

import numpy as np
import pytest

from fem_seal import cli
from fem_seal.contact import solve
from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.letter.saddle import (
    DISTANCES,
    EXPONENT,
    LocalExponent,
    SaddlePoint,
    close_saddle,
    closing_pressure,
    limiting_exponent,
    local_exponents,
    pressed,
    surface,
)


@pytest.fixture(scope="module")
def closing():
    return {n: closing_pressure(n) for n in (32, 64, 128)}


@pytest.fixture(scope="module")
def exponents(closing):
    """On 64 and 128 samples, down to a distance of 0.03."""
    return {n: local_exponents(close_saddle(closing[n], DISTANCES[:5])) for n in (64, 128)}


def test_the_saddle_lies_in_the_middle():
    """Lowest of the ridge along y, highest of the valley along x; contact begins at (0.5, 0)."""
    h = surface(16).values
    assert h[8, 8] == h[8].min() == h[:, 8].max()
    assert np.unravel_index(h.argmax(), h.shape) == (8, 0)


def test_full_contact_where_the_wave_is_flattened():
    """p = E* q/2 H (cos + cos): the trough, -2π in units of E* H/λ, is full from 2π on."""
    assert pressed(16, 2 * np.pi * 1.001).contact_area_fraction == 1
    assert pressed(16, 2 * np.pi * 0.97).contact_area_fraction < 1


def test_closing_is_bracketed_and_the_same_across(closing):
    """All saddles of the square lattice close at once: turned, it seals at the same pressure."""
    bracket = closing[32]
    assert 0 < bracket.sealed / bracket.leaking - 1 < 1e-6
    for pressure, sealed in ((bracket.leaking, False), (bracket.sealed, True)):
        turned = surface(32)
        turned = type(turned)(turned.values.T, turned.spacing, True)
        gap = solve(turned, 1.0, pressure=pressure, tolerance=1e-10).gap
        assert GridFilm(gap, "periodic").sealed is sealed


def test_closing_converges_with_the_grid(closing):
    """A finer grid closes earlier; changes fall by 2 or more, first order at least."""
    coarse, middle, fine = (closing[n].pressure for n in (32, 64, 128))
    assert coarse > middle > fine
    assert coarse - middle > 2 * (middle - fine)
    with pytest.raises(InvalidInput, match="even"):
        closing_pressure(33)


def test_exponents_fall_towards_the_published_one(exponents):
    """Q vanishes faster than (p_c - p)^(69/20) far from closing and approaches it from above."""
    values = [e.value for e in exponents[128]]
    assert all(near < far for far, near in pairwise(values))
    assert values[0] > EXPONENT + 0.3
    assert values[-1] == pytest.approx(EXPONENT, abs=0.15)
    # Where the grids agree the error is that of the brackets.
    first, same = (exponents[n][0] for n in (64, 128))
    assert abs(first.value - same.value) < first.error + same.error
    # The gap alone, cubed, would vanish faster: the constriction gets shorter as well.
    assert all(3 * e.gap > e.value > 2.5 * e.gap for e in exponents[128])


def power_law(exponent, distances=DISTANCES):
    return [
        SaddlePoint(8, x, 0.4, x**1.2, 0.99 * x**exponent, 1.01 * x**exponent) for x in distances
    ]


def test_local_exponents_of_a_power_law():
    for e in local_exponents(power_law(3.2)):
        assert e.value == pytest.approx(3.2, rel=1e-9)
        assert e.gap == pytest.approx(1.2, rel=1e-9)
        # Both brackets, ±1 %, against a step of 10^(1/4).
        assert e.error == pytest.approx(np.log(1.01 / 0.99) / np.log(10**0.25), rel=1e-9)


def test_limit_of_known_corrections():
    """β + a x^ω on the fine grid, off by twice as much on the coarse one; a wild pair is left."""
    x = np.array(DISTANCES)
    exact = 3.1 + 1.5 * x**0.8
    fine = [LocalExponent(a, b - 0.004, 0.0, 1.2) for a, b in zip(x, exact, strict=True)]
    coarse = [LocalExponent(a, b - 0.008, 0.0, 1.2) for a, b in zip(x, exact, strict=True)]
    coarse[-1] = LocalExponent(x[-1], 2.0, 0.0, 1.2)
    limit = limiting_exponent(coarse, fine)
    assert limit.value == pytest.approx(3.1, abs=1e-6)
    assert (limit.amplitude, limit.power) == pytest.approx((1.5, 0.8), rel=1e-5)
    # The extrapolation in n has moved it by 0.004.
    assert limit.error == pytest.approx(0.004, rel=1e-3)
    with pytest.raises(InvalidInput, match="take more samples"):
        limiting_exponent(coarse[-5:], fine[-5:], trusted=1e-3)


def test_command_writes_what_it_says(tmp_path, capsys):
    """Exponents of the finer grid, and their limit beside the published one."""
    out = tmp_path / "saddle"
    assert cli.main(["study", "saddle", "--samples", "64", "96", "--out", str(out)]) == 2
    assert "each twice as fine" in capsys.readouterr().err
    # On so few samples grids agree on an exponent that is that of a single sample.
    assert cli.main(["study", "saddle", "--samples", "8", "16", "--out", str(out)]) == 2
    assert "from 32 on" in capsys.readouterr().err
    assert not out.exists()
    assert cli.main(["study", "saddle", "--samples", "64", "128", "--out", str(out)]) == 0
    output = capsys.readouterr().out
    assert "128 samples a period: closes at 1.4365" in output
    assert f"published {EXPONENT}" in output
    assert {path.name for path in out.iterdir()} == {"points", "saddle.csv", "saddle.png"}
    rows = (out / "saddle.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * len(DISTANCES)
