"""Numberings: contact separates values of the pressure and joins those of the stream function.

That the functions so numbered are admissible shows in the bounds of `test_brute_force.py`.
"""

import numpy as np
import pytest
from gaps import everything, meshed, represented

from fem_seal.flow.topology import dual_numbering, open_cells
from fem_seal.grid import GridField
from fem_seal.mesh.nested import PIXEL


class Topology:
    """Mesh, cell data and open cells of a gap of ones with contact at given samples."""

    def __init__(self, shape, contact, periodic=False, halvings=0):
        values = np.ones(shape)
        values[tuple(np.array(contact, dtype=int).reshape(-1, 2).T)] = 0
        if periodic:
            values[:, -1] = values[:, 0]
        gap = represented(GridField(values, (1.0, 1.0)))
        self.mesh, vertex = meshed(gap, 1, periodic, [everything] * halvings)
        self.data = gap.cell_data(self.mesh, vertex)
        self.cells = open_cells(self.mesh, self.data)

    def primal(self):
        return self.cells.pressures.numberings[0]

    def dual(self, merge_blocked=True):
        return dual_numbering(self.mesh, self.data, self.cells.kept, merge_blocked).numberings[0]

    def points_inside(self) -> int:
        """How many points lie between inlet and outlet."""
        return int((~self.mesh.inlet & ~self.mesh.outlet).sum())

    def at(self, numbering, i, j, attribute="of_corner") -> np.ndarray:
        """What a numbering gives the corners of all kept cells at the point (i, j)."""
        point = (self.mesh.xy[self.mesh.cells[self.cells.kept]] == np.array([i, j]) * PIXEL).all(-1)
        return getattr(numbering, attribute)[point]


def line(start, stop, j):
    return [(i, j) for i in range(start, stop)]


@pytest.mark.parametrize("halvings", [0, 1, 2, 3])
def test_contact_line_parts_the_pressure(halvings):
    """A line one vertex wide: two pressures along it, one at its ends, one everywhere else."""
    case = Topology((7, 5), line(2, 5, 2), halvings=halvings)
    numbering = case.primal()
    assert case.cells.kept.all()
    for (i, j), pressures in {(2, 2): 1, (3, 2): 2, (4, 2): 1, (3, 3): 1, (1, 2): 1}.items():
        assert len(np.unique(case.at(numbering, i, j))) == pressures
    split = {0: 1, 1: 1, 2: 3, 3: 3}[halvings]  # points inside the line, midpoints included
    assert numbering.count == case.points_inside() + split


@pytest.mark.parametrize("periodic", [False, True])
def test_pockets_and_dead_ends(periodic):
    """Open cells with no way to both ends are left out: a pocket, and a bay of the inlet."""
    ring = [(i, j) for i in (2, 3, 4) for j in (2, 3, 4) if (i, j) != (3, 3)]
    bay = [(1, j) for j in (6, 7, 8)] + [(0, 6), (0, 8)]
    case = Topology((8, 10), ring + bay, periodic=periodic)
    centre = case.mesh.xy[case.mesh.cells].mean(axis=1) / PIXEL
    in_ring = (abs(centre - [3, 3]) < 1).all(axis=1)
    in_bay = (centre[:, 0] < 1) & (centre[:, 1] > 6) & (centre[:, 1] < 8)
    assert np.array_equal(~case.cells.kept, in_ring | in_bay)


@pytest.mark.parametrize("halvings", [0, 1, 2])
def test_patch_is_one_unknown(halvings):
    """An island: connected contact has one stream function, other contact another."""
    case = Topology((9, 9), [(3, 3), (4, 3), (4, 4), (5, 4), (6, 6)], halvings=halvings)
    numbering = case.dual()
    island = {int(v) for p in [(3, 3), (4, 3), (4, 4), (5, 4)] for v in case.at(numbering, *p)}
    assert len(island) == 1
    assert island != {int(v) for v in case.at(numbering, 6, 6)}
    # Unconnected corners of one point are still one value: ψ is continuous.
    assert len(np.unique(case.at(numbering, 6, 6))) == 1
    # Points on the walls are given; points of the island count once.
    # Samples of the island: 4, with the triangle (3, 3), (4, 3), (4, 4) all in contact; the first
    # halving adds the middle of its hypotenuse, the second those of its legs and of the last edge.
    merged = {0: 4, 1: 5, 2: 8}[halvings] - 1
    open_points = len(case.mesh.xy) - (case.mesh.top | case.mesh.bottom).sum()
    assert numbering.count == open_points - merged


def test_patch_across_the_seam_keeps_its_value_and_the_jump():
    """A patch on both sides of the seam: one unknown, ψ one higher above than below."""
    case = Topology((9, 9), [(4, 0), (4, 1), (4, 7)], periodic=True)
    numbering = case.dual()
    labels = {int(v) for j in (0, 1, 7, 8) for v in case.at(numbering, 4, j)}
    assert len(labels) == 1
    offset = {j: set(case.at(numbering, 4, j, "offset")) for j in (0, 1, 7, 8)}
    assert offset[0] == offset[1]
    assert offset[7] == offset[8]
    assert offset[8].pop() - offset[0].pop() == 1


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("contact", [[], [(2, 3), (3, 3), (3, 4), (4, 5)], line(0, 5, 2)])
def test_rows_of_the_matrix_have_room(periodic, contact):
    """Neighbours are never underrated, or the matrix would not hold them; nor are they overrated
    where each of them is one vertex and none is given, or there would be room for nothing."""
    case = Topology((7, 7), contact, periodic=periodic, halvings=2)
    vertex = case.mesh.twin[case.mesh.cells[case.cells.kept]]
    for numbering in (case.primal(), case.dual(), case.dual(merge_blocked=False)):
        number = numbering.of_corner
        room = numbering.neighbours(case.mesh.edges[1][case.cells.kept])
        assert len(room) == numbering.count
        for unknown in range(numbering.count):
            near = (number == unknown).any(axis=1)
            others = set(number[near].ravel().tolist()) - {unknown}
            assert room[unknown] >= len(others - {-1})
            if -1 not in others and len(np.unique(vertex[near])) == len(others) + 1:
                assert room[unknown] == len(others)
