"""Planned, real, in-place FFTs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue

import numpy as np

from fem_seal.contact.blocks import RowPasses, T
from fem_seal.memory import slices

Plans = tuple[Callable[[], None], Callable[[], None]]  # forward and backward

# FFTW's estimates make plans as fast as those of its trials (256² to 2048² samples, both
# precisions), and the same ones each time.
FLAGS = ("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT")
MODES_OF = {"float64": np.complex128, "float32": np.complex64}
# Bytes of a block of rows or columns: it fits into the second cache of a core.
BLOCK_BYTES = 2**18
BLOCKS_OF_TASK = 4  # blocks of rows in one task of a thread
# Rows are padded to a multiple of this many modes, 64 or 128 bytes: transforms in single precision
# then take 0.85 of the time, in double 0.95.
ALIGNED = 8


class RealTransform:
    """Forward and backward FFT of one real array, in place, in the threads of its passes.

    `values` (nx, ny) and `modes` (nx, ny // 2 + 1) are two views of the same memory, so that each
    transform destroys the other view. Unnormalised: backward after forward multiplies by nx ny,
    which the callers put into their multipliers.

    Blocks of rows and then blocks of columns are transformed by plans for one thread: FFTW's own
    threads wait for each other in vain on a busy machine. Columns are copied into a buffer, one
    after the other: if FFTW reads them where they stand, apart from each other in memory, all takes
    up to 2.5 times as long.
    """

    def __init__(self, shape: tuple[int, int], precision: str, passes: RowPasses | None = None):
        import pyfftw

        nx, ny = shape
        padded = -(-(ny // 2 + 1) // ALIGNED) * ALIGNED
        memory = pyfftw.empty_aligned((nx, padded), MODES_OF[precision])
        self.modes, self.values = memory[:, : ny // 2 + 1], memory.view(precision)[:, :ny]
        self._passes = passes or RowPasses()

        def both_ways(values: np.ndarray, modes: np.ndarray) -> Plans:
            forward = pyfftw.FFTW(values, modes, (1,), "FFTW_FORWARD", FLAGS)
            backward = pyfftw.FFTW(modes, values, (1,), "FFTW_BACKWARD", FLAGS)
            return forward.execute, backward.execute

        values, modes = self.values, self.modes
        rows = slices(0, nx, max(1, BLOCK_BYTES // modes[0].nbytes))
        self._rows = [both_ways(values[block], modes[block]) for block in rows]
        # Columns that share a line of the cache are copied together. The plans transform a whole
        # buffer: blocks of nearly equal width leave little of it unused.
        count = -(-modes.shape[1] // max(ALIGNED, BLOCK_BYTES // modes[:, 0].nbytes))
        width = -(-modes.shape[1] // count)
        self._columns = list(slices(0, modes.shape[1], width))
        self._buffers: SimpleQueue[tuple[np.ndarray, Plans]] = SimpleQueue()
        for _ in range(self._passes.threads):
            buffer = pyfftw.zeros_aligned((width, nx), MODES_OF[precision])
            self._buffers.put((buffer, both_ways(buffer, buffer)))

    def in_blocks(self, factors: np.ndarray) -> list[np.ndarray]:
        """Factors (nx, ny // 2 + 1) of the modes as `forward` and `multiply` read them."""
        return [np.ascontiguousarray(factors[:, columns].T) for columns in self._columns]

    @contextmanager
    def _copied(self, columns: slice) -> Iterator[tuple[np.ndarray, Plans]]:
        """Columns of the modes, as rows of a buffer, with the plans that transform it."""
        buffer, plans = self._buffers.get()
        try:
            block = self.modes[:, columns].T
            buffer[: len(block)] = block
            yield buffer[: len(block)], plans
        finally:
            self._buffers.put((buffer, plans))

    def forward(
        self, look: Callable[[np.ndarray, np.ndarray], T], factors: list[np.ndarray]
    ) -> list[T]:
        """Transform to modes; call `look` for every block of them, with its factors."""

        def transform(columns: slice, factor: np.ndarray) -> T:
            with self._copied(columns) as (modes, plans):
                plans[0]()
                return look(modes, factor)

        self._passes.each(self._rows, lambda plans: plans[0](), BLOCKS_OF_TASK)
        blocks = list(zip(self._columns, factors, strict=True))
        return self._passes.each(blocks, lambda block: transform(*block))

    def multiply(self, factors: list[np.ndarray]) -> None:
        """Multiply the modes by factors: `values` to `values`."""

        def transform(columns: slice, factor: np.ndarray) -> None:
            with self._copied(columns) as (modes, plans):
                plans[0]()
                modes *= factor
                plans[1]()
                self.modes[:, columns] = modes.T

        self._passes.each(self._rows, lambda plans: plans[0](), BLOCKS_OF_TASK)
        blocks = list(zip(self._columns, factors, strict=True))
        self._passes.each(blocks, lambda block: transform(*block))
        self._passes.each(self._rows, lambda plans: plans[1](), BLOCKS_OF_TASK)
