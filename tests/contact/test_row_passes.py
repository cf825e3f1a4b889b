"""Passes over rows in several threads: every row once, answers in order, the same digits."""

import threading

import numpy as np
import pytest
from contact_cases import E_STAR, rough_surface

from fem_seal.contact.blocks import SAMPLES, STRIP, RowPasses
from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import ContactStopping

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
        pair = ContactPair.prepared(height, E_STAR)
        pair.half_space.passes = RowPasses(threads, strip=1)
        state = pair.under_pressure(0.02 * E_STAR, ContactStopping(tolerance=1e-4))
        pressures.append(state.pressure.values)
    assert np.array_equal(*pressures)
