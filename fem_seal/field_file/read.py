"""Read one file into one map in metres; the suffix of its name selects the format."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from shlex import quote

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import read_hdf5, read_netcdf, read_numpy, whole
from fem_seal.field_file.instruments import read_instrument
from fem_seal.field_file.markers import refuse_markers, without_marked
from fem_seal.field_file.named_arrays import NamedArrays, interpret, names_to_read
from fem_seal.field_file.own_layouts import read_gsf, read_x3p
from fem_seal.field_file.recorded import FieldMap, Recorded, Stated, in_metres
from fem_seal.field_file.text import read_text
from fem_seal.field_file.text_table import is_text
from fem_seal.files import digest
from fem_seal.memory import within_available_memory

# Names of the arrays to read unless the scene names one: first the package's own, then those of
# reynoldsflow and of the contact mechanics challenge (Müser et al., Tribol. Lett. 65, 118 (2017)).
GAP_NAMES = ("gap", "gaps")
HEIGHT_NAMES = ("heights", "surface")

# Both text files and files of instruments have these endings: the content decides.
TEXT_ENDINGS = (".asc", ".dat", ".prn", ".sdf", ".tsv", ".xyz")

Names = tuple[str, ...]


def read_map(
    path: str | Path, names: Names, stated: Stated | None = None, *, heights: bool = False
) -> FieldMap:
    """Read a map of heights or gaps.

    Parameters
    ----------
    path
        A file under an ending of `READERS`, or a text under one of `TEXT_ENDINGS`; anything else is
        read by SurfaceTopography.
    names
        Names that the samples may have in a file of many arrays.
    heights
        Whether the samples are heights. A height that recurs far from all others is refused, unless
        `stated.missing` explains it. In a gap, the zeros of contact are such values; it is 0 where
        the file reports contact.

    Raises
    ------
    InvalidInput
        If the file cannot be read or holds no such map, if its units or lengths are missing or
        contradict those of the scene, or if a value looks like a mark of missing points.
    """
    path, stated = Path(path), stated or Stated()
    recorded = read_recorded(path, (stated.array,) if stated.array is not None else names)
    values = recorded.values
    if isinstance(stated.missing, float | int):
        values = without_marked(values, stated.missing)
    if heights and stated.missing != "none":
        refuse_markers(values, str(path))
    if not heights and recorded.contact is not None:
        if recorded.contact.shape != values.shape:
            raise InvalidInput(
                f"gap in {path} has shape {values.shape}, but its contact pressure "
                f"{recorded.contact.shape}"
            )
        values = np.where(recorded.contact, 0.0, values)
    field = in_metres(replace(recorded, values=values), stated, path)
    field = field.oriented(stated.turn, stated.transpose)
    return replace(field, values=stated.height_factor * field.values)


def read_recorded(path: Path, names: Names) -> Recorded:
    """Read a map and the statements of its file; see `read_map`."""
    with whole(path, "map"):
        content = digest(path)
    return _recorded(path, names, content)


# All patches of a seal, and the remarks about it, are of one file. The digest `content` is there
# for the cache alone: a file that has changed is read again.
@lru_cache(maxsize=1)
def _recorded(path: Path, names: Names, content: str) -> Recorded:
    with within_available_memory(str(path)):
        recorded = READERS.get(path.suffix.lower(), _instrument)(path, names)
    infinite = np.argwhere(np.isinf(recorded.values))
    if len(infinite):
        raise InvalidInput(
            f"{len(infinite)} of {recorded.values.size} values of {path} are infinite, the first "
            f"at sample {tuple(map(int, infinite[0]))}; write NaN where nothing was measured"
        )
    recorded.values.setflags(write=False)
    return recorded


def _named(read: Callable[[Path, Names], NamedArrays], path: Path, names: Names) -> Recorded:
    return interpret(read(path, names_to_read(names)), names)


def _of_one_array(read: Callable[[Path], Recorded], path: Path, names: Names) -> Recorded:
    return read(path)


def _instrument(path: Path, names: Names) -> Recorded:
    if path.suffix.lower() == ".toml":
        command = f"fem-seal run {quote(str(path))}"
        raise InvalidInput(f"{path} is a scene, and not a map; {command} computes it")
    if path.suffix.lower() in TEXT_ENDINGS and is_text(path):
        return replace(read_text(path), measured=True)
    # Instruments name their channels; without a name in the scene the default channel is read.
    channel = names[0] if names not in (GAP_NAMES, HEIGHT_NAMES) else None
    return read_instrument(path, channel)


READERS: dict[str, Callable[[Path, Names], Recorded]] = {
    ".npz": partial(_named, read_numpy),
    ".npy": partial(_named, read_numpy),
    ".nc": partial(_named, read_netcdf),
    ".h5": partial(_named, read_hdf5),
    ".hdf5": partial(_named, read_hdf5),
    ".txt": partial(_of_one_array, read_text),
    ".csv": partial(_of_one_array, read_text),
    ".gsf": partial(_of_one_array, read_gsf),
    ".x3p": partial(_of_one_array, read_x3p),
}
