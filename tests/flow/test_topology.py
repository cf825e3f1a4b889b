"""Numberings of both problems: what carries flow, and room for the rows of their matrices.

That the functions so numbered are admissible, and no fewer than those, shows in the bounds of
`test_brute_force.py` and in the points of `test_leak_rate.py`.
"""

import numpy as np
import pytest
from gaps import everything, meshed, represented

from fem_seal.flow.topology import dual_numbering, open_cells
from fem_seal.grid import GridField
from fem_seal.mesh.nested import PIXEL


def topology(shape, contact, periodic, halvings=0):
    """Mesh, cell data and open cells of a gap of ones with contact at given samples."""
    values = np.ones(shape)
    values[tuple(np.array(contact, dtype=int).reshape(-1, 2).T)] = 0
    if periodic:
        values[:, -1] = values[:, 0]
    gap = represented(GridField(values, (1.0, 1.0)))
    mesh, vertex = meshed(gap, 1, periodic, [everything] * halvings)
    data = gap.cell_data(mesh, vertex)
    return mesh, data, open_cells(mesh, data)


@pytest.mark.parametrize("periodic", [False, True])
def test_pockets_and_dead_ends(periodic):
    """Open cells with no way to both ends are left out: a pocket, and a bay of the inlet."""
    ring = [(i, j) for i in (2, 3, 4) for j in (2, 3, 4) if (i, j) != (3, 3)]
    bay = [(1, j) for j in (6, 7, 8)] + [(0, 6), (0, 8)]
    mesh, _, cells = topology((8, 10), ring + bay, periodic)
    centre = mesh.xy[mesh.cells].mean(axis=1) / PIXEL
    in_ring = (abs(centre - [3, 3]) < 1).all(axis=1)
    in_bay = (centre[:, 0] < 1) & (centre[:, 1] > 6) & (centre[:, 1] < 8)
    assert np.array_equal(~cells.kept, in_ring | in_bay)


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize(
    "contact", [[], [(2, 3), (3, 3), (3, 4), (4, 5)], [(i, 2) for i in range(5)]]
)
def test_rows_of_the_matrix_have_room(periodic, contact):
    """Neighbours are never underrated, or the matrix would not hold them; nor are they overrated
    where each of them is one vertex and none is given, or there would be room for nothing."""
    mesh, data, cells = topology((7, 7), contact, periodic, halvings=2)
    vertex = mesh.twin[mesh.cells[cells.kept]]
    duals = [dual_numbering(mesh, data, cells.kept, merged) for merged in (True, False)]
    for jumps in (cells.pressures, *duals):
        numbering = jumps.numberings[0]
        number = numbering.of_corner
        room = numbering.neighbours(mesh.edges.of_cell[cells.kept])
        assert len(room) == numbering.count
        for unknown in range(numbering.count):
            near = (number == unknown).any(axis=1)
            others = set(number[near].ravel().tolist()) - {unknown}
            assert room[unknown] >= len(others - {-1})
            if -1 not in others and len(np.unique(vertex[near])) == len(others) + 1:
                assert room[unknown] == len(others)
