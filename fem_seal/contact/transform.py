"""Planned, real, in-place FFTs whose plans (FFTW's "wisdom") are kept between runs."""

import contextlib
import json
from functools import cache
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.files import user_cache, write_text

# Below this many samples planning by trial costs more than the solves it would speed up.
MEASURED_FROM = 256 * 256
MODES_OF = {"float64": np.complex128, "float32": np.complex64}


class RealTransform:
    """Forward and backward FFT of one real array, in place.

    `values` (nx, ny) and `modes` (nx, ny // 2 + 1) are two views of the same memory, so that each
    transform destroys the other view. Unnormalised: backward after forward multiplies by nx ny,
    which the callers put into their multipliers. From `measured_from` samples on plans are chosen
    by trial, and kept.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        precision: str,
        threads: int,
        measured_from: int = MEASURED_FROM,
    ):
        import pyfftw

        nx, ny = shape
        self.modes = pyfftw.empty_aligned((nx, ny // 2 + 1), MODES_OF[precision])
        self.values = self.modes.view(precision)[:, :ny]
        if nx * ny < measured_from:
            self._plan("FFTW_ESTIMATE", threads=threads)
            return
        _load_wisdom()
        try:
            self._plan("FFTW_MEASURE", "FFTW_WISDOM_ONLY", threads=threads)
        except RuntimeError:  # pyfftw raises this if there is no stored plan
            self._plan("FFTW_MEASURE", threads=threads)
            _save_wisdom()

    def _plan(self, *effort: str, threads: int) -> None:
        import pyfftw

        flags = (*effort, "FFTW_DESTROY_INPUT")
        to_modes, to_values = (self.values, self.modes), (self.modes, self.values)
        forward = pyfftw.FFTW(*to_modes, (0, 1), "FFTW_FORWARD", flags, threads)
        backward = pyfftw.FFTW(*to_values, (0, 1), "FFTW_BACKWARD", flags, threads)
        self.forward, self.backward = forward.execute, backward.execute


def wisdom_path() -> Path:
    """File of the plans: fem_seal/fftw-wisdom.json in the user's cache folder."""
    return user_cache() / "fem_seal" / "fftw-wisdom.json"


@cache
def _load_wisdom() -> None:
    import pyfftw

    # A missing or foreign file only costs planning again; FFTW refuses wisdom of other builds.
    with contextlib.suppress(OSError, ValueError):
        stored = json.loads(wisdom_path().read_text())
        pyfftw.import_wisdom(tuple(text.encode() for text in stored))


def _save_wisdom() -> None:
    import pyfftw

    path = wisdom_path()
    # A cache folder that cannot be written must not stop a computation.
    with contextlib.suppress(OSError, InvalidInput):
        wisdom = [text.decode() for text in pyfftw.export_wisdom()]
        write_text(path, json.dumps(wisdom), durable=False)
