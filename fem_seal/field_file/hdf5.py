"""Checks of HDF5 files: all data must lie in the file itself and fit into memory."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from fem_seal.errors import InvalidInput
from fem_seal.memory import refuse_too_large

if TYPE_CHECKING:
    import h5py
    import numpy as np


def refuse_data_elsewhere(file: "h5py.File", path: Path) -> None:
    """Refuse a file whose arrays may lie in other files.

    External links, virtual data sets and external storage can name any file of the reader's
    machine, whose bytes would then become heights. No link is followed here.
    """
    import h5py

    inside = (h5py.h5l.TYPE_HARD, h5py.h5l.TYPE_SOFT)

    # A visitor returns its message, which ends the walk: HDF5 does not pass on exceptions.
    def link(name: bytes, info: "h5py.h5l.LinkInfo") -> str | None:
        if info.type in inside:
            return None
        return f"{name.decode('utf-8', 'replace')} in {path} is a link to"

    def item(name: str, held: "h5py.Dataset | h5py.Group") -> str | None:
        if isinstance(held, h5py.Dataset) and held.is_virtual:
            return f"{name} in {path} is a virtual data set of"
        if isinstance(held, h5py.Dataset) and held.external:
            return f"{name} in {path} is stored in"
        return None

    elsewhere = file.id.links.visit(link, info=True) or file.visititems(item)
    if elsewhere:
        raise InvalidInput(
            f"{elsewhere} other files, which is not followed; copy the data into the file itself "
            "(h5repack)"
        )


def refuse_large_data_set(
    dataset: "h5py.Dataset", what: str, available: float | None = None
) -> None:
    """Refuse a data set that memory cannot hold, or one of its chunks; see `memory_to_read`."""
    for shape in (dataset.shape or (), dataset.chunks or ()):
        refuse_too_large(memory_to_read(shape, dataset.dtype), what, available)


def memory_to_read(shape: Iterable[int], dtype: "np.dtype") -> int:
    """Bytes of an array as stored plus those of its float64 copy."""
    return math.prod(shape) * (dtype.itemsize + 8)
