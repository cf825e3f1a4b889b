"""How the gap of an elastic contact changes with the fluid's pressure on the solid.

While the samples in contact stay the same, a change v of the fluid's pressure changes the gap by
δg, with the stiffness M of the solid:

    M δg = v  on the open samples,    δg = 0  in contact

No equation is needed for the load: M annihilates constants, and δg = 0 in contact fixes the offset.
Without contact only a prescribed mean gap fixes it, and the solid is displaced freely.
"""

from collections.abc import Iterator
from functools import partial
from itertools import islice

import numpy as np

from fem_seal.contact.blocks import product
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.digits import number_of
from fem_seal.errors import NotConverged

# To a residual of 1e-6 rough contacts (H 0.2 to 0.8, 1 to 90 % of contact) take 14 iterations at
# 128² and 31 at 1024², and 51 at worst: 1.4 times as many for each doubling, 100 at 4096².
MOST_CG = 300
UNIFORM_TOLERANCE = 1e-6  # the smallest with which a change is asked for, by `sensitivity`


class ContactTangent:
    """The derivative of the gap by the fluid's pressure; it is symmetric, its own transpose.

    Parameters
    ----------
    half_space
        The solid on the grid of the contact.
    stiffness
        Pressure that the unit of `half_space.pressure` stands for, per displacement [Pa/m].
    opened : (nx, ny)
        Samples that are not in contact.
    mean_gap_held
        Whether the mean gap is prescribed in place of the load.
    """

    def __init__(
        self,
        half_space: HalfSpace,
        stiffness: float,
        opened: np.ndarray,
        mean_gap_held: bool = False,
    ):
        self._half_space, self._stiffness, self._opened = half_space, stiffness, opened
        # Change of the gap with a uniform pressure, of which a held mean gap leaves nothing.
        self._uniform: np.ndarray | None = None
        if mean_gap_held and opened.any() and not opened.all():
            self._uniform = self._inverse(np.ones(opened.shape), UNIFORM_TOLERANCE)

    def change(self, pressure: np.ndarray, tolerance: float) -> np.ndarray:
        """Change of the gap (nx, ny) [m] with a change of the fluid's pressure [Pa].

        Parameters
        ----------
        pressure : (nx, ny)
        tolerance
            Relative residual at which the conjugate gradients stop.
        """
        if self._opened.all():
            return self._half_space.displacement(pressure / self._stiffness).copy()
        change = self._inverse(pressure, tolerance)
        if self._uniform is not None:
            change -= change.sum() / self._uniform.sum() * self._uniform
        return change

    def _inverse(self, pressure: np.ndarray, tolerance: float) -> np.ndarray:
        """Change (nx, ny) [m] of the open samples that M turns into a pressure [Pa] on them."""
        change, residuals = np.zeros(self._opened.shape), [1.0]
        for residual in islice(self._solving(pressure, change), MOST_CG):
            residuals.append(residual)
            if residual <= tolerance:
                return change
        raise NotConverged(
            f"change of the contact with the fluid's pressure: residual {residuals[-1]:.1e} after "
            f"{number_of(len(residuals) - 1, 'iteration')} (wanted {tolerance:.1e}); try a smaller "
            "contact.tolerance"
        )

    def _solving(self, pressure: np.ndarray, change: np.ndarray) -> Iterator[float]:
        """Solve M δg = v on the open samples by preconditioned conjugate gradients, from δg = 0.

        Yields the relative residual after each iteration. With S the compliance, the inverse of M
        but for the mean, and 1_O the open samples:

            1   r = 1_O v
            2   z = 1_O (S r + <r>/k_min): a uniform pressure counts as soft as the softest wave
            3   β = <r, z>/<r_old, z_old>
            4   t = z + β t
            5   α = <r, z>/<t, M t>
            6   δg = δg + α t
            7   r = r - α 1_O M t

        z and M t are stored in the work arrays of the half-space; z only steers the iteration, in
        the precision of that. Passes over the arrays go block by block.
        """
        opened, solid, samples = self._opened, self._half_space, self._opened.size
        t, z, Mt = np.zeros(opened.shape), solid.steer.values, solid.exact.values
        # Of r, so that z fits into single precision.
        unit = float(np.abs(pressure).max()) or 1.0
        r = pressure * (opened / unit)  # 1

        def start(rows: slice) -> np.ndarray:
            """Sums of r and r², and a copy of r to z for S."""
            z[rows] = r[rows]
            return np.array([r[rows].sum(), product(r[rows], r[rows])])

        def precondition(mean: float, rows: slice) -> float:
            """Step 2, of z = S r; <r, z>."""
            z[rows] += mean
            z[rows] *= opened[rows]
            return product(r[rows], z[rows])

        def turn(beta: float, rows: slice) -> None:
            """Step 4, with a copy of t for M."""
            t[rows] *= beta
            t[rows] += z[rows]
            Mt[rows] = t[rows]

        def advance(alpha: float, rows: slice) -> np.ndarray:
            """Steps 6 and 7; `start` of the new r."""
            change[rows] += (alpha * unit / self._stiffness) * t[rows]
            Mt[rows] *= opened[rows]
            Mt[rows] *= alpha
            r[rows] -= Mt[rows]
            return start(rows)

        over = partial(solid.passes.over, opened.shape)
        sum_r, rr = np.sum(over(start), axis=0)
        rr_first, rz = rr, np.inf
        if rr_first == 0:
            yield 0.0
        while rr > 0:
            solid.displace_in_steer()
            mean = sum_r / samples / solid.softest
            rz_old, rz = rz, sum(over(partial(precondition, mean)))
            over(partial(turn, rz / rz_old))
            solid.stiffen()
            alpha = rz / solid.passes.product(t, Mt)  # 5
            if not alpha > 0:
                return  # by rounding: M is positive definite on the open samples
            sum_r, rr = np.sum(over(partial(advance, alpha)), axis=0)
            yield (rr / rr_first) ** 0.5
