"""The letter's cascade: coarse conductivities and pressures, and the error of its first guess."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from fem_seal.film import GridFilm
from fem_seal.finite_difference.cascade import (
    BLOCK_RTOL,
    coarse_grid,
    first_guess,
    grid_energy,
)
from fem_seal.finite_difference.elimination import conductance
from fem_seal.finite_difference.solver import by_differences
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.grid import GridField
from fem_seal.theory.bruggeman import effective_conductivity

# No absolute tolerance: pytest's default of 1e-12 would accept any film in SI units.
approx = partial(pytest.approx, rel=1e-12, abs=0.0)


def grid(values, sides="wall", representation="linear", spacing=(1.0, 1.0)):
    gap = GridField(values, spacing, periodic=True)
    return flow_grid(GridFilm(gap, sides, representation), 1 / 12, "linear-gap")


def wavy(n):
    """A gap without contact, two waves along each side of the cell, peak to valley 1 to 4."""
    x = 4 * np.pi * np.arange(n) / n
    return 1 + 0.4 * np.add.outer(np.cos(x), np.sin(x)) * np.cos(0.25 * x)[:, None] ** 2


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("block", [2, 4, 8])
def test_coarse_grids_cover_the_rectangle(sides, representation, block):
    """For blocks of any size, with 13 × 10 samples, of which none of them is a divisor."""
    fine = grid(np.ones((13, 10)), sides, representation, (2.0, 3.0))
    coarse = coarse_grid(fine, block)
    assert coarse.edges_x[[0, -1]] == approx([0, 26])
    assert np.ptp(coarse.edges_y) == approx(30)
    assert (np.diff(coarse.edges_x) > 0).all()
    # A uniform film conducts Ly/Lx on every grid; its blocks are bisected to BLOCK_RTOL.
    assert conductance(coarse.network()) == approx(30 / 26, rel=BLOCK_RTOL)


def test_coarse_conductivity_is_bruggemans_of_the_samples():
    g = np.random.default_rng(0).uniform(0, 1, (12, 12)) * (
        np.random.default_rng(1).random((12, 12)) > 0.2
    )
    coarse = coarse_grid(grid(g, representation="constant"), 4)
    block = (g[4:8, 8:12] / g.max()) ** 3
    assert coarse.conductivity[1, 2] == approx(
        effective_conductivity(block.ravel()), rel=BLOCK_RTOL
    )


def test_guess_of_a_uniform_film_is_the_exact_pressure():
    fine = grid(np.ones((32, 32)))
    exact = np.broadcast_to(1 - fine.nodes_x[:, None] / 32, fine.carrying.shape)
    # The coarse relaxations stop at 1e-6 of the energy, 1e-3 of the pressure.
    assert first_guess(fine) == approx(exact, abs=1e-3)


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_guess_improves_with_resolution(sides):
    """Bilinear interpolation: pressure to second order, hence the energy to fourth.

    32 samples a side have two levels below them, whose errors are not yet small: above third.
    """
    fine = [grid(wavy(n), sides) for n in (32, 64, 128)]
    excess = [
        grid_energy(g.network, first_guess(g), g.carrying) / conductance(g.network) - 1
        for g in fine
    ]
    order = np.log2([a / b for a, b in pairwise(excess)])
    assert (order > 3).all(), order


def test_energy_of_any_guess_exceeds_the_leak_rate():
    """Dirichlet's principle, with contact; the cascade is nearer than the uniform gradient.

    Relaxed from it, the energy loses in its steps what the guess has too much.
    """
    g = np.maximum(0, wavy(32) - 0.75)
    assert g.min() == 0
    fine = grid(g)
    uniform = np.broadcast_to(1 - fine.nodes_x[:, None] / fine.nodes_x[-1], fine.carrying.shape)
    far, near = (grid_energy(fine.network, p, fine.carrying) for p in (uniform, first_guess(fine)))
    assert far > near > conductance(fine.network)
    film = GridFilm(GridField(g, (1.0, 1.0), periodic=True), "wall")
    leak = by_differences(film, viscosity=1 / 12, pressure_drop=1.0, cascade=True)
    assert 1 + sum(leak.residuals["cascade"]) == approx(near / leak.value)


@pytest.mark.parametrize(("seed", "deviation"), [(5, 2), (32, 4), (0, 1)])
def test_relaxation_of_few_nodes_reaches_the_exact_pressure(seed, deviation):
    """A small grid is solved exactly before the error estimate has its first value."""
    log_K = deviation * np.random.default_rng(seed).normal(size=(4, 4))
    gap = GridField(np.cbrt(np.exp(log_K)), (0.25, 0.25))
    relaxed, eliminated = (
        by_differences(
            GridFilm(gap, sides="wall", representation="constant"),
            viscosity=1 / 12,
            pressure_drop=1.0,
            cascade=cascade,
        ).value
        for cascade in (True, False)
    )
    # Better than the tolerance 1e-8 of the relaxation: only rounding is left.
    assert relaxed == approx(eliminated)
