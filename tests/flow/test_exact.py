"""Channels known exactly: every level of every method must enclose them.

Corners, discs and smooth gaps of two dimensions: tests/verification and tests/validation.

Two finite tolerances occur. Bounds are widened by 1e-12 against rounding. CG stops when its
estimate of the relative energy error, right within a factor of two, is `tolerance` (1e-8 unless
stated). Enclosure must hold for any value of the latter, and is tested without any tolerance.
"""

import numpy as np
import pytest
from gaps import assert_enclosed, bracketed

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.theory.closed_forms import piecewise_linear_channel

METHODS = ["uniform", "adaptive"]
SIDES = ["wall", "periodic"]
ROUNDING = 1e-11  # ten times what the bounds are widened by


def orders(errors: list[float]) -> np.ndarray:
    """Observed order of convergence between meshes, each twice as fine as the one before."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("along", "sides"), [("x", "wall"), ("x", "periodic"), ("y", "wall")])
def test_channel_of_linear_pieces(method, along, sides):
    """Of g(x) the stream function is y, of g(y) the pressure is linear: the lower or the upper
    bound is exact at once. The other one converges at second order on uniform meshes."""
    profile = 0.5 + np.random.default_rng(3).random(9)
    values = np.repeat(profile[:, None], 5, axis=1)
    gap = GridField(values if along == "x" else values.T, (1 / 8, 1 / 10))
    exact = gap.size[1] / gap.size[0] * piecewise_linear_channel(profile)
    if along == "y":
        a, b = profile[:-1], profile[1:]
        exact = gap.spacing[1] * ((a**4 - b**4) / (a - b) / 4).sum() / gap.size[0]
    flow = bracketed(GridFilm(gap, sides=sides), unknowns=2500, method=method)
    assert_enclosed(flow, exact)
    at_once, other = ("lower", "upper") if along == "x" else ("upper", "lower")
    assert getattr(flow.levels[0], at_once) == pytest.approx(exact, rel=ROUNDING)
    if method == "uniform":
        errors = [abs(getattr(level, other) - exact) for level in flow.levels]
        assert min(orders(errors)[1:]) > 1.9


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("method", METHODS)
def test_separable_pixels_are_exact_on_the_first_mesh(sides, method):
    """K = f(x) h(y) on pixels: Q = Σ h dy / Σ dx/f; pressure and stream function are piecewise
    linear in x and in y alone. Contrast 1e8."""
    rng = np.random.default_rng(5)
    f, h = 10 ** rng.uniform(-4, 0, 7), 10 ** rng.uniform(-4, 0, 6)
    gap = GridField(np.cbrt(np.outer(f, h)), (0.5, 0.3))
    exact = 0.3 * h.sum() / (0.5 / f).sum()
    film = GridFilm(gap, representation="constant", sides=sides)
    flow = bracketed(film, 1e-6, method=method)
    # CG error 2e-8; 1e-8 more for the correction, whose first order vanishes at the minimum.
    assert [flow.lower, flow.upper] == pytest.approx([exact] * 2, rel=4e-8)
    assert len(flow.levels) == 1
    assert_enclosed(flow, exact)
