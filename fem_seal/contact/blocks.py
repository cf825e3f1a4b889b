"""Blocks of rows that fit into the processor's cache, for passes over large arrays."""

from collections.abc import Iterator

# 256 kB of float64: numpy's temporaries then never reach the main memory.
SAMPLES = 2**15


def row_blocks(shape: tuple[int, ...]) -> Iterator[slice]:
    """Slices of whole rows, of about 32768 samples each."""
    rows = max(1, SAMPLES // shape[1])
    for first in range(0, shape[0], rows):
        yield slice(first, min(first + rows, shape[0]))
