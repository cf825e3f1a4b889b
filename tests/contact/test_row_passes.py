"""Passes over rows in several threads: every row once, answers in order, the same digits."""

import os
import threading

import numpy as np
import pytest
from contact_cases import E_STAR, rough_surface

from fem_seal.contact import solve
from fem_seal.contact.blocks import SAMPLES, STRIP, RowPasses
from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.methods import ContactStopping
from fem_seal.contact.settings import ElasticSolid

# A row is a block, and there are enough of them for several strips.
LONG_ROWS = (2 * STRIP + 3, SAMPLES + 1)


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (1000, 600), LONG_ROWS, (5, 10 * SAMPLES)])
def test_every_row_once_and_in_order(shape, threads):
    blocks = RowPasses(threads).over(shape, lambda rows: range(rows.start, rows.stop))
    assert [row for block in blocks for row in block] == list(range(shape[0]))


def test_threads_work_at_the_same_time():
    """Two strips wait for each other; one thread alone would wait in vain."""
    both = threading.Barrier(2, timeout=10)
    RowPasses(2).over((2 * STRIP, SAMPLES), lambda rows: rows.start % STRIP or both.wait())


def test_an_error_of_a_thread_is_raised():
    def fail(rows):
        if rows.start == 2 * STRIP:
            raise ValueError("last strip")

    with pytest.raises(ValueError, match="last strip"):
        RowPasses(2).over(LONG_ROWS, fail)


def test_contact_has_the_same_digits():
    """With the same plans of the FFT, whatever the number of threads of the passes."""
    height = rough_surface((310, 600), short=2)
    pressures = []
    for threads in (1, 3):
        pair = ContactPair.prepared(height, ElasticSolid(E_STAR))
        pair.half_space.passes = RowPasses(threads, strip=1)
        state = pair.under_pressure(0.02 * E_STAR, ContactStopping(tolerance=1e-4))
        pressures.append(state.pressure.values)
    assert np.array_equal(*pressures)


def test_digits_of_several_threads():
    """FFTs in two threads add in another order: both gaps lie within the certificate's tolerance.

    The largest difference seen on three surfaces was 3e-8 of the rms height.
    """
    height = rough_surface((512, 512))
    one, two = (solve(height, E_STAR, pressure=0.02 * E_STAR, threads=n) for n in (1, 2))
    difference = np.abs(one.gap.values - two.gap.values).max()
    assert difference <= 1e-6 * height.values.std()
    assert np.array_equal(one.contact, two.contact)


def test_threads_left_out(monkeypatch):
    """The cores that the process may use, at most OMP_NUM_THREADS; one on a small grid."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    usable = len(os.sched_getaffinity(0))
    assert HalfSpace((512, 512), (1.0, 1.0)).threads == usable
    assert HalfSpace((64, 64), (1.0, 1.0)).threads == 1
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert HalfSpace((512, 512), (1.0, 1.0)).threads == 1
