"""Coarser grids start light contacts: the same state, with less work."""

import numpy as np
import pytest
from contact_cases import E_STAR, SLOPE, rough_surface

from fem_seal.contact import press
from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.settings import ElasticSolid
from fem_seal.contact.solve import coarse_start


@pytest.mark.parametrize("load", [0.001, 0.01])
def test_same_contact_with_less_work(load):
    height = rough_surface((256, 256), short=8, long=64)
    pressure = load * E_STAR * SLOPE
    cascaded = press(height, E_STAR, pressure=pressure)
    uniform = press(height, E_STAR, pressure=pressure, start=np.ones(height.shape))
    assert np.count_nonzero(cascaded.contact != uniform.contact) <= 1
    assert cascaded.fft_pairs < 0.9 * uniform.fft_pairs


def test_start_is_near_and_counted():
    pair = ContactPair.prepared(rough_surface((256, 512), short=8), ElasticSolid(E_STAR))
    pressure = 0.005 * E_STAR * SLOPE
    start = coarse_start(pair, pressure)
    assert start.mean() == pytest.approx(pressure, rel=1e-12)
    assert 0.002 < np.mean(start > 0) < 0.1
    # Pairs on a quarter of the samples count as quarters.
    assert 1 < pair.half_space.pairs < 15


@pytest.mark.parametrize(
    ("shape", "load"), [((256, 256), 0.2), ((64, 64), 0.001), ((129, 128), 0.001)]
)
def test_none_where_it_does_not_pay(shape, load):
    pair = ContactPair.prepared(rough_surface(shape), ElasticSolid(E_STAR))
    assert coarse_start(pair, load * E_STAR * SLOPE) is None
