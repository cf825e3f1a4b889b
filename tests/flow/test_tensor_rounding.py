"""Rounding of the conductivity tensor: what is stored is admissible, and no small energy is lost
beside a large one."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
from gaps import represented
from sample_gaps import rough_gap

from fem_seal.fenicsx import MPI
from fem_seal.flow.level import LevelProblem, lower_matrix
from fem_seal.flow.solution import Start
from fem_seal.grid import GridField
from fem_seal.mesh.torus import uniform_torus


def test_functions_of_a_single_winding_are_stored_exactly():
    """Corners of one unknown differ by the jumps of p across the seams, to the last digit: no other
    pressure is admissible."""
    i, j = np.indices((16, 32))
    values = np.where((2 * i - j) % 32 < 12, 0.5 + rough_gap((16, 32), 0.0, 2).values, 0.0)
    gap = represented(GridField(values, (1.0, 1.0), periodic=True), "constant")
    start = Start.first(gap, uniform_torus(gap.squares, 1))
    problem = LevelProblem(gap, start.mesh, start.values, MPI.COMM_SELF, 1e-14)
    pressures = problem.pressure(problem.guess(start).pressures)
    (p,), kept = pressures.minima, problem.kept
    across_x, across_y = map(Fraction, pressures.jumps[0])
    far = problem.mesh.copy[problem.mesh.cells[kept]]
    stored = [
        Fraction(v) - across_x * int(x) - across_y * int(y)
        for v, (x, y) in zip(p.corner_values.ravel(), far.reshape(-1, 2), strict=True)
    ]
    of_unknown: dict[int, set[Fraction]] = {}
    for number, value in zip(p.numbering.of_corner.ravel().tolist(), stored, strict=True):
        of_unknown.setdefault(number, set()).add(value)
    assert all(len(found) == 1 for found in of_unknown.values())


def test_small_energies_beside_large_ones():
    """C of the energies B of two unit jumps is B/det B, to a few roundings of √(C_ii C_jj)."""
    for ratio, mixed in ((1.0, -0.9), (1e12, 0.7), (1e12, 4e5), (1e24, -2.0), (1e24, 2e4)):
        B = np.array([[1.5, mixed], [mixed, 3 * ratio]])
        a, b, _, d = map(Fraction, B.ravel())
        exact = np.array([[float(x / (a * d - b * b)) for x in row] for row in ((a, b), (b, d))])
        found = lower_matrix(SimpleNamespace(jumps=np.eye(2), energies=B))
        scale = np.sqrt(np.outer(exact.diagonal(), exact.diagonal()))
        # With its diagonal scaled to ones B has a condition below 3, and a system of two equations
        # takes about ten steps.
        assert np.abs((found - exact) / scale).max() < 15 * np.finfo(float).eps
