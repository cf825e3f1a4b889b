"""The same gap on a grid twice as fine: what every method must converge on to one number."""

from collections.abc import Callable

import numpy as np

from fem_seal.grid import GridField
from fem_seal.topology.lattice import choose


def _linear(gap: GridField) -> np.ndarray:
    """Halve the squares of the pixel triangulation; its alternating diagonals are kept."""
    v = gap.vertices()
    fine = np.empty((2 * v.shape[0] - 1, 2 * v.shape[1] - 1))
    fine[::2, ::2] = v
    fine[1::2, ::2] = 0.5 * (v[:-1] + v[1:])
    fine[::2, 1::2] = 0.5 * (v[:, :-1] + v[:, 1:])
    i, j = np.indices((v.shape[0] - 1, v.shape[1] - 1))
    rising, falling = v[:-1, :-1] + v[1:, 1:], v[1:, :-1] + v[:-1, 1:]
    fine[1::2, 1::2] = 0.5 * np.where((i + j) % 2 == 0, rising, falling)
    return fine[:-1, :-1] if gap.periodic else fine


def _constant(gap: GridField) -> np.ndarray:
    """Cut each square pixel into four of the same gap."""
    return gap.values.repeat(2, axis=0).repeat(2, axis=1)


_FINER: dict[str, Callable[[GridField], np.ndarray]] = {"linear": _linear, "constant": _constant}


def refined(gap: GridField, representation: str, times: int = 1) -> GridField:
    """Sample the gap as represented on a grid 2^times as fine; not a digit of it changes.

    Parameters
    ----------
    gap : gap [m]
    representation : "linear" (linear on the alternating triangles) or "constant" (square pixels)
    times : how often the spacing is halved

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
        gap = GridField(finer(gap), tuple(0.5 * s for s in gap.spacing), gap.periodic)
    return gap
