"""Maps in the formats of instruments, read by SurfaceTopography (over thirty formats)."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.field_file.containers import BROKEN_PARSED, refuse_data_elsewhere
from fem_seal.field_file.recorded import Pair, Recorded
from fem_seal.installed import how_to_add

if TYPE_CHECKING:
    from SurfaceTopography.IO.Reader import ChannelInfo, ReaderBase

# What SurfaceTopography misreads, by its own audit of July 2026 (AUDIT.md there): lines of maps
# whose sides differ; which of several channels is asked for; all maps of a format.
_LINES, _CHANNELS = ("di", "ezd", "ps"), ("nmm", "oir", "poir")
_ALL = {"mi": "the lengths", "bcr": "the missing points"}


def read_instrument(path: Path, channel: str | None = None) -> Recorded:
    """Read one channel of an instrument's file, its default one if no name is given."""
    _check_hdf5(path)
    with _readable(path), _open(path) as reader:
        info = _map_channel(reader, channel, path)
        _refuse_misread(reader, info, path)
        # The reader insists on a size. Where the file has none, pass a placeholder, and report no
        # spacing below.
        size = {} if info.physical_sizes is not None else {"physical_sizes": info.nb_grid_pts}
        topography = reader.topography(channel_index=info.index, **size)
        values = np.ma.filled(np.ma.asarray(topography.heights(), dtype=float), np.nan)
        header = info.info.get("raw_metadata") or {}
        if reader.format() == "sur" and header.get("special_points"):
            # Points that were not measured stand two steps below the lowest height.
            steps = np.rint(values / header["height_scale_factor"])
            values[steps == header["zmin"] - 2] = np.nan
        spacing: Pair | None = None
        if not size:
            dx, dy = topography.pixel_size
            spacing = float(dx), float(dy)
        unit = topography.unit
        periodic = bool(topography.is_periodic) or None
        return Recorded(values, unit, spacing, unit, periodic, measured=True)


def _check_hdf5(path: Path) -> None:
    """Check HDF5 files under another name, such as .datx, as those under their own."""
    if find_spec("h5py"):
        import h5py

        if h5py.is_hdf5(path):
            with _readable(path), h5py.File(path, "r") as file:
                refuse_data_elsewhere(file, path)


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        from SurfaceTopography.Exceptions import ReadFileError, UnknownFileFormat
    except ImportError:
        raise MissingPackage(
            f"{path}: a file in the format of an instrument needs SurfaceTopography: "
            f"{how_to_add('SurfaceTopography')}"
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # deprecations inside the readers concern their authors
            yield
    except (*BROKEN_PARSED, ReadFileError, UnknownFileFormat) as error:
        # The messages of all other errors name parts of the reader's program.
        about_files = ReadFileError, UnknownFileFormat, OSError, ValueError
        of_the_file = isinstance(error, about_files)
        reason = str(error).strip().split("\n")[0] if of_the_file else ""
        reason = reason or "it is damaged, or of another format than its name says"
        raise InvalidInput(f"{path} cannot be read by SurfaceTopography: {reason}") from None


def _open(path: Path) -> "ReaderBase":
    from SurfaceTopography import open_topography
    from SurfaceTopography.Exceptions import CannotDetectFileFormat

    try:
        reader = open_topography(str(path))
    except CannotDetectFileFormat:
        reader = None
    # Some readers accept any bytes: the MATLAB reader then has no channel, and the format hgt
    # (terrain) has no signature to check.
    terrain = reader is not None and reader.format() == "hgt" and path.suffix.lower() != ".hgt"
    if reader is None or terrain or not reader.channels:
        raise InvalidInput(
            f"{path} is in no format that SurfaceTopography knows, or is cut off; the program of "
            "the instrument writes .x3p or text as well"
        )
    return reader


def _refuse_misread(reader: "ReaderBase", info: "ChannelInfo", path: Path) -> None:
    misread, name = None, reader.format()
    if name in _LINES and len(set(info.nb_grid_pts)) > 1:
        misread = "the lines of maps that are not square"
    elif name in _CHANNELS and len(reader.channels) > 1:
        misread = "all but one of several channels"
    misread = _ALL.get(name, misread)
    if misread is not None:
        raise InvalidInput(
            f"{path} is of the format {name!r}, of which SurfaceTopography misreads {misread}; "
            "save the map as .x3p or text, or in Gwyddion as .gsf"
        )


def _map_channel(reader: "ReaderBase", name: str | None, path: Path) -> "ChannelInfo":
    if name is None:
        info = reader.default_channel
    else:
        named = [info for info in reader.channels if info.name == name]
        if not named:
            held = ", ".join(repr(info.name) for info in reader.channels)
            raise InvalidInput(f"{path} has no channel {name!r}; it holds {held}")
        info = named[0]
    if info.dim != 2:
        raise InvalidInput(f"channel {info.name!r} of {path} is a line scan; a map is wanted")
    return info
