"""Bubbles at the middles of edges: they lower an energy as far as admissible functions can."""

import numpy as np
import pytest
from brute_force import least_energy, stiffness
from gaps import Random, everything, level_problem, meshed, plain_bounds, represented, solved
from sample_gaps import rough_gap

from fem_seal.flow import hierarchical
from fem_seal.flow.hierarchical import bubble_edges
from fem_seal.grid import GridField
from fem_seal.mesh.mesh import ends_of_sides
from fem_seal.mesh.nested import DEPTH


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("width", [1, 2, 4])
@pytest.mark.parametrize("spacing", [(1.0, 1.0), (1.0, 7.0)])
def test_one_square_has_three_bubbles(representation, width, spacing):
    """Pressure and stream function are given at all four corners of one square: the bubbles on its
    diagonal and on the two sides where nothing is given are the only unknowns of the mesh of
    quarters. CG finds three unknowns in three steps. Squares of 1, 4 and 16 pixels."""
    shape = (width + 1, width + 1) if representation == "linear" else (width, width)
    samples = np.random.default_rng(width).uniform(0.2, 1, shape)
    gap = represented(GridField(samples, spacing), representation, width=width)
    problem = level_problem(gap, width)
    assert problem.unknowns == 0
    quarters = level_problem(gap, width, tolerance=1e-14, markings=[everything] * 2)
    assert quarters.unknowns == 3
    found = problem.corrected(*solved(problem)).numbers
    # Widened against rounding by 1e-12 of the energies before the bubbles, at most ten times
    # larger.
    assert found == pytest.approx(plain_bounds(quarters), rel=1e-11)
    if representation == "constant" and width == 1:
        return  # a uniform gap, solved by the coarse mesh
    plain = plain_bounds(problem)
    # Not nothing: a thousand times what rounding may do.
    assert plain[0] * (1 + 1e-9) < found[0] < found[1] < plain[1] * (1 - 1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_minima_and_best_bubbles_against_a_direct_solver(seed, monkeypatch):
    """CG is within 2e-8 of both minima. With many steps the bubbles reach the minimum on the mesh
    of quarters, the values at the old vertices kept: CG with the diagonal gains a digit in two
    steps, and the energies are of order one."""
    samples = np.random.default_rng(seed).uniform(0.2, 1, (7, 6))
    gap = represented(GridField(samples, (1.0, 1.0)))
    ragged, nothing = level_problem(gap, markings=[Random(seed)] * 4), np.empty(0)
    assert plain_bounds(ragged) == pytest.approx(least(ragged, nothing, nothing), rel=4e-8)
    coarse, fine = (level_problem(gap, markings=[everything] * halvings) for halvings in (2, 4))
    pressure, stream = solved(coarse)
    p = np.empty(len(coarse.mesh.xy))
    (p[coarse.mesh.cells],) = pressure.of_unit_jumps()
    monkeypatch.setattr(hierarchical, "STEPS", 40)
    found = coarse.corrected(pressure, stream).numbers
    assert found == pytest.approx(least(fine, p, stream.psi[0]), rel=1e-11)


def least(problem, p, psi) -> list[float]:
    """Lower and upper bound by a direct solver; p and ψ are given at the first vertices."""
    mesh, g = problem.mesh, problem.vertex_gap[problem.mesh.cells]
    local, vertices = stiffness(mesh.corners(1.0, mesh.cells)), np.arange(len(mesh.xy))
    # Mean of g³ by the seven-point rule that is exact for cubics.
    middles = (g[:, [0, 1, 2]] + g[:, [1, 2, 0]]) / 2
    cube = (8 * (middles**3).sum(1) + 3 * (g**3).sum(1) + 27 * g.mean(1) ** 3) / 60
    energies = []
    for coefficient, coarse, given, value in (
        (1 / g.prod(1), psi, mesh.bottom | mesh.top, mesh.top),
        (cube, p, mesh.inlet | mesh.outlet, mesh.inlet),
    ):
        v, prescribed = value.astype(float), given.copy()
        v[: len(coarse)], prescribed[: len(coarse)] = coarse, True
        weighted = local * coefficient[:, None, None]
        energies.append(least_energy(weighted, mesh.cells, vertices, v, prescribed))
    return [1 / energies[0], energies[1]]


@pytest.mark.parametrize("contact", [0.0, 0.3])
def test_every_step_lowers_the_energies(contact, monkeypatch):
    """CG goes down from step to step; those that are taken must do nearly all there is to do."""
    problem = level_problem(represented(rough_gap((12, 12), contact, 8)), markings=[Random(2)] * 3)
    found = solved(problem)
    bounds = []
    for steps in (0, 1, 2, 3, hierarchical.STEPS, 40):
        monkeypatch.setattr(hierarchical, "STEPS", steps)
        bounds.append(problem.corrected(*found).numbers)
    lower, upper = np.transpose(bounds)
    assert (np.diff(lower) > 0).all()
    assert (np.diff(upper) < 0).all()
    assert [lower[0], upper[0]] == pytest.approx(plain_bounds(problem), rel=1e-7)
    # On square pixels energies of neighbouring bubbles overlap by at most a half, so that CG gains
    # a factor of three a step or more: of what 40 steps find, 4 miss no more than 3^-4.
    assert lower[-1] - lower[-2] < 3**-4 * (lower[-1] - lower[0])
    assert upper[-2] - upper[-1] < 3**-4 * (upper[0] - upper[-1])


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize(("size", "contact", "width"), [(12, 0.0, 1), (12, 0.3, 1), (64, 0.004, 8)])
def test_corrected_bounds(representation, periodic, size, contact, width):
    """All cells halved twice, and those that must follow: bubbles on the middles of edges are among
    the functions of that mesh, so that the corrected bounds lie between those of the two meshes.
    On squares eight pixels wide both meshes are above the pixel, where a cell with contact in it is
    closed, and no bubble may stand on one. (On pixels with contact the power traces are not nested,
    and only the side towards the coarse mesh is certain for the lower bound.) CG errs by 2e-8."""
    rough = rough_gap((size, size), contact, 8, smooth=2 if width > 1 else 1)
    gap = represented(rough, representation, width=width)
    markings = [Random(2)] * 3 if width == 1 else []
    problem = level_problem(gap, width, periodic, 1e-8, markings)
    pressure, stream = solved(problem)
    lower, upper = problem.corrected(pressure, stream).numbers
    fine = plain_bounds(
        level_problem(gap, width, periodic, 1e-8, [*markings, everything, everything])
    )
    assert fine[1] * (1 - 4e-8) <= upper < pressure.energies.item()
    assert stream.conductance < lower < upper
    if not contact or representation == "constant" or width > 1:
        assert lower <= fine[0] * (1 + 4e-8)
    if width > 1:
        # On a blocked cell ψ is constant. A bubble there costs nothing where its quarters are
        # closed, and would lower the energy below that of any admissible function.
        blocked = problem.data.blocked
        assert 0 < blocked.sum() < len(blocked) / 2
        edge, (for_psi, _) = bubble_edges(problem.mesh, problem.data, problem.kept)
        assert problem.kept.all()
        assert not for_psi[edge[blocked]].any()
        assert for_psi.any()


# --- cells are summed batch by batch: the bounds must not depend on where a batch ends -----------


@pytest.mark.parametrize(("representation", "periodic"), [("linear", True), ("constant", False)])
def test_bubbles_in_small_batches(representation, periodic, monkeypatch):
    """The cells of an edge belong to one bubble, in whatever batch they are: apart, each would
    have a bubble of its own, the pressure could jump and the bounds would cross the truth. The
    same sums in another order: 1e-12. Contact lines part bubbles of their own."""
    gap = represented(rough_gap((8, 8), 0.3, 8), representation)
    markings = [lambda mesh: mesh.cells[:, 0] % 3 == 0] * 3
    problem = level_problem(gap, 1, periodic, markings=markings)
    found = solved(problem)
    whole = problem.corrected(*found).numbers
    monkeypatch.setattr(hierarchical, "QUARTERED_AT_ONCE", 3)
    assert problem.corrected(*found).numbers == pytest.approx(whole, rel=1e-12)


def test_bubbles_in_small_blocks(monkeypatch):
    """No bubble stands on the rim of a block: with as many steps as it takes, fewer bubbles find
    no lower energies, as they would if the halves of one were free of each other, but the energies
    of admissible functions. The sums differ in order: 1e-12."""
    markings = [lambda mesh: mesh.cells[:, 0] % 3 == 0] * 3
    problem = level_problem(represented(rough_gap((8, 8), 0.3, 8)), 1, True, 1e-8, markings)
    found = solved(problem)
    assert 300 < len(problem.mesh.cells) < 600
    monkeypatch.setattr(hierarchical, "STEPS", 40)
    whole = problem.corrected(*found).numbers
    for block in (1, 50, 300):
        monkeypatch.setattr(hierarchical, "BLOCK", block)
        lower, upper = problem.corrected(*found).numbers
        assert 1 / found[1].upper_bound().item() <= lower < whole[0] * (1 + 1e-12)
        assert whole[1] * (1 - 1e-12) < upper <= found[0].upper_bound().item()
    # Two blocks, and a small part of the bubbles between them.
    assert lower > (found[1].conductance + whole[0]) / 2
    assert upper < (found[0].energies.item() + whole[1]) / 2


# --- what a bubble stands on ---------------------------------------------------------------------


def at_the_origin(mesh):
    return (mesh.xy[mesh.cells] == 0).all(axis=2).any(axis=1)


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_no_bubbles_where_quarters_cannot_be_represented(representation):
    """Where the integer coordinates end a side may have no midpoint: no bubbles on such cells."""
    samples = np.ones((3, 3)) if representation == "linear" else np.ones((2, 2))
    gap = represented(GridField(samples, (1.0, 1.0)), representation)
    mesh, values = meshed(gap, markings=[at_the_origin] * 2 * DEPTH)
    data = gap.cell_data(mesh, values)
    kept = np.ones(len(mesh.cells), dtype=bool)
    odd = (mesh.xy[ends_of_sides(mesh.cells)].sum(axis=2) % 2).any(axis=2)
    assert odd.any()
    edge, free = bubble_edges(mesh, data, kept)
    assert not free[:, edge[odd.any(axis=1)]].any()
    assert free.any(axis=1).all()
