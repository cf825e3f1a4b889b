"""Reading a gap, in the format that contact.npz of a result folder has as well."""

from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def load_gap(path: str | Path) -> GridField:
    """Read a gap [m] from an npz file.

    Parameters
    ----------
    path : of a file with `gap` (nx, ny) [m], >= 0 and 0 in contact, `spacing` (dx, dy) [m] and
        optionally `periodic` (default false); the flow runs along the first axis

    Raises
    ------
    InvalidInput
        If the file is missing or no npz, an array is missing or of the wrong shape or type, or
        the gap is negative or not finite.
    """
    path = Path(path)
    arrays = _read(path)
    for name in ("gap", "spacing"):
        if name not in arrays:
            held = ", ".join(sorted(arrays)) or "nothing"
            raise InvalidInput(f"{path} has no array {name!r}; it holds {held}")
    for name, values in arrays.items():
        if values.dtype.kind not in "biuf":
            raise InvalidInput(f"{name} in {path} must hold real numbers, not {values.dtype}")
    if arrays["gap"].dtype.kind == "b":
        raise InvalidInput(f"gap in {path} holds true and false; a gap is a length in metres")
    if arrays["periodic"].size != 1:
        raise InvalidInput(f"periodic in {path} must be one true or false")
    try:
        gap = GridField(arrays["gap"], arrays["spacing"], bool(arrays["periodic"].item()))
    except InvalidInput as error:
        raise InvalidInput(f"gap in {path}: {error}") from None
    lowest = gap.values.min()
    if lowest < 0:
        count = np.count_nonzero(gap.values < 0)
        raise InvalidInput(
            f"gap in {path} is negative at {count} of {gap.values.size} samples (least "
            f"{lowest:.3e} m); contact is a gap of exactly 0"
        )
    return gap


def _read(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays of this format; others, such as pressures, stay unread."""
    try:
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            if not isinstance(loaded, np.lib.npyio.NpzFile):
                raise InvalidInput(f"{path} holds one array; a gap file is an npz with spacing")
            known = [name for name in ("gap", "spacing", "periodic") if name in loaded.files]
            return {"periodic": np.array(False)} | {name: loaded[name] for name in known}
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        reason = getattr(error, "strerror", None) or "it is not a whole npz file"
        raise InvalidInput(f"cannot read the gap file {path}: {reason}") from None
