"""Seals of any shape: exact leak rates of rings, invariances, contact, walls, islands and cuts."""

import numpy as np
import pytest
from gaps import bracketed, solved_on
from hypothesis import given, settings
from hypothesis import strategies as st
from project import leak_rate, observed_orders
from sample_gaps import FLUID
from triangulations import (
    labelled,
    random_gap,
    ring,
    ring_parts,
    scattered_square,
    square_with_hole,
)

from fem_seal.film.mesh_film import MeshFilm
from fem_seal.flow import Tuning
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.flow.indicators import error_indicators
from fem_seal.flow.topology import dual_numbering, open_cells
from fem_seal.mesh.mesh import INLET, ISLAND, OUTLET
from fem_seal.mesh.shape import shape_mesh

ENERGY = 1e-8  # relative energy error at which CG stops


def bounds_on(gap: MeshFilm, unknowns: int = 1, energy: float = ENERGY) -> np.ndarray:
    """Lower and upper bound on the given mesh, or on its last uniform refinement."""
    flow = bracketed(gap, 1e-9, unknowns, method="uniform", tuning=Tuning(tolerance=energy))
    return np.array([flow.lower, flow.upper])


@pytest.mark.parametrize(
    ("gap", "exact", "order"),
    [
        # p depends on r alone: Q = Δp ∫g³dθ / ln(r_out/r_in); mean of (1 + a cos)³ = 1 + 3a²/2.
        (lambda r, t: 1 + 0.4 * np.cos(3 * t), 2 * np.pi / np.log(2) * (1 + 1.5 * 0.4**2), 2),
        # Q = 2πΔp / ∫dr/(r g³), g = r: the integral is (1 - 1/8)/3.
        (lambda r, t: r, 2 * np.pi / ((1 - 1 / 8) / 3), 2),
    ],
    ids=["waves around", "cone"],
)
def test_face_seal_with_a_gap_that_varies(gap, exact, order):
    """Estimate of polygons whose circles lie halfway: errors of gap, shape and flow are all h².

    A next term 2h times as large as the first shifts the order by (1/8)/ln 2, h = 1/8, 1/16.
    """
    errors = []
    for n in (1, 2, 4):
        mesh = ring(4 * n, 36 * n)
        x, y = mesh.xy.T
        lower, upper = bounds_on(MeshFilm(mesh, gap(np.hypot(x, y), np.arctan2(y, x))))
        errors.append([abs(lower - exact), abs(upper - exact)])
    assert observed_orders(errors)[-1] == pytest.approx([order] * 2, abs=1 / 8 / np.log(2)), errors
    assert np.array(errors)[-1].max() < 1e-2 * exact


def test_the_cut_may_lie_anywhere():
    """Vertices numbered from another angle put the cut elsewhere; the function stays the same."""
    found = []
    for start in (0, 5):
        mesh = ring(3, 15, turn=2 * np.pi * start / 15)
        angle = np.arctan2(*mesh.xy.T[::-1])
        gap = MeshFilm(mesh, 1 + 0.8 * np.cos(angle) * np.hypot(*mesh.xy.T) / 2)
        cut = mesh.xy[mesh.top & mesh.inlet]
        found.append((cut, bounds_on(gap, energy=1e-13)))
    assert np.linalg.norm(found[0][0] - found[1][0]) > 0.5
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-9)


def test_units_and_directions_do_not_matter():
    """In millimetres, turned and moved."""
    mesh = scattered_square(40, 7)
    gap = random_gap(mesh, 7, 0.2)
    reference = bounds_on(gap)
    moved = mesh.xy @ np.array([[0.6, 0.8], [-0.8, 0.6]]) * 1e-3 + (5, -7)
    changed = type(mesh)(moved, mesh.cells, mesh.sides, mesh.twin)
    # Shifted by 5000 lengths: nine of sixteen digits are left of the differences.
    assert bounds_on(MeshFilm(changed, gap.values)) == pytest.approx(reference, rel=1e-6)


@settings(max_examples=6)
@given(st.integers(0, 10**6), st.sampled_from(["ring", "square", "hole"]), st.floats(0, 0.5))
def test_random_gaps_with_contact_are_enclosed(seed, shape, contact):
    """Brackets on all meshes hold one number; sealed means so for triangles and for paths."""
    mesh = {
        "ring": lambda: ring(3, 10),
        "square": lambda: scattered_square(30, seed),
        "hole": lambda: square_with_hole(7, seed),
    }[shape]()
    gap = random_gap(mesh, seed, contact)
    problem = VertexGap(gap.values, 1.0, 0.0, 0.0)
    data = problem.cell_data(mesh, problem.vertex_values(mesh))
    kept, _ = open_cells(mesh, data)
    assert kept.any() == (gap.constriction is not None)
    if gap.constriction is None:
        assert leak_rate(gap, **FLUID).state == "sealed"
        return
    flow = bracketed(gap, 0.05, 700)
    assert max(level.lower for level in flow.levels) <= min(level.upper for level in flow.levels)
    assert flow.lower > 0
    # Power traces let every open path through at once: no patch bars the way.
    assert len(dual_numbering(mesh, data, kept, merge_blocked=True).basis) == 1


def on_arcs(n: int, inlet: tuple[float, float], outlet: tuple[float, float], inner: bool):
    """Ring of n corners; inlet and outlet are stretches of angle, on one circle or on both."""

    def label(p):
        turns = np.mod(np.arctan2(p[:, 1], p[:, 0]) / (2 * np.pi), 1)
        outside = np.hypot(*p.T) > 1.5
        into = (turns >= inlet[0]) & (turns < inlet[1]) & outside
        out = (turns >= outlet[0]) & (turns < outlet[1]) & (outside != inner)
        return np.select([into, out], [INLET, OUTLET], ISLAND)

    xy, cells, _ = ring_parts(3, n, 1.0, 2.0)
    return shape_mesh(*labelled(xy, cells, label))


@pytest.mark.parametrize("contact", [0.0, 0.2])
@pytest.mark.parametrize(
    ("outlet", "inner"),
    [((0.5, 0.8), False), ((0.5, 0.8), True), ((0.0, 1.0), True)],
    ids=["one circle", "arcs on two circles", "arc and circle"],
)
def test_inlet_and_outlet_on_any_stretch(outlet, inner, contact):
    """What is left of a circle is a side wall, or an island; Σ e_T = upper - lower needs both."""
    mesh = on_arcs(20, (0.1, 0.3), outlet, inner)
    assert mesh.periodic == inner
    gap = random_gap(mesh, 5, contact)
    represented = VertexGap(gap.values, 1.0, 0.0, 0.0)
    problem, pressure, stream = solved_on(represented, mesh, tolerance=1e-12)
    difference = pressure.energies.item() - stream.conductance
    shares = error_indicators(problem, problem.flows(pressure, stream))
    assert shares.sum() == pytest.approx(difference, abs=1e-9 * pressure.energies.item())
    lower, upper = bounds_on(gap, 3000)
    assert stream.conductance < lower < upper < pressure.energies.item()
    # Where a wall begins p goes as √r, and the energy's error as h: it halves with each mesh.
    assert upper - lower < difference / 2


def test_a_channel_once_around_the_ring_meets_the_cut():
    """A spiral of open vertices takes in every angle, so that it crosses the cut wherever that is:
    for the path, for the pressure and for the stream function. One vertex less and it is sealed."""
    nr, nt = 6, 12
    mesh = ring(nr, nt)
    i = np.rint((np.hypot(*mesh.xy.T) - 1) * nr).astype(int)
    j = np.rint(np.arctan2(mesh.xy[:, 1], mesh.xy[:, 0]) / (2 * np.pi / nt)).astype(int) % nt
    along = (j - 3 * i) % nt
    spiral = along <= 3
    gap = MeshFilm(mesh, spiral.astype(float))
    assert gap.constriction.gap == 1.0
    assert bracketed(gap, 0.18, 5000, method="uniform").converged
    cut_through = spiral & ~((i == 3) & (along == 1))
    assert MeshFilm(mesh, cut_through.astype(float)).constriction is None
