"""Pieces of the gap that do not join inlet and outlet: no flow, and no part in any bound."""

import numpy as np
import pytest
from project import leak_rate
from sample_gaps import FLUID

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.grid import GridField


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_pockets_beside_a_channel(representation, sides):
    """In squares of 16 samples, most of which hold a piece of both: no level knows of the pocket.
    1e-7: two solves of one problem, 1e-8 each."""
    n = 65 if representation == "linear" else 64
    samples = np.zeros((n, n))
    samples[:, 20:26] = 1
    holed = samples.copy()
    holed[8:56, 28:34] = 0.8
    films = [GridFilm(GridField(v, (1.0, 1.0)), sides, representation) for v in (samples, holed)]
    first, second = (
        leak_rate(film, rtol=0.1, tuning=Tuning(coarsest=4), **FLUID) for film in films
    )
    assert [level.unknowns for level in first.levels] == [level.unknowns for level in second.levels]
    for one, other in zip(first.levels, second.levels, strict=True):
        assert one.upper == pytest.approx(other.upper, rel=1e-7, abs=0)
        assert one.lower == pytest.approx(other.lower, rel=1e-7, abs=0)
