"""Reading a gap; contact.npz of a result folder is such a file as well."""

from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file import GAP_NAMES, FieldMap, Stated, read_map
from fem_seal.grid import GridField


def load_gap(
    path: str | Path, stated: Stated | None = None, contact_below: float | None = None
) -> GridField:
    """Read a gap [m], >= 0 and 0 in contact; the flow runs along the first axis.

    Parameters
    ----------
    path : of a file with `gap` (nx, ny); npz is in metres and has `spacing` (dx, dy) [m] and
        optionally `periodic` (default false); docs/surfaces.md names the other formats
    stated : unit, size and whatever else the file does not say
    contact_below : gaps below this [m] are contact, also negative ones not beyond it: for codes
        whose gap in contact is a rounding

    Raises
    ------
    InvalidInput
        If the file is missing or cannot be read, an array is missing or of the wrong shape or
        type, the unit or size is nowhere said, or the gap is negative or not finite.
    """
    found = read_map(path, GAP_NAMES, stated)
    values = np.where(_touching(found, contact_below, Path(path)), 0.0, found.values)
    try:
        gap = GridField(values, found.spacing, bool(found.periodic))
    except InvalidInput as error:
        raise InvalidInput(f"gap in {path}: {error}") from None
    lowest = gap.values.min()
    if lowest < 0:
        count = np.count_nonzero(gap.values < 0)
        raise InvalidInput(
            f"gap in {path} is negative at {count} of {gap.values.size} samples (least "
            f"{lowest:.3e} m); contact is a gap of exactly 0 (or set contact_below)"
        )
    return gap


def _touching(found: FieldMap, contact_below: float | None, path: Path) -> np.ndarray | bool:
    """Samples in contact, by what the file says of it and by a length that counts as none."""
    touching = False if contact_below is None else np.abs(found.values) < contact_below
    if found.contact is None:
        return touching
    if found.contact.shape != found.values.shape:
        raise InvalidInput(
            f"gap in {path} has shape {found.values.shape}, but its contact pressure "
            f"{found.contact.shape}"
        )
    return touching | found.contact
