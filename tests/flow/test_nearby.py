"""Bounds of films from the flow through another one on the same mesh.

That they hold, and are of second order: tests/upscaling/test_patch_conductivity.py.
"""

import numpy as np
import pytest
from project import leak_rate
from sample_gaps import rough_gap

from fem_seal.film import GridFilm
from fem_seal.film.law import leak_rate_of_square
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
