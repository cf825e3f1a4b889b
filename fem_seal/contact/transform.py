"""Planned, real, in-place FFTs."""

from collections.abc import Callable

import numpy as np

from fem_seal.contact.blocks import RowPasses, T

Plans = tuple[Callable[[], None], Callable[[], None]]  # forward and backward

# FFTW's estimates make plans as fast as those of its trials (256² to 2048² samples, both
# precisions), and the same ones each time.
FLAGS = ("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT")
MODES_OF = {"float64": np.complex128, "float32": np.complex64}
# Bytes of a block of rows and of one of columns: they fit into the second cache of a core. Larger
# and smaller ones were no faster at 2048².
BLOCK_OF_ROWS, BLOCK_OF_COLUMNS = 2**18, 2**20
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
    threads wait for each other in vain on a busy machine.
    """

    def __init__(self, shape: tuple[int, int], precision: str, passes: RowPasses | None = None):
        import pyfftw

        nx, ny = shape
        padded = -(-(ny // 2 + 1) // ALIGNED) * ALIGNED
        memory = pyfftw.empty_aligned((nx, padded), MODES_OF[precision])
        self.modes, self.values = memory[:, : ny // 2 + 1], memory.view(precision)[:, :ny]
        self._passes = passes or RowPasses()

        def both_ways(values: np.ndarray, modes: np.ndarray, axis: int) -> Plans:
            forward = pyfftw.FFTW(values, modes, (axis,), "FFTW_FORWARD", FLAGS)
            backward = pyfftw.FFTW(modes, values, (axis,), "FFTW_BACKWARD", FLAGS)
            return forward.execute, backward.execute

        values, modes = self.values, self.modes
        rows = _blocks(len(modes), BLOCK_OF_ROWS // modes[0].nbytes)
        columns = _blocks(modes.shape[1], BLOCK_OF_COLUMNS // modes[:, 0].nbytes)
        self._rows = [both_ways(values[block], modes[block], 1) for block in rows]
        self._columns = [
            (block, both_ways(modes[:, block], modes[:, block], 0)) for block in columns
        ]

    def in_blocks(self, factors: np.ndarray) -> list[np.ndarray]:
        """Factors (nx, ny // 2 + 1) of the modes as `forward` and `multiply` read them.

        Each block of columns is an array of its own: strided ones take twice as long to read.
        """
        return [np.ascontiguousarray(factors[:, columns]) for columns, _ in self._columns]

    def forward(
        self, look: Callable[[np.ndarray, np.ndarray], T], factors: list[np.ndarray]
    ) -> list[T]:
        """Transform to modes; call `look` for every block of them, with its factors."""

        def transform(columns: slice, plans: Plans, factor: np.ndarray) -> T:
            plans[0]()
            return look(self.modes[:, columns], factor)

        self._passes.each(self._rows, lambda plans: plans[0](), BLOCKS_OF_TASK)
        blocks = list(zip(self._columns, factors, strict=True))
        return self._passes.each(blocks, lambda block: transform(*block[0], block[1]))

    def multiply(self, factors: list[np.ndarray]) -> None:
        """Multiply the modes by factors: `values` to `values`."""

        def transform(columns: slice, plans: Plans, factor: np.ndarray) -> None:
            plans[0]()
            self.modes[:, columns] *= factor
            plans[1]()

        self._passes.each(self._rows, lambda plans: plans[0](), BLOCKS_OF_TASK)
        blocks = list(zip(self._columns, factors, strict=True))
        self._passes.each(blocks, lambda block: transform(*block[0], block[1]))
        self._passes.each(self._rows, lambda plans: plans[1](), BLOCKS_OF_TASK)


def _blocks(count: int, size: int) -> list[slice]:
    """Slices of `size` numbers below a count, at least one each."""
    size = max(1, size)
    return [slice(first, first + size) for first in range(0, count, size)]
