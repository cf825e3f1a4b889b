"""Star-mesh elimination against textbook resistors, a dense solve, and planar duality."""

from functools import partial
from itertools import product

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from fem_seal.finite_difference.elimination import conductance
from fem_seal.finite_difference.star_mesh import star_mesh
from fem_seal.finite_difference.stencil import Stencil

approx = partial(pytest.approx, rel=1e-12)

EPS = np.finfo(float).eps


def random_stencil(shape, periodic, rng, decades=0.0):
    mx, my = shape
    sizes = (mx - 1, my), (mx, my if periodic else my - 1)
    x, y = (10 ** (decades * rng.uniform(-0.5, 0.5, s)) * rng.uniform(0.5, 1, s) for s in sizes)
    return Stencil(x, y, periodic)


def assembled_conductance(stencil):
    """Conductance from Kirchhoff's laws as one sparse system, solved by SuperLU."""
    pressure = stencil.pressure(
        np.ones(stencil.shape, dtype=bool), lambda matrix, b: spsolve(matrix.tocsc(), b)
    )
    return np.sum(stencil.x[0] * (pressure[0] - pressure[1]))


# Sizes inside a tile, over its edge, over several tiles and over the column blocks of the kernel.
SHAPES = [(2, 1), (2, 7), (3, 2), (9, 1), (33, 32), (34, 33), (20, 70), (70, 20)]


@pytest.mark.parametrize(
    ("shape", "periodic"), [*product(SHAPES, (False, True)), ((97, 190), True)]
)
def test_same_as_kirchhoffs_equations(shape, periodic):
    """Both solve the same stencil; the factorisation loses about condition number (1e4) · eps."""
    stencil = random_stencil(shape, periodic, np.random.default_rng(shape))
    assert conductance(stencil) == approx(assembled_conductance(stencil), rel=1e4 * EPS)


@pytest.mark.parametrize(
    ("shape", "decades"), [((3, 3), 200.0), ((12, 7), 0.0), ((70, 45), 200.0), ((97, 131), 60.0)]
)
def test_planar_dual_conducts_the_reciprocal(shape, decades):
    """Links 1/c across the links c of a strip with walls, driven from wall to wall: product 1.

    Exact for planar networks. Rounding: one division and a few additions and products for every
    elimination a path meets, some hundreds here.
    """
    mx, my = shape
    stencil = random_stencil(shape, False, np.random.default_rng(shape), decades)
    across = np.zeros((my + 1, mx - 2))
    across[1:-1] = 1 / stencil.y[1:-1].T
    dual = Stencil((1 / stencil.x).T, across, False)
    assert conductance(stencil) * conductance(dual) == approx(1, rel=1000 * EPS)


def test_elimination_leaves_the_schur_complement():
    """Over two panels and several blocks of columns.

    Each entry collects one term for every eliminated node, the dense solve as many; links of 0.5 to
    1: well conditioned.
    """
    links = np.random.default_rng(0).uniform(0.5, 1, (700, 700))
    links = np.triu(links, 1) + np.triu(links, 1).T
    matrix = np.diag(links.sum(axis=0)) - links
    gone, left = slice(200), slice(200, None)
    solved = np.linalg.solve(matrix[gone, gone], matrix[gone, left])
    exact = matrix[left, gone] @ solved - matrix[left, left]
    np.fill_diagonal(exact, 0)
    remaining = star_mesh(links[None].copy(), 200)[0].copy()
    np.fill_diagonal(remaining, 0)
    np.testing.assert_allclose(remaining, exact, rtol=10 * 200 * EPS)


def test_no_chain_of_links_is_exactly_zero():
    stencil = random_stencil((40, 40), True, np.random.default_rng(0))
    stencil.x[17] = 0
    assert conductance(stencil) == 0.0
