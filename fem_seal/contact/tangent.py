"""How the gap of an elastic contact changes with the fluid's pressure on the solid.

While the samples in contact stay the same, a change v of the fluid's pressure changes the gap by
δg, with the stiffness M of the solid:

    M δg = v  on the open samples,    δg = 0  in contact

No equation is needed for the load: M annihilates constants, and δg = 0 in contact fixes the level.
Without contact only a prescribed mean gap fixes it, and the solid is displaced freely.
"""

from functools import partial

import numpy as np

from fem_seal.contact.blocks import product
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.errors import NotConverged

MOST_ITERATIONS = 300


class ContactTangent:
    """The derivative of the gap by the fluid's pressure; it is symmetric, its own transpose.

    Parameters
    ----------
    solid
        The solid on the grid of the contact.
    stiffness
        Pressure that the unit of `solid.pressure` stands for, per displacement [Pa/m].
    opened : (nx, ny)
        Samples that are not in contact.
    mean_gap_held
        Whether the mean gap is prescribed in place of the load.
    """

    def __init__(
        self,
        solid: HalfSpace,
        stiffness: float,
        opened: np.ndarray,
        mean_gap_held: bool = False,
    ):
        self._solid, self._stiffness, self._opened = solid, stiffness, opened
        #: relative residuals of each solve, step by step
        self.residuals: list[list[float]] = []
        # Change of the gap with a uniform pressure, of which a held mean gap leaves nothing.
        self._uniform: np.ndarray | None = None
        if mean_gap_held and opened.any() and not opened.all():
            self._uniform = self._inverse(np.ones(opened.shape), 1e-6)

    def change(self, pressure: np.ndarray, tolerance: float) -> np.ndarray:
        """Change of the gap (nx, ny) [m] with a change of the fluid's pressure [Pa].

        Parameters
        ----------
        pressure : (nx, ny)
        tolerance
            Relative residual at which the conjugate gradients stop.
        """
        if self._opened.all():
            return self._solid.displacement(pressure / self._stiffness).copy()
        moved = self._inverse(pressure, tolerance)
        if self._uniform is not None:
            moved -= moved.sum() / self._uniform.sum() * self._uniform
        return moved

    def _inverse(self, pressure: np.ndarray, tolerance: float) -> np.ndarray:
        """Solve M δg = v on the open samples by conjugate gradients.

        The preconditioner is the compliance; a uniform pressure counts as soft as the softest wave.
        It only steers the iteration, in the precision of that. Passes over the arrays go block by
        block.
        """
        opened, solid = self._opened, self._solid
        passes, shape, count = solid.passes, opened.shape, opened.size
        moved, left, direction = np.zeros(shape), np.empty(shape), np.zeros(shape)
        unit = float(np.abs(pressure).max())  # so that no value leaves single precision
        if unit == 0:
            return moved

        def begin(rows: slice) -> np.ndarray:
            """Residual at the start, and its sums."""
            np.multiply(pressure[rows], opened[rows] / unit, out=left[rows])
            return _sums(left[rows], solid.steer.values[rows])

        def soften(level: float, rows: slice) -> float:
            """Preconditioned residual, and its product with the residual."""
            soft = solid.steer.values[rows]
            soft += level
            soft *= opened[rows]
            return product(left[rows], soft)

        def turn(beta: float, rows: slice) -> None:
            """Next direction, conjugate to the last one."""
            direction[rows] *= beta
            direction[rows] += solid.steer.values[rows]
            solid.exact.values[rows] = direction[rows]

        def resist(rows: slice) -> float:
            """Energy of the direction."""
            return product(direction[rows], solid.exact.values[rows])

        def advance(alpha: float, rows: slice) -> np.ndarray:
            """Step along the direction, the residual after it, and its sums."""
            moved[rows] += (alpha * unit / self._stiffness) * direction[rows]
            resisted = solid.exact.values[rows]
            resisted *= opened[rows]
            resisted *= alpha
            left[rows] -= resisted
            return _sums(left[rows], solid.steer.values[rows])

        total, square = np.sum(passes.over(shape, begin), axis=0)
        first, softened = square, np.inf
        if first == 0:
            return moved
        history: list[float] = []
        self.residuals.append(history)
        for _ in range(MOST_ITERATIONS):
            solid.displace_in_steer()
            level = total / count / solid.softest
            softened, before = sum(passes.over(shape, partial(soften, level))), softened
            passes.over(shape, partial(turn, softened / before))
            solid.stiffen()
            alpha = softened / sum(passes.over(shape, resist))
            total, square = np.sum(passes.over(shape, partial(advance, alpha)), axis=0)
            history.append((square / first) ** 0.5)
            if history[-1] <= tolerance:
                return moved
        raise NotConverged(
            f"change of the contact with the fluid's pressure: residual {history[-1]:.1e} after "
            f"{MOST_ITERATIONS} iterations (wanted {tolerance:.1e})"
        )


def _sums(block: np.ndarray, copy: np.ndarray) -> np.ndarray:
    """Copy a block; return the sums of its values and of their squares."""
    copy[...] = block
    return np.array([block.sum(), product(block, block)])
