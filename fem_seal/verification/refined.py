"""The same gap on finer grids, on which every method must converge to the same leak rate."""

from collections.abc import Callable

from fem_seal.grid import GridField
from fem_seal.registry import choose


def _halved_pixels(gap: GridField) -> GridField:
    """Cut each pixel of constant gap into four."""
    values = gap.values.repeat(2, axis=0).repeat(2, axis=1)
    dx, dy = gap.spacing
    return GridField(values, (0.5 * dx, 0.5 * dy), gap.periodic)


_FINER: dict[str, Callable[[GridField], GridField]] = {
    "linear": GridField.refined,
    "constant": _halved_pixels,
}


def refined(gap: GridField, representation: str, times: int = 1) -> GridField:
    """Sample a gap, as represented, on a grid 2^times as fine; the gap itself does not change.

    Parameters
    ----------
    gap : gap [m]
    representation : "linear" (linear on the alternating triangles) or "constant" (square pixels)
    times : number of times that the spacing is halved

    Returns
    -------
    GridField of the same size

    Raises
    ------
    InvalidInput
        For an unknown representation.
    """
    finer = choose(_FINER, representation, "representation")
    for _ in range(times):
        gap = finer(gap)
    return gap
