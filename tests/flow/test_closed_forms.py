"""Bounds of gaps that depend on one coordinate hold their closed forms, to rounding.

Slender pixels, layers in series and stripes side by side whose gaps span up to a hundred decades.
"""

from itertools import product

import numpy as np
import pytest
from drawn_stripes import ROUNDING, Case, across, along
from gaps import bracketed

from fem_seal.film import GridFilm
from fem_seal.flow import Limits
from fem_seal.flow.cell_tensor import conductivity_tensor
from fem_seal.flow.integrals import AT_ONCE
from fem_seal.fluid import Slip
from fem_seal.grid import GridField

UNKNOWNS = 1500  # the most of a mesh


@pytest.mark.parametrize("seeds", [range(16), pytest.param(range(3000), marks=pytest.mark.slow)])
def test_any_gap(seeds):
    """Of all kinds, aspects and contrasts."""
    for seed in seeds:
        case = Case.random(np.random.default_rng((0, seed)))
        case.solve(UNKNOWNS)  # holds its bounds against the closed form


def test_in_series_until_the_bounds_agree():
    """Layers of a linear gap over twelve decades: bounds 5 % apart, by cells far below a pixel."""
    heights = 10 ** (-12 * np.random.default_rng(5).random(8))
    case = Case("across", heights, 3, (1e-6, 1e-6), "wall", "linear", "adaptive")
    assert case.solve(60_000).converged


def test_one_pixel_channel():
    """Through contact, straight and with two turns.

    A corner of a channel counts 0.5590 of a square (conformal map, as in sheet resistance:
    F. W. Grover's corner square; four digits). Its bounds hold that rounded number to 1e-3.
    """
    straight, bent = np.zeros((2, 9, 9))
    straight[:, 4] = bent[:5, 2] = bent[4, 2:7] = bent[4:, 6] = 0.3
    for values, squares, slack in ((straight, 9, 0), (bent, 11 + 2 * 0.5590, 1e-3)):
        film = GridFilm(GridField(values, (1.0, 1.0)), representation="constant")
        leak = bracketed(film, 0.05, 6000)
        exact = 0.3**3 / squares
        assert leak.lower * (1 - slack) <= exact <= leak.upper * (1 + slack)
        assert leak.converged


@pytest.mark.parametrize(("kind", "exact"), [("along", "upper"), ("across", "lower")])
def test_over_several_batches(kind, exact):
    """A channel g(y), or g(x): on all levels one of the bounds is exact, on the last one the sum
    over several batches. Bounds are widened by 1e-12; CG stops at 2e-8 of the energy at most, and
    starts from what is exact."""
    heights = 1 + 0.3 * np.sin(5 * np.linspace(0, 1, 49))
    case = Case(kind, heights, 49, (1 / 48, 1 / 48), "wall", "linear", "uniform")
    flow = case.solve(10_000, rtol=1e-9)
    assert flow.levels[-1].cells > 4 * AT_ONCE
    for level in flow.levels:
        assert getattr(level, exact) == pytest.approx(case.exact, rel=4e-8)


@pytest.mark.parametrize(
    ("count", "aspect", "on", "contact", "slip"),
    [
        # Cells of two and three samples begin with triangles smaller than a pixel.
        *product([2, 3], [1.0], ["linear", "constant"], [False], [None]),
        *product([8], [1e-6, 1e6], ["linear", "constant"], [False, True], [None]),
        (8, 1.0, "linear", True, Slip(3.0, 1.0, 2e-3)),
        *product([8], [1.0], ["constant"], [False, True], [Slip(3.0, 1.0, 2e4)]),
    ],
)
def test_conductivity_tensor_of_stripes(count, aspect, on, contact, slip):
    """A periodic cell of stripes conducts the mean of K along them and 1/mean(1/K) across; with
    slip K = g³ + l g² at the mean pressure, whose mean over a linear gap from a to b is that of g³
    and l (a² + ab + b²)/3."""
    heights = 10 ** (-3 * np.random.default_rng(7).random(count))
    if contact:
        heights[[2, 3, 6]] = 0.0
    gap = GridField(np.repeat(heights[None, :], 4, axis=0), (aspect, 1.0), periodic=True)
    linear, length = on == "linear", slip.product / slip.mean_pressure if slip else 0.0
    profile = np.append(heights, heights[0]) if linear else heights
    a, b = (profile[:-1], profile[1:]) if linear else (heights, heights)
    slipping = length * np.mean(a * a + a * b + b * b) / 3
    exact = np.diag([along(profile, 1.0, linear) / count + slipping, 0.0])
    if not contact:
        K = heights**3 + length * heights**2
        exact[1, 1] = count / across(profile, 1.0, linear) if slip is None else 1 / np.mean(1 / K)
    found = conductivity_tensor(
        gap,
        viscosity=1 / 12,
        slip=slip,
        representation=on,
        rtol=0.05,
        limits=Limits(unknowns=UNKNOWNS),
    )
    # Where pixels are a million times as wide as long rounding may keep CG from its tolerance.
    assert found.converged or aspect == 1e-6
    # As quadratic forms, in units of what each direction conducts.
    unit = np.sqrt(np.diag(found.upper)) + (np.diag(found.upper) == 0)
    for difference in (found.upper - exact, exact - found.lower):
        assert np.linalg.eigvalsh(difference / np.outer(unit, unit)).min() >= -ROUNDING
