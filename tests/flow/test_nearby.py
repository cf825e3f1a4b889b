"""Bounds of films from the flow through another one on the same mesh.

That they hold, and are of second order: tests/upscaling/test_patch_conductivity.py.
"""

from dataclasses import replace

import numpy as np
import pytest
from project import leak_rate
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.film.law import leak_rate_of_square
from fem_seal.grid import GridField

UNIT = {"viscosity": 1.0, "pressure_drop": 1.0}


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_multiples_of_a_gap(sides):
    """For the film itself the bounds are those of its last level; for multiples of its gap, whose
    pressure is the same, those times the cube."""
    values = rough_gap((32, 32), 0.2, seed=1, smooth=2).values
    values = np.where(values > 0, values + 0.03, 0.0)  # or the floor would raise the smallest

    def film(factor):
        return GridFilm(GridField(factor * values, (1.0, 1.0), periodic=True), sides)

    flows = []
    leak = leak_rate(film(1.0), **UNIT, keep=flows.append)
    unit = leak_rate_of_square(values.max(), **UNIT)
    for factor in (1.0, 0.5, 0.1):
        lower = flows[-1].conductances_below(film(factor))
        higher = flows[-1].resistances_above(film(1 / factor))
        cubes = np.array([1.0, factor]) ** 3
        assert unit * lower == pytest.approx(leak.upper * cubes, rel=1e-9)
        assert unit / higher == pytest.approx(leak.lower / cubes, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sides": "periodic"}, "need both linear on one grid"),
        ({"representation": "constant"}, "need both linear on one grid"),
        ({"gap": GridField(np.ones((5, 5)), (1.0, 2.0))}, "need both linear on one grid"),
        ({"gap": GridField(0.5 + np.eye(5), (1.0, 1.0))}, "gap is {} than .* at {} of 25 samples"),
    ],
)
def test_films_that_a_flow_does_not_bound(change, words):
    film, flows = GridFilm(GridField(np.ones((5, 5)), (1.0, 1.0))), []
    leak_rate(film, **UNIT, keep=flows.append)
    other = replace(film, **change)
    with pytest.raises(InvalidInput, match=words.format("smaller", 20)):
        flows[-1].resistances_above(other)
    with pytest.raises(InvalidInput, match=words.format("larger", 5)):
        flows[-1].conductances_below(other)
