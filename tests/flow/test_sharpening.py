"""Hats on the hypotenuses: what they take off an energy is what admissible functions can take."""

import numpy as np
import pytest
from gaps import level_problem, plain_bounds, represented, rough_gap, solved

from fem_seal.flow.bubbles import stream_bubbles
from fem_seal.grid import GridField
from fem_seal.mesh.nested import NestedMesh


def everything(mesh: NestedMesh) -> np.ndarray:
    return np.ones(len(mesh.cells), dtype=bool)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("width", [1, 2, 4])
@pytest.mark.parametrize("spacing", [(1.0, 1.0), (1.0, 7.0)])
@pytest.mark.parametrize("seed", range(3))
def test_one_square_has_one_hat(representation, width, spacing, seed):
    """Pressure and stream function are given at all four corners of one square: the only hat, on
    its diagonal, is the only unknown of the mesh of halves, and sharpening is solving that. One
    unknown: CG is exact. Squares of 1, 4 and 16 pixels."""
    shape = (width + 1, width + 1) if representation == "linear" else (width, width)
    samples = np.random.default_rng(seed).uniform(0.2, 1, shape)
    gap = represented(GridField(samples, spacing), representation, width=width)
    problem = level_problem(gap, width)
    assert problem.unknowns == 0
    halves = level_problem(gap, width, markings=[everything])
    assert halves.unknowns == 1
    found = problem.sharpened(*solved(problem))
    assert found == pytest.approx(plain_bounds(halves), rel=1e-12, abs=0)
    if width > 1:
        plain = plain_bounds(problem)
        # Not nothing: a thousand times what rounding may do.
        assert plain[0] * (1 + 1e-9) < found[0] < found[1] < plain[1] * (1 - 1e-9)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("periodic", [False, True])
def test_sharpened_on_squares_of_several_pixels(representation, periodic):
    """As on pixels: hats on hypotenuses are functions of the mesh of halves, so that the sharpened
    bounds lie between those of the two meshes. Both meshes are above the pixel, where a cell with
    contact in it is closed (no power traces: the halves are nested), and no hat may stand on one.
    CG errs by 2e-8."""
    gap = represented(rough_gap((64, 64), 0.004, 5, smooth=2), representation, width=8)
    problem = level_problem(gap, 8, periodic)
    assert 0 < problem.data.closed.sum() < len(problem.data.closed) / 2
    lower, upper = problem.sharpened(*solved(problem))
    halves = plain_bounds(level_problem(gap, 8, periodic, markings=[everything]))
    plain = plain_bounds(problem)
    # On a closed cell ψ is constant. A hat there costs nothing where its half is closed, and would
    # lower the energy below that of any admissible function.
    bubble = stream_bubbles(problem.mesh, problem.data, problem.kept)
    assert problem.kept.all()
    assert (bubble[problem.data.closed] == -1).all()
    assert (bubble >= 0).any()
    assert halves[1] * (1 - 4e-8) <= upper < plain[1]
    assert plain[0] < lower <= halves[0] * (1 + 4e-8)
