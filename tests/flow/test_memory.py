"""Memory of a leak rate with a hundred thousand unknowns, less that of libraries; its matrix."""

import numpy as np
from gaps import Random, level_problem, represented
from project import printed_by
from sample_gaps import rough_gap

MOST = 1.2e3  # bytes an unknown

MEASURED = """
import numpy as np
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.grid import GridField
from fem_seal.memory import peak_memory

def solve(n):
    x, y = np.meshgrid(*2 * [np.linspace(0, 1, n + 1)], indexing="ij")
    film = GridFilm(GridField(1 + 0.5 * np.sin(9 * x) * np.sin(7 * y), (1 / n, 1 / n)))
    seen = []
    settings = FlowSettings(1.0, 1.0, method="uniform", rtol=1)
    leak_rate(film, settings, progress=seen.append)
    return len(seen), seen[-1].unknowns

solve(16)
base = peak_memory()
levels, unknowns = solve(320)
print(levels, unknowns, peak_memory() - base)
"""


def test_memory_of_an_unknown():
    """A process of its own, whose peak is its own: the libraries and the compiled forms are there
    before the first measurement, the mesh and both solves come before the second."""
    levels, unknowns, needed = map(int, printed_by("-c", MEASURED).split())
    assert levels == 1
    assert unknowns == 321 * 319
    assert needed < MOST * unknowns


def test_rows_of_the_matrix_have_room_for_their_entries_alone():
    """Away from inlet and outlet an unknown is one vertex, and its neighbours are at its edges."""
    problem = level_problem(represented(rough_gap((8, 8), 0.0, 3)), markings=[Random(1)] * 3)
    mesh, numbering = problem.mesh, problem.primal_numbering
    ends, near = mesh.edges.ends, mesh.inlet | mesh.outlet
    near[ends[near[ends].any(axis=1)]] = True
    vertex, free = np.empty(numbering.count, dtype=int), numbering.of_corner >= 0
    vertex[numbering.of_corner[free]] = mesh.cells[free]
    room, degree = numbering.neighbours(), np.bincount(ends.ravel())[vertex]
    assert np.array_equal(room[~near[vertex]], degree[~near[vertex]])
    assert (~near[vertex]).sum() > 50
