"""The fluid's pressure on the samples of a contact, and the tangents of contact and flow."""

import re
from functools import partial

import numpy as np
import pytest
from lifted_scenes import problem_of, scene
from scipy import sparse

from fem_seal.coupling.multigrid import by_multigrid
from fem_seal.coupling.point import LiftPoint
from fem_seal.film import GridFilm
from fem_seal.finite_difference.solver import by_differences
from fem_seal.grid import GridField
from fem_seal.network.film_pressure import PRESSURE_TOLERANCE, FilmPressure, eliminated
from fem_seal.network.network import Network
from fem_seal.progress import NOTE

SHAPE = 16, 24
SOLVED = 1e4 * np.finfo(float).eps  # condition of the matrix times the rounding
FILMS = [(sides, kind) for sides in ("wall", "periodic") for kind in ("linear", "constant")]


def film_of(values, sides, representation, spacing=(1.0, 2.0)):
    return GridFilm(GridField(values, spacing, periodic=True), sides, representation)


def rough(seed=0):
    return 0.1 + np.random.default_rng(seed).random(SHAPE)


def uniform(film, halvings):
    """A network of triangles 2^-halvings samples wide."""
    network = Network.uniform(film, 2 ** max(-halvings, 0))
    for _ in range(halvings):
        every = np.ones(len(network.legs), dtype=bool)
        alike = np.ones(len(network.weight))
        network = network.refined(alike, 1.0, alike, every)
    return network


def pressure_in(film, network, values, solver=eliminated):
    network = uniform(film, network) if isinstance(network, int) else network
    return FilmPressure(network, values, np.ones(SHAPE), solver)


def mixed(film):
    """A network of triangles of many widths, from two pixels down to a small part of one."""
    rng, network = np.random.default_rng(3), uniform(film, -1)
    for _ in range(3):
        alike = np.ones(len(network.weight))
        network = network.refined(rng.random(len(network.weight)) ** 8, 0.5, alike)
    return network


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_network_of_finite_differences(sides):
    """The same leak rate as by the elimination, which shares no arithmetic."""
    film = film_of(rough(), sides, "linear")
    leak = by_differences(film, viscosity=1 / 12, pressure_drop=1.0)
    assert pressure_in(film, 0, rough()).conductance == pytest.approx(leak.value, rel=SOLVED)


@pytest.mark.parametrize("make", [-2, -1, 0, 1, 2, mixed])
@pytest.mark.parametrize(("sides", "representation"), FILMS)
def test_uniform_film(sides, representation, make):
    """u falls evenly from 1 at the first vertex, or half a pixel before the first centre."""
    film = film_of(np.ones(SHAPE), sides, representation, (1.0, 2.0))
    first = 0.0 if representation == "linear" else 0.5
    exact = 1 - (np.arange(SHAPE[0]) + first) / SHAPE[0]
    network = make if isinstance(make, int) else make(film)
    assert make is not mixed or len(np.unique(network.weight)) > 1  # or nothing is mixed
    u = pressure_in(film, network, np.ones(SHAPE)).on_samples
    np.testing.assert_allclose(u, np.broadcast_to(exact[:, None], SHAPE), atol=1e-13)


def gate(spacing):
    """A wall with a gate one sample wide: most of the mean pressure's error is made there.

    Returns the film, and a function that solves on a network: mean pressure, what links change of
    it, and how much the gap varies along them.
    """
    gap = np.full(SHAPE, 0.5)
    gap[5] = 1e-3
    gap[5, 7] = 0.5
    film = film_of(gap, "periodic", "linear", spacing)

    def solved(network):
        flow = pressure_in(film, network, gap)
        return flow.on_samples.mean(), flow.by_parts(np.ones(SHAPE), 1e-6)[0], flow.varies

    return film, solved


@pytest.mark.parametrize("spacing", [(1.0, 1.0), (1.0, 0.5)])
def test_smaller_triangles_where_they_matter(spacing):
    """Three refinements near the gate come closer to the limit than one of the whole patch, which
    has more nodes."""
    film, solved = gate(spacing)
    local = uniform(film, 0)
    for _ in range(3):
        _, by_links, varies = solved(local)
        local = local.refined(by_links, 0.9, varies)
    whole, exact = uniform(film, 1), solved(uniform(film, 3))[0]
    assert abs(solved(local)[0] - exact) < abs(solved(whole)[0] - exact)
    assert local.free.sum() < whole.free.sum()


def test_a_channel_along_diagonals_is_found():
    """Each leg beside it has an end in contact, so that no link shows it.

    Beside a straight channel, whose links conduct, only its own triangles tell of it. Halved there,
    the network conducts as both channels alone do, for contact conducts ε² of a link, a millionth.
    """
    n, rows = 8, np.arange(8)
    diagonal, straight = np.full((2, n, n), 1e-3)
    diagonal[rows, rows % 2] = 1.0
    straight[:, 5] = np.where(rows % 2, 1.0, 0.3)

    def halved(gap, found):
        film = film_of(gap, "periodic", "linear", (1.0, 1.0))
        network = uniform(film, 0)
        flow = FilmPressure(network, gap, np.ones((n, n)), eliminated)
        by_links, past_legs = flow.by_parts(np.ones((n, n)), 1e-12)
        also = past_legs > 1e-3 * past_legs.max()
        network = network.refined(by_links, 0.9, flow.varies, also if found else None)
        return FilmPressure(network, gap, np.ones((n, n)), eliminated).conductance

    both, alone = np.maximum(diagonal, straight), halved(straight, found=False)
    assert halved(both, found=False) == pytest.approx(alone, rel=1e-3)
    whole = alone + halved(diagonal, found=True)
    assert halved(both, found=True) == pytest.approx(whole, rel=1e-3)
    assert whole > 3 * alone  # or nothing is shown


@pytest.mark.parametrize(("sides", "representation"), FILMS)
def test_tangent_of_the_flow(sides, representation):
    """Central differences, and the transpose to rounding.

    The differences err by the square of the relative step, 1e-5 over gaps of 0.1 and more: 1e-8.
    """
    film, rng = film_of(rough(), sides, representation), np.random.default_rng(1)
    change, weight = rng.standard_normal((2, *SHAPE))
    network, step = mixed(film), 1e-5
    flow = pressure_in(film, network, rough())
    up, down = (pressure_in(film, network, rough() + sign * step * change) for sign in (1, -1))
    tangent = flow.change(change, 1e-12)
    np.testing.assert_allclose(tangent, (up.on_samples - down.on_samples) / (2 * step), atol=1e-8)
    back = flow.transposed(weight, 1e-12)
    assert np.vdot(weight, tangent) == pytest.approx(np.vdot(back, change), rel=1e-11)
    log_rate = np.log(up.conductance / down.conductance) / (2 * step)
    assert np.vdot(flow.log_rate_by_gap, change) == pytest.approx(log_rate, rel=1e-8)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("seed", range(3))
def test_obtuse_triangles_dissipate(seed, representation):
    """Σ C Δu² > 0 of any pressure u, although links on long sides conduct less than nothing.

    Gaps over two decades; pixels three times as wide as long, whose obtuse angles are 143°.
    Rounding errs by 1e-16 of the largest conductance, far below the smallest one.
    """
    gap = 10.0 ** np.random.default_rng(seed).uniform(-2, 0, SHAPE)
    film = film_of(gap, "periodic", representation, (1.0, 3.0))
    network = mixed(film)
    links = network.conductances(network.to_places @ gap.ravel())
    assert links.min() < 0  # or nothing is shown
    (a, b), nodes = network.ends, len(network.free)
    at_ends = np.eye(nodes)[a] - np.eye(nodes)[b]
    matrix = (at_ends.T @ (links[:, None] * at_ends))[np.ix_(network.free, network.free)]
    assert np.linalg.eigvalsh(matrix).min() > 0


@pytest.mark.parametrize("least", [1e-4, 1e-8])
def test_multigrid_solves_what_elimination_does(least):
    """Next to closing as well: gaps up to 1, conductances over twelve decades.

    The residual is about the error, and it is told. So is a breakdown, over twice as many decades:
    elimination then gives the digits of elimination.
    """
    values, told = np.maximum(np.random.default_rng(2).random(SHAPE) - 0.5, least), []
    film = film_of(values, "periodic", "linear")
    telling = partial(by_multigrid, report=lambda stage, detail: told.append(detail))
    exact, u = (pressure_in(film, 1, values, one).on_samples for one in (eliminated, telling))
    if least == 1e-8:
        assert np.array_equal(u, exact)
        assert "elimination" in told[0]
        return
    assert np.sqrt(np.mean((u - exact) ** 2)) < 10 * PRESSURE_TOLERANCE
    (words,) = told
    assert float(re.search(r"\d+ iterations to (\S+)$", words)[1]) <= PRESSURE_TOLERANCE


# Parts of a right side that the solves leave: the offset at a held mean gap is found to 1e-6.
@pytest.mark.parametrize(("mean_gap", "left"), [(None, 1e-10), (2.5e-7, 1e-6), (3e-6, 1e-10)])
def test_tangent_of_the_contact(mean_gap, left):
    """Central differences of contacts whose samples stay as they are, and symmetry.

    At a mean gap of 3 µm no sample touches.

    The contacts are solved to a certificate of 1e-12, so that their gaps are known to 1e-6 of the
    rms height or so; the change is a hundredth of it, and its derivative known to 1e-4.
    """
    contact = {"mean_gap": mean_gap} if mean_gap else {"pressure": 1.5e5}
    problem = problem_of(scene(contact={**contact, "tolerance": 1e-12}))
    x = np.arange(32) / 32
    pressure = 3e4 * (1 - x)[:, None] + np.zeros((32, 32))
    change = np.cos(2 * np.pi * (x[:, None] + 2 * x))
    state = problem.contact_under(pressure)
    gap_change = LiftPoint(problem, problem.first_network, 0.0, pressure, state).gap_change
    moved = gap_change(change, 1e-10)
    step = 20.0  # Pa
    up, down = (problem.contact_under(pressure + sign * step * change) for sign in (1, -1))
    np.testing.assert_array_equal(up.contact, down.contact)  # or there is no derivative
    exact = (up.gap.values - down.gap.values) / (2 * step)
    np.testing.assert_allclose(moved, exact, atol=1e-4 * np.abs(exact).max())
    other = np.sin(2 * np.pi * (3 * x[:, None] - x))
    back = gap_change(other, 1e-10)
    # With M x = v - r and M y = w - s: <w, x> - <y, v> = <s, x> - <y, r>.
    norms = (np.linalg.norm(a) * np.linalg.norm(b) for a, b in ((other, moved), (back, change)))
    assert abs(np.vdot(other, moved) - np.vdot(back, change)) <= left * sum(norms)


def test_after_a_breakdown_the_factors_are_kept(monkeypatch):
    """CG breaks down on an indefinite matrix; its elimination is made once, and said once."""
    made, said = [], []

    def counted(matrix):
        made.append(matrix)
        return eliminated(matrix)

    matrix = sparse.csr_array(np.array([[1.0, 2.0], [2.0, 1.0]]))
    monkeypatch.setattr("fem_seal.coupling.multigrid.eliminated", counted)
    solve = by_multigrid(matrix, lambda stage, detail: said.append(stage))
    for right_side in np.eye(2):
        np.testing.assert_allclose(matrix @ solve(right_side, 1e-9), right_side, atol=1e-12)
    assert len(made) == said.count(NOTE) == 1
