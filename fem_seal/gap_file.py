"""Reading a gap from a file, such as contact.npz of a result folder."""

from pathlib import Path

import numpy as np

from fem_seal.arguments import require_positive
from fem_seal.errors import InvalidInput
from fem_seal.field_file import GAP_NAMES, Stated, read_map
from fem_seal.grid import GridField


def load_gap(
    path: str | Path, stated: Stated | None = None, contact_below: float | None = None
) -> GridField:
    """Read a gap [m], >= 0 and 0 in contact; the flow runs along the first axis.

    Parameters
    ----------
    path
        File with `gap` (nx, ny). An npz file is in metres and has `spacing` (dx, dy) [m] and
        optionally `periodic` (default false); docs/guide/surfaces.md names the other formats.
    stated
        Unit, size and other properties that the file does not contain.
    contact_below
        Samples with ``|gap|`` below this [m] count as contact: some codes write a rounding error
        where there is contact.

    Raises
    ------
    InvalidInput
        If the file is missing or cannot be read, an array is missing or of the wrong shape or
        type, the unit or size is unknown, or the gap is negative or not finite.
    """
    field = read_map(path, GAP_NAMES, stated)
    values = field.values
    if contact_below is not None:
        require_positive(contact_below=contact_below)
        values = np.where(np.abs(values) < contact_below, 0.0, values)
    try:
        gap = GridField(values, field.spacing, bool(field.periodic))
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
