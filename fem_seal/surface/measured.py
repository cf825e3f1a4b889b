"""Measured heights from a file, with the steps that prepare them."""

from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file import HEIGHT_NAMES, Stated, read_map
from fem_seal.grid import GridField
from fem_seal.surface.preparation import Preparation, PreparedSurface, prepare

HIGHEST = 1e100  # largest height [m]; sums of the squares of larger ones may overflow


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
    path : file with `heights` (nx, ny); npz is in metres and has `spacing` (dx, dy) [m] and
        optionally `periodic`; docs/guide/surfaces.md names the other formats
    stated : unit, size and other statements that the file lacks. If neither file nor scene states
        whether the map repeats, its seam decides
    preparation : steps of the preparation; none if left out

    Raises
    ------
    InvalidInput
        If the file is missing or cannot be read, the unit or size is missing or contradicts the
        file, heights are beyond 1e100 m, or a step fails.
    """
    field = read_map(path, HEIGHT_NAMES, stated, heights=True)
    highest = np.abs(field.values[~np.isnan(field.values)]).max(initial=0.0)
    if highest > HIGHEST:
        raise InvalidInput(
            f"heights in {path} reach {highest:.1e} m, whose squares are beyond double precision; "
            "check their unit, or cut out what is not a height"
        )
    try:
        return prepare(field, preparation or Preparation())
    except InvalidInput as error:
        raise InvalidInput(f"heights in {path}: {error}") from None
