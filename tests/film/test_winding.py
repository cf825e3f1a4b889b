"""The widest path around a periodic cell."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.film.winding import periodic_sites, widest_winding, winds
from fem_seal.grid import GridField


def test_a_slot_winds_along_one_axis_only():
    values = np.zeros((8, 10))
    values[:, 3:5] = np.linspace(1, 2, 8)[:, None]
    gap = GridField(values, (1.0, 1.0), periodic=True)
    for representation in ("linear", "constant"):
        assert widest_winding(gap, representation, axis=0) == 1.0
        assert widest_winding(gap, representation, axis=1) == 0.0


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_sites_wind_at_the_widest_gap_and_not_above_it(representation):
    values = np.random.default_rng(3).random((12, 14))
    gap = GridField(values, (1.0, 1.0), periodic=True)
    connectivity = {"linear": "triangulation", "constant": "4"}[representation]
    for axis in (0, 1):
        height = widest_winding(gap, representation, axis)
        assert winds(values >= height, connectivity, axis)
        assert not winds(values > height, connectivity, axis)


def test_every_point_is_one_site():
    values = np.random.default_rng(1).random((5, 6))
    gap = GridField(values, (1.0, 1.0), periodic=True)
    np.testing.assert_array_equal(periodic_sites(gap, "linear"), values)
    repeated = GridField(gap.vertices(), (1.0, 1.0))
    np.testing.assert_array_equal(periodic_sites(repeated, "linear"), values)
    with pytest.raises(InvalidInput, match="periodic in both directions"):
        periodic_sites(repeated, "constant")
