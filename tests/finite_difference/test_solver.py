"""Leak rates by finite differences against exact solutions, with the order of convergence."""

from functools import partial

import numpy as np
import pytest
from drawn_stripes import Case
from project import observed_orders

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.finite_difference.links import LINKS
from fem_seal.finite_difference.slipping import node_pressure
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.grid import GridField

approx = partial(pytest.approx, rel=1e-12)

FLUID = {"viscosity": 1 / 12, "pressure_drop": 1.0}  # so that K = g³
SIDES = ("wall", "periodic")
RULES = tuple(LINKS)
SOLVED = 1e4 * np.finfo(float).eps  # condition of the sparse system times the rounding


def leak(values, spacing=(1.0, 1.0), periodic=False, link_rule="linear-gap", **choices):
    film = GridFilm(GridField(values, spacing, periodic), **choices)
    return by_differences(film, link_rule=link_rule, **FLUID).value


@pytest.mark.parametrize(
    ("sides", "representation", "link_rule"),
    [*((sides, "linear", "linear-gap") for sides in SIDES), ("wall", "constant", "harmonic")],
)
def test_layers_in_series_are_exact(sides, representation, link_rule):
    """The closed form of the linear gap, and that of steps, half cells at the ends included."""
    g = np.random.default_rng(0).uniform(0.1, 1, 20)
    case = Case("across", g, 7, (2.0, 0.5), sides, representation, "finite-difference")
    read = {"sides": sides, "representation": representation}
    found = leak(case.values, case.spacing, sides == "periodic", link_rule, **read)
    assert found == approx(case.exact, rel=1e-13)


def checkerboard_errors(link_rule, sides):
    """Errors for K = exp(A cos 2πx cos 2πy), which conducts exactly like K = 1.

    That is the Keller-Dykhne duality: a shift by half a period turns K into 1/K. Inlet and outlet
    are lines of mirror symmetry, hence isobars of the periodic medium.
    """
    A, errors = 4.0, []
    for n in (32, 64, 128):
        c = np.cos(2 * np.pi * np.arange(n + 1) / n)
        c[-1] = c[0]
        g = np.exp(A * np.outer(c, c) / 3)
        errors.append(abs(leak(g, (1 / n, 1 / n), sides=sides, link_rule=link_rule) - 1))
    return errors


@pytest.mark.parametrize(
    ("link_rule", "sides", "order"),
    [*((rule, "wall", 2) for rule in RULES if rule != "geometric"), ("linear-gap", "periodic", 2)],
)
def test_order_on_the_smooth_checkerboard(link_rule, sides, order):
    """What follows the first term of the error is of the order of h² = (2π/64)², 1 % of it."""
    assert observed_orders(checkerboard_errors(link_rule, sides))[-1] == approx(order, abs=0.02)


@pytest.mark.parametrize("sides", SIDES)
def test_geometric_links_are_exact_on_the_smooth_checkerboard(sides):
    """ln c = A cos(π/n) cos 2πx cos 2πy at the middle of a link: the network is its own dual."""
    assert max(checkerboard_errors("geometric", sides)) < 1e-12


def test_channel_along_a_diagonal_is_reported_as_not_converged():
    """A gap open along a diagonal only is not sealed, but no chain of links joins the ends."""
    flow = by_differences(GridFilm(GridField(np.eye(5), (1, 1)), sides="wall"), **FLUID)
    assert flow.state == "leaking"
    assert not flow.converged
    assert "diagonal" in flow.reason


@pytest.mark.parametrize("link_rule", RULES)
def test_contact_points_carry_no_flow(link_rule):
    """A contact sample cuts one of two columns; the mean of g³ across it need not be zero."""
    g = np.zeros((7, 5))
    g[:, 0] = g[:, 2] = 1
    g[3, 2] = 0
    assert leak(g, representation="constant", link_rule=link_rule) == approx(1 / 7, rel=1e-13)


def test_a_single_row_of_samples_is_a_linear_gap_where_it_repeats():
    assert leak(np.ones((1, 7)), periodic=True) == approx(7, rel=1e-13)


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_node_pressure_balances_the_conductance(sides, representation):
    """Power Σ c (Δp)² of the sparse solve is Q Δp by the elimination, which shares no arithmetic.

    So is what flows out of the inlet's nodes. Nodes that no chain of links joins to both ends have
    no pressure.
    """
    rng = np.random.default_rng(5)
    values = np.maximum(rng.random((16, 16)) - 0.3, 0)
    film = GridFilm(GridField(values, (1.0, 1.0), periodic=True), sides, representation)
    leak = by_differences(film, viscosity=1 / 12, pressure_drop=3.0)
    assert leak.value > 0
    grid = flow_grid(film, 1 / 12, "linear-gap")
    pressure = 3.0 * node_pressure(film)
    if film.sites.seam:
        pressure = pressure[:, :-1]
    if representation == "constant":  # both ends are nodes of their own
        pressure = np.pad(pressure, ((1, 1), (0, 0)), constant_values=((3.0, 0.0), (0, 0)))
    inner = slice(1, -1)
    np.testing.assert_array_equal(np.isnan(pressure[inner]), ~grid.carrying[inner])
    p, joined = pressure.ravel(), grid.carrying.ravel()
    one, other, conductance = grid.stencil.links()
    kept = joined[one] & joined[other] & (conductance > 0)
    drop = (p[one] - p[other])[kept]
    flow = conductance[kept] * drop
    assert (flow * drop).sum() == approx(3.0 * leak.value, rel=SOLVED)
    assert flow[one[kept] < pressure.shape[1]].sum() == approx(leak.value, rel=SOLVED)
