"""Bounds of films from the flow through another one on the same mesh.

That they hold, and are of second order: tests/upscaling/test_patch_conductivity.py.
"""

import numpy as np
import pytest
from project import leak_rate
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.film.law import leak_rate_of_square
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.grid import GridField

UNIT = {"viscosity": 1.0, "pressure_drop": 1.0}


def film(values, sides="periodic"):
    return GridFilm(GridField(values, (1.0, 1.0), periodic=True), sides)


def solved(one):
    """Leak rate, and the flow on its last mesh."""
    flows = []
    leak = leak_rate(one, **UNIT, keep=flows.append)
    return leak, flows[-1]


def test_own_bounds():
    """For the film itself they are those of its last level."""
    one = film(rough_gap((32, 32), 0.2, seed=1, smooth=2).values)
    leak, flow = solved(one)
    unit = leak_rate_of_square(one.largest_gap, **UNIT)
    (above,), (below,) = flow.conductances_below([one]), flow.resistances_above([one])
    assert unit * above == pytest.approx(leak.upper, rel=1e-9)
    assert unit / below == pytest.approx(leak.lower, rel=1e-9)


def test_the_start_of_another_film_is_for_grids():
    """The gap of a shape is that of its own vertices: refused, with the argument to leave out."""
    _, flow = solved(film(np.ones((4, 4))))
    with pytest.raises(InvalidInput, match="VertexGap on a NestedMesh: leave out `start`"):
        flow.start.through(VertexGap(np.ones(4), 1.0, 0.0, 0.0))


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_uniform_gaps(sides):
    """The pressure of one uniform gap is that of all others: Q ~ g³ exactly."""
    gap = np.full((16, 16), 2.0)
    one = film(gap, sides)
    _, flow = solved(one)
    others = [one, film(0.5 * gap, sides), film(0.1 * gap, sides)]
    cubes = np.array([1, 0.5, 0.1]) ** 3
    length, width = one.size
    assert flow.conductances_below(others) * length / width == pytest.approx(cubes, rel=1e-11)
    larger = [one, film(2 * gap, sides), film(3 * gap, sides)]
    cubes = np.array([1, 2, 3]) ** -3.0
    assert flow.resistances_above(larger) * width / length == pytest.approx(cubes, rel=1e-11)
