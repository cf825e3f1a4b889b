"""Heights from a file."""

from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField


def load_heights(
    path: str | Path, *, spacing: tuple[float, float] | None = None, periodic: bool = True
) -> GridField:
    """Read heights [m] from .npz (``heights``, ``spacing``, optional ``periodic``) or .npy.

    Parameters
    ----------
    path : str or Path
        The file.
    spacing : (dx, dy) [m], optional
        For .npy, which cannot hold it; in place of the file's own for .npz.
    periodic : bool
        Used where the file does not say. Default True, because the elastic contact repeats the
        surface anyway; say False to have it refused there.

    Raises
    ------
    InvalidInput
        If the file is missing, is not such a file, or its contents are not finite heights.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            loaded = np.load(file, allow_pickle=False)
            arrays = dict(loaded) if isinstance(loaded, np.lib.npyio.NpzFile) else None
    except FileNotFoundError as error:
        raise InvalidInput(f"surface file {path} does not exist") from error
    except (OSError, ValueError, EOFError) as error:
        raise InvalidInput(f"surface file {path} cannot be read: {error}") from error
    if arrays is None:
        arrays = {"heights": loaded}
    if "heights" not in arrays:
        raise InvalidInput(f"{path} has no array 'heights'; it holds {', '.join(arrays) or 'none'}")
    if not np.issubdtype(arrays["heights"].dtype, np.number) or np.iscomplexobj(arrays["heights"]):
        raise InvalidInput(f"heights in {path} must be real numbers in metres")
    spacing = arrays.get("spacing") if spacing is None else spacing
    if spacing is None:
        raise InvalidInput(f"{path} does not say its spacing; add an array 'spacing' (dx, dy) in m")
    return GridField(arrays["heights"], spacing, bool(arrays.get("periodic", periodic)))
