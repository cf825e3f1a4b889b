"""One file to one map in metres; the ending of its name says the format."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import read_hdf5, read_netcdf, read_npy, read_npz
from fem_seal.field_file.instruments import read_instrument
from fem_seal.field_file.markers import refuse_markers, without_marked
from fem_seal.field_file.named_arrays import NamedArrays, interpret, wanted_names
from fem_seal.field_file.recorded import FieldMap, Recorded, Stated, in_metres
from fem_seal.field_file.text import read_text
from fem_seal.memory import within_available_memory

# Under which arrays are looked for unless the scene names one: ours, then those of reynoldsflow
# and of the contact mechanics challenge (Müser et al., Tribol. Lett. 65, 118 (2017)).
GAP_NAMES = ("gap", "gaps")
HEIGHT_NAMES = ("heights", "surface")

Names = tuple[str, ...]


def read_map(
    path: str | Path, names: Names, stated: Stated | None = None, *, heights: bool = False
) -> FieldMap:
    """Read a map of heights or gaps.

    Parameters
    ----------
    path : .npz, .npy, .nc (NetCDF 3 or 4), .h5 or .hdf5, .txt, .csv; anything else is read by
        SurfaceTopography
    names : under which the samples may stand in a file of many arrays
    stated : what the scene says of the file
    heights : whether a value far from all others is refused until `stated` says what it is. A gap
        has such values: its contact

    Raises
    ------
    InvalidInput
        If the file cannot be read, holds no such map, or what it says of units and lengths is
        missing or contradicts what is stated; or if a value looks like a mark of missing points.
    """
    path, stated = Path(path), stated or Stated()
    names = (stated.array,) if stated.array is not None else names
    reader = READERS.get(path.suffix.lower(), _instrument)
    with within_available_memory(str(path)):
        recorded = reader(path, names)
    if isinstance(stated.missing, float | int):
        recorded = replace(recorded, values=without_marked(recorded.values, stated.missing))
    infinite = np.count_nonzero(np.isinf(recorded.values))
    if infinite:
        raise InvalidInput(f"{infinite} of {recorded.values.size} values of {path} are infinite")
    if heights and stated.missing != "none":
        refuse_markers(recorded.values, str(path))
    found = in_metres(recorded, stated, path)
    if found.periodic is None and reader is _instrument:
        # Of what was measured nobody needs to say that it does not repeat.
        return replace(found, periodic=False)
    return found


def _named(
    opener: Callable[[Path, Names], NamedArrays],
) -> Callable[[Path, Names], Recorded]:
    def read(path: Path, names: Names) -> Recorded:
        return interpret(opener(path, wanted_names(names)), names)

    return read


def _npy(path: Path, names: Names) -> Recorded:
    values = read_npy(path)
    if values.dtype.kind not in "iuf":
        raise InvalidInput(f"{path} must hold real numbers, not {values.dtype}")
    if values.ndim != 2 or 0 in values.shape:
        raise InvalidInput(f"{path} must be two-dimensional, (nx, ny), not {values.shape}")
    return Recorded(values.astype(float))


def _text(path: Path, names: Names) -> Recorded:
    return read_text(path)


def _instrument(path: Path, names: Names) -> Recorded:
    # Channels have the instrument's names: only one that was asked for is looked for.
    asked = names[0] if names not in (GAP_NAMES, HEIGHT_NAMES) else None
    return read_instrument(path, asked)


READERS: dict[str, Callable[[Path, Names], Recorded]] = {
    ".npz": _named(read_npz),
    ".npy": _npy,
    ".nc": _named(read_netcdf),
    ".h5": _named(read_hdf5),
    ".hdf5": _named(read_hdf5),
    ".txt": _text,
    ".csv": _text,
}
