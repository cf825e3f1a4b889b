"""Gaps and contrasts at the ends of what can be asked for.

Units: tests/flow/test_invariants.py. Stripes and layers over many decades, slender pixels:
tests/flow/drawn_stripes.py. Knudsen numbers: tests/flow/test_slip.py.
"""

import numpy as np
import pytest
from drawn_stripes import Case
from gaps import bracketed
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField


@pytest.mark.parametrize("contrast", [1e15, 1e120, 1e180, 1e300])
@pytest.mark.parametrize("kind", ["along", "across"])
def test_contrast_of_stripes(kind, contrast):
    """The cube of a gap below 1e-60 of the largest one is beyond double precision.

    Side by side it does not matter.
    """
    heights = np.cbrt(np.where(np.arange(8) % 4 < 2, 1.0, 1 / contrast))
    case = Case(kind, heights, 8, (1.0, 1.0), "wall", "constant", "adaptive")
    if contrast > 1e180 and kind == "across":
        with pytest.raises(InvalidInput, match="critical constriction is 1e-100"):
            case.solve(700)
        return
    assert case.solve(700).converged  # and its bounds hold the closed form


def test_percolation():
    """The critical constriction keeps a smaller and smaller part of its gap, at last nothing: the
    leak rate falls (Dirichlet's principle), and is not zero before."""
    gap, before = rough_gap((16, 16), 0.3, 1), np.inf
    width = GridFilm(gap, "periodic").constriction.gap
    for part in (1.0, 1e-12, 0.0):
        values = np.maximum(0.0, gap.values - width)
        values[gap.values == width] = part * width
        film = GridFilm(GridField(values, gap.spacing, periodic=True), "periodic")
        leak = bracketed(film, 0.3, 1500)
        assert leak.lower <= before
        assert (leak.state, leak.upper > 0) == (("leaking", True) if part else ("sealed", False))
        before = leak.upper


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


@pytest.mark.parametrize("shape", [(1, 7), (7, 1), (2, 2), (3, 3), (31, 37)])
def test_few_pixels_and_primes(shape):
    """More flows if layers across the flow lose no pressure within, less if nothing flows across
    lanes along it."""
    gap = GridField(0.5 + np.random.default_rng(3).random(shape), (1.0, 1.0))
    K = gap.values**3
    layers, lanes = 1 / np.sum(1 / K.sum(axis=1)), np.sum(1 / np.sum(1 / K, axis=0))
    for sides in ("wall", "periodic"):
        leak = bracketed(GridFilm(gap, sides=sides, representation="constant"), 0.2, 6000)
        assert leak.converged
        assert leak.lower <= layers * (1 + 1e-9)
        assert lanes <= leak.upper * (1 + 1e-9)
        if 1 in shape:  # the only error is that of CG
            assert leak.bounds == pytest.approx((lanes, layers), rel=4e-8)
