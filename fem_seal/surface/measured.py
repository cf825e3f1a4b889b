"""Heights from a file, as they are or prepared."""

from pathlib import Path

from fem_seal.errors import InvalidInput
from fem_seal.field_file import HEIGHT_NAMES, Stated, read_map
from fem_seal.grid import GridField
from fem_seal.surface.preparation import Preparation, PreparedSurface, prepare


def load_heights(
    path: str | Path, stated: Stated | None = None, preparation: Preparation | None = None
) -> GridField:
    """Read heights [m]; see `measured_surface`."""
    return measured_surface(path, stated, preparation).field


def measured_surface(
    path: str | Path, stated: Stated | None = None, preparation: Preparation | None = None
) -> PreparedSurface:
    """Read heights [m] and prepare them.

    Parameters
    ----------
    path : of a file with `heights` (nx, ny); npz is in metres and has `spacing` (dx, dy) [m] and
        optionally `periodic`; docs/surfaces.md names the other formats
    stated : unit, size and whatever else the file does not say. Where nobody says whether the
        map repeats, its seam tells
    preparation : steps; none if left out

    Raises
    ------
    InvalidInput
        If the file is missing or cannot be read, the unit or size is nowhere said or contradicts
        the file, or a step cannot be taken.
    """
    found = read_map(path, HEIGHT_NAMES, stated, heights=True)
    try:
        return prepare(found, preparation or Preparation())
    except InvalidInput as error:
        raise InvalidInput(f"heights in {path}: {error}") from None
