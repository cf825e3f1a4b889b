"""Opening npz, npy, NetCDF and HDF5 files: all data must lie in the file itself."""

import lzma
import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tokenize import TokenError
from typing import TYPE_CHECKING
from xml.etree.ElementTree import ParseError
from zipfile import BadZipFile

import numpy as np

from fem_seal.errors import InvalidInput, MissingPackage
from fem_seal.field_file.named_arrays import NamedArrays, Variable, text_of
from fem_seal.installed import how_to_add

if TYPE_CHECKING:
    import h5py

# Errors that the libraries raise on truncated or damaged files. The list comes from a test that
# cuts files off at every length and flips bytes.
BROKEN = (
    OSError, ValueError, EOFError, LookupError, TypeError, RuntimeError,
    BadZipFile, zlib.error, lzma.LZMAError, TokenError,
)  # fmt: skip
# Parsers of more formats, those of instruments and of meshes, raise these as well.
BROKEN_PARSED = (
    *BROKEN, AttributeError, AssertionError, ArithmeticError, struct.error, ParseError
)  # fmt: skip

HDF5 = b"\x89HDF"
# Attributes of codes of their own: scale, z_scale, multiplier.
_FACTOR = re.compile(r"(^|_|z)(scale|scaling|multiplier)$", re.IGNORECASE)
# Attributes by which NetCDF packs numbers, or says which of them count, with what changes none.
_PACKED = {"scale_factor": ("1", "1.0"), "add_offset": ("0", "0.0"), "_Unsigned": ("false",)}
_PACKED |= dict.fromkeys(("valid_min", "valid_max", "valid_range"), ())


@contextmanager
def whole(path: Path, kind: str) -> Iterator[None]:
    """Raise InvalidInput with one sentence if a file is missing, or not a whole file of a kind."""
    try:
        yield
    except FileNotFoundError:
        raise InvalidInput(f"{path} does not exist") from None
    except BROKEN as error:
        reason = getattr(error, "strerror", None) or (
            f"it is not a whole {kind} file, or holds other things than numbers and texts"
        )
        raise InvalidInput(f"{path} cannot be read: {reason}") from None


def read_numpy(path: Path, names: Iterable[str]) -> NamedArrays:
    """Read the named arrays of an npz, or an npy as the first of them.

    Lengths without a unit are metres in an npz, but for Tamaas's, which has `attrs` and no units.
    """
    with whole(path, path.suffix[1:]), path.open("rb") as file:
        loaded = np.load(file, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return NamedArrays(path, {next(iter(names)): Variable(loaded)}, (), {})
        with loaded:
            arrays = {name: Variable(loaded[name]) for name in names if name in loaded.files}
            return NamedArrays(path, arrays, tuple(loaded.files), {}, si="attrs" not in arrays)


def read_netcdf(path: Path, names: Iterable[str]) -> NamedArrays:
    """Read NetCDF 3 with SciPy, and NetCDF 4, which is HDF5, with h5py."""
    with whole(path, "NetCDF"), path.open("rb") as head:
        is_hdf5 = head.read(4) == HDF5
    if is_hdf5:
        return read_hdf5(path, names)
    from scipy.io import netcdf_file

    with whole(path, "NetCDF"), netcdf_file(path, mmap=False) as file:
        arrays = {
            name: Variable(array.data, array._attributes, array.dimensions)
            for name, array in file.variables.items()
            if name in names
        }
        read = NamedArrays(path, arrays, tuple(file.variables), file._attributes)
    return _obeyed(read)


def read_hdf5(path: Path, names: Iterable[str]) -> NamedArrays:
    """Read the named data sets of an HDF5 file; names in a group are paths, "scan/heights"."""
    try:
        import h5py
    except ImportError:
        raise MissingPackage(
            f"{path} is an HDF5 file, which needs h5py: {how_to_add('h5py')}"
        ) from None

    with whole(path, "HDF5"), h5py.File(path, "r") as file:
        refuse_data_elsewhere(file, path)
        # A walk follows no links, and those of the top level are read.
        walk = [*file]
        file.visit(walk.append)
        # A name that is not UTF-8 stands there as bytes.
        held = tuple(text_of(name) for name in dict.fromkeys(walk) if _is_data_set(file[name]))
        arrays = {}
        for name in set(names).intersection(held):
            array = file[name]
            # NetCDF 4 attaches the name of a dimension as a scale.
            dimensions = tuple(
                scale[0].name.rsplit("/", 1)[-1] if len(scale) else scale.label
                for scale in array.dims
            )
            arrays[name] = Variable(array[()], dict(array.attrs), dimensions)
        read = NamedArrays(path, arrays, held, dict(file.attrs))
    return _obeyed(read)


def refuse_data_elsewhere(file: "h5py.File", path: Path) -> None:
    """Refuse a file whose arrays may lie in other files.

    External links, virtual data sets and external storage can name any file of the reader's
    machine, whose bytes would then become heights. No link is followed here.
    """
    import h5py

    inside = (h5py.h5l.TYPE_HARD, h5py.h5l.TYPE_SOFT)

    # A visitor returns its message, which ends the walk: HDF5 does not pass on exceptions.
    def link(name: bytes, info: "h5py.h5l.LinkInfo") -> str | None:
        """Message on a link to another file."""
        if info.type in inside:
            return None
        return f"{name.decode('utf-8', 'replace')} in {path} is a link to"

    def item(name: str, held: "h5py.Dataset | h5py.Group") -> str | None:
        """Message on an array that is stored in other files."""
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


def _is_data_set(item: "h5py.Dataset | h5py.Group") -> bool:
    """Whether an item is a data set: neither a group nor a NetCDF 4 dimension without values."""
    name = text_of(item.attrs.get("NAME", ""))
    return hasattr(item, "shape") and not name.startswith("This is a netCDF dimension but not")


def _obeyed(read: NamedArrays) -> NamedArrays:
    """The same with NaN at the missing points that attributes mark; packed numbers are refused."""
    variables = {
        name: replace(array, values=_values(f"{name} in {read.path}", array))
        for name, array in read.variables.items()
    }
    return replace(read, variables=variables)


def _values(what: str, array: Variable) -> np.ndarray:
    values = array.values
    kind = np.asarray(values).dtype.kind
    if kind not in "iuf":
        return values
    missing = np.zeros(np.shape(values), dtype=bool)
    for name, value in array.attributes.items():
        numbers, said = np.ravel(np.asarray(value)), text_of(value)
        numeric = numbers.dtype.kind in "iuf"
        factor = _FACTOR.search(name) and numeric and (numbers != 1).any()
        if factor or said.lower() not in _PACKED.get(name, (said.lower(),)):
            raise InvalidInput(
                f"{what} has an attribute {name} = {said}, which is not obeyed: write the numbers "
                "that are meant, as floats with NaN where nothing was measured, and delete it"
            )
        if name in ("_FillValue", "missing_value"):
            if numbers.size != 1 or not numeric:
                raise InvalidInput(f"{name} of {what} must be one number, got {said!r}")
            if numbers.dtype.kind + kind == "iu":
                numbers = numbers.astype(values.dtype)  # of -1 the largest unsigned number
            missing |= values == numbers[0]
    return np.where(missing, np.nan, values) if missing.any() else values
