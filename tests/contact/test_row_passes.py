"""Passes over rows in several threads and the transforms in place: the same digits."""

import os
import threading

import numpy as np
import pytest
from contact_cases import E_STAR, SOLID, rough_surface

from fem_seal.contact import Arithmetic, Load, press
from fem_seal.contact.blocks import BLOCK_SAMPLES, STRIP, RowPasses
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.transform import RealTransform

# A row is a block, and there are enough of them for several strips.
LONG_ROWS = (2 * STRIP + 3, BLOCK_SAMPLES + 1)


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (1000, 600), LONG_ROWS, (5, 10 * BLOCK_SAMPLES)])
def test_every_row_once_and_in_order(shape, threads):
    blocks = RowPasses(threads).over(shape, lambda rows: range(rows.start, rows.stop))
    assert [row for block in blocks for row in block] == list(range(shape[0]))


def test_threads_work_at_the_same_time():
    """Blocks of two strips wait for each other in pairs: with one thread alone that would fail."""
    both = threading.Barrier(2, timeout=10)
    places = RowPasses(2).over((2 * STRIP, BLOCK_SAMPLES), lambda rows: both.wait())
    assert sorted(places) == STRIP * [0] + STRIP * [1]


def test_an_error_of_a_thread_is_raised():
    def fail(rows):
        if rows.start == 2 * STRIP:
            raise ValueError("last strip")

    with pytest.raises(ValueError, match="last strip"):
        RowPasses(2).over(LONG_ROWS, fail)


def test_contact_has_the_same_digits(monkeypatch):
    """Whatever the number of threads of the passes and of the FFTs, in both precisions."""
    monkeypatch.setattr("fem_seal.contact.free_set_cg.SINGLE_FROM", 0)
    height = rough_surface((310, 600), short=2)
    states = [
        press(height, SOLID, Load("pressure", 0.02 * E_STAR), arithmetic=Arithmetic(threads=n))
        for n in (1, 3)
    ]
    assert np.array_equal(*(state.pressure.values for state in states))
    assert np.array_equal(*(state.gap.values for state in states))


def test_threads_left_out(monkeypatch):
    """The cores that the process may use, at most OMP_NUM_THREADS; one on a small grid."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    usable = len(os.sched_getaffinity(0))
    assert HalfSpace((512, 512), (1.0, 1.0)).threads == usable
    assert HalfSpace((64, 64), (1.0, 1.0)).threads == 1
    monkeypatch.setenv("OMP_NUM_THREADS", "1,2")  # of nested threads
    assert HalfSpace((512, 512), (1.0, 1.0)).threads == 1


@pytest.mark.parametrize("shape", [(8, 8), (7, 9), (5, 8), (8, 1), (1, 6), (13, 4)])
@pytest.mark.parametrize(("precision", "rounding"), [("float64", 1e-14), ("float32", 1e-5)])
def test_against_numpy(shape, precision, rounding):
    values = np.random.default_rng(0).normal(size=shape)
    work = RealTransform(shape, precision, RowPasses(threads=2))
    work.values[...] = values
    multiplier = np.random.default_rng(1).uniform(0.5, 1, work.modes.shape)
    factors = work.in_blocks(multiplier.astype(precision))
    modes = np.concatenate(work.forward(lambda modes, factor: modes * factor, factors)).T
    assert np.abs(modes - np.fft.rfft2(values) * multiplier).max() < rounding * values.size
    work.values[...] = values
    wanted = np.fft.irfft2(np.fft.rfft2(values) * multiplier, shape)
    work.multiply(factors)
    assert np.abs(work.values / values.size - wanted).max() < rounding
