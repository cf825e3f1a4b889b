"""Bounds of films from the flow through another one on the same mesh.

That they hold, and are of second order: tests/upscaling/test_patch_conductivity.py.
"""

import numpy as np
import pytest
from project import leak_rate
from sample_gaps import rough_gap
from triangulations import ring

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.film.law import leak_rate_of_square
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.grid import GridField

UNIT = {"viscosity": 1.0, "pressure_drop": 1.0}


def film(values, sides="periodic"):
    return GridFilm(GridField(values, (1.0, 1.0), periodic=True), sides)


def flow_through(one):
    """Leak rate, and the flow on its last mesh."""
    flows = []
    leak = leak_rate(one, **UNIT, keep=flows.append)
    return leak, flows[-1]


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_multiples_of_a_gap(sides):
    """For the film itself the bounds are those of its last level; for multiples of its gap, whose
    pressure is the same, those times the cube."""
    values = rough_gap((32, 32), 0.2, seed=1, smooth=2).values
    values = np.where(values > 0, values + 0.03, 0.0)  # or the floor would raise the smallest
    leak, flow = flow_through(film(values, sides))
    unit = leak_rate_of_square(values.max(), **UNIT)
    for factor in (1.0, 0.5, 0.1):
        lower = flow.conductances_below(film(factor * values, sides))
        higher = flow.resistances_above(film(values / factor, sides))
        cubes = np.array([1.0, factor]) ** 3
        assert unit * lower == pytest.approx(leak.upper * cubes, rel=1e-9)
        assert unit / higher == pytest.approx(leak.lower / cubes, rel=1e-9)


def test_the_start_of_another_film_is_for_grids():
    """The gap of a shape is that of its own vertices: refused, with the argument to leave out."""
    _, flow = flow_through(film(np.ones((4, 4))))
    with pytest.raises(InvalidInput, match="VertexGap on a NestedMesh: leave out `start`"):
        flow.start.through(VertexGap(np.ones(4), 1.0, 0.0, 0.0))
    with pytest.raises(InvalidInput, match="'adaptive': leave out `start`"):
        leak_rate(flow.film, **UNIT, method="uniform", start=flow.start)
    mesh = ring(1, 8)
    with pytest.raises(InvalidInput, match="on a grid alone: leave out `keep`"):
        leak_rate(MeshFilm(mesh, np.ones(len(mesh.xy))), **UNIT, keep=print)
