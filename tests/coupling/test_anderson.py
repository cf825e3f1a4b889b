"""Anderson's acceleration solves an affine problem in as many passes as it remembers."""

import numpy as np
import pytest

from fem_seal.coupling.anderson import Mixture


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("depth", [1, 2, 3])
def test_affine_maps_are_solved_exactly(depth, seed):
    """p -> A p + b on R^depth: depth + 1 passes determine it, and no step along residuals is left.

    What was added before them is forgotten: passes of another map, with another fixed point. The
    arrays have 24 bits; the normal equations square the condition of the differences.
    """
    rng = np.random.default_rng(seed)
    A, other = (rng.uniform(-0.5, 0.5, (depth, depth)) for _ in range(2))
    exact = rng.normal(size=depth)
    mixture = Mixture(depth)
    for _ in range(3):
        p = rng.normal(size=depth)
        mixture.add(p, other @ p + 1.0)
    corners = [np.zeros(depth), *np.eye(depth)]
    for p in corners:
        mixture.add(p, exact + A @ (p - exact))
    for part in (0.25, 1.0):
        np.testing.assert_allclose(mixture.step(part), exact, atol=1e-4)


def test_without_a_memory_a_step_is_that_of_the_residual():
    mixture = Mixture(2)
    mixture.add(np.array([1.0, 2.0]), np.array([3.0, 2.0]))
    np.testing.assert_array_equal(mixture.step(0.5), [2.0, 2.0])
