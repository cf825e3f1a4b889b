"""Gaps and contrasts at the ends of what can be asked for.

Units: tests/flow/test_invariants.py. Stripes and layers over many decades, slender pixels:
tests/flow/drawn_stripes.py. Knudsen numbers: tests/flow/test_slip.py.
"""

import numpy as np
import pytest
from gaps import bracketed

from fem_seal.film import GridFilm
from fem_seal.grid import GridField


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
