"""Coarser grids start light contacts: the same state, with less work."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, SOLID, energy_distance, pressed, rough_surface

from fem_seal.contact import ContactStopping, Load, press
from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import USUAL_STOPPING
from fem_seal.contact.solve import ROUGHLY, coarse_start
from fem_seal.grid import GridField
from fem_seal.surface import rms_height


@pytest.mark.parametrize("load", [0.001, 0.01])
def test_same_contact_with_less_work(load):
    """The area of a state is known to about its certificate: 1e-6 of 256² samples, less than one.

    The start saves a third of the pairs at 1 % of contact and a tenth at 5 %
    (docs/measurements/contact.md); here it is 0.2 and 2 %.
    """
    height = rough_surface((256, 256), short=8, long=64)
    cascaded = pressed(height, load)
    uniform = pressed(height, load, start=np.ones(height.shape))
    assert np.count_nonzero(cascaded.contact != uniform.contact) <= 1
    assert cascaded.fft_pairs < 0.9 * uniform.fft_pairs


def test_start_is_near_and_counted():
    """The certificate bounds the energy above the least [rms height times pressure], on the coarse
    grid, and on the fine one but for the heights left out, few at 8 samples in the shortest wave.

    A uniform pressure lies further off. Pairs on a quarter of the samples count as quarters.
    """
    height = rough_surface((256, 256), short=8)
    pair = ContactPair(height, SOLID)
    pressure = 0.005 * E_STAR * SLOPE
    start = coarse_start(pair, pressure, USUAL_STOPPING)
    assert start.mean() == pytest.approx(pressure, rel=1e-12)
    exact = press(height, SOLID, Load("pressure", pressure)).pressure
    near, uniform = (
        energy_distance(GridField(p, height.spacing, periodic=True), exact)
        for p in (start, np.full(height.shape, pressure))
    )
    assert near < ROUGHLY * rms_height(height) * pressure < uniform
    means = height.values.reshape(128, 2, 128, 2).mean(axis=(1, 3))
    coarse = ContactPair(GridField(means, (2e-6, 2e-6), periodic=True), SOLID)
    coarse.under_pressure(pressure, ContactStopping(tolerance=ROUGHLY, gap_tolerance=np.inf))
    assert pair.half_space.fft_pairs == coarse.half_space.fft_pairs / 4


@pytest.mark.parametrize(
    ("shape", "load", "most"),
    [
        ((256, 256), 0.2, None),
        ((64, 64), 0.001, None),
        ((129, 128), 0.001, None),
        ((256, 256), 0.001, 1),
    ],
)
def test_none_where_it_does_not_pay(shape, load, most):
    """Nor where it does not converge in as many iterations as the contact may have."""
    pair = ContactPair(rough_surface(shape), SOLID)
    stopping = ContactStopping(max_iterations=most)
    assert coarse_start(pair, load * E_STAR * SLOPE, stopping) is None
