"""Leak rate by finite differences, the answer to hold the finite elements against."""

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.finite_difference.cascade import first_guess
from fem_seal.finite_difference.elimination import conductance
from fem_seal.finite_difference.relaxation import relax
from fem_seal.finite_difference.stencil import FlowGrid, flow_grid
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.topology.percolation import is_sealed

METHOD = "finite-difference"
LEAST_SIZE = 1e-200  # of K Δp, m³/s; leaves a hundred decades for narrow passages


def solve(
    gap: GridField,
    *,
    viscosity: float,
    pressure_drop: float,
    sides: str,
    representation: str = "linear",
    links: str = "linear-gap",
    tol: float = 1e-8,
    cascade: bool = False,
) -> LeakRate:
    """Solve ∇·(g³/12η ∇p) = 0 by central differences on the gap's samples.

    Parameters
    ----------
    gap : gap in metres, zero in contact; the fluid flows along the first axis
    viscosity : η [Pa s], > 0
    pressure_drop : Δp from inlet to outlet [Pa], > 0
    sides : "wall" or "periodic"
    representation : "linear" (nodes at the vertices) or "constant" (at the pixels' centres)
    links : mean of the cubed gap between two nodes, one of `links.LINKS`; "linear-gap" is exact
        for a linear gap in series, "harmonic" for a stepwise one
    tol : relative tolerance of the leak rate where it is iterated, that is with the cascade
    cascade : False: eliminate the nodes, right to rounding at any contrast. True: the letter's
        cascade of grids, each relaxed from the coarser one's pressure.

    Returns
    -------
    LeakRate without bounds; sealed gaps are reported without a solve. `converged` is False where
    the gap is open only along a diagonal of its triangulation, which no link follows.

    Raises
    ------
    InvalidInput
        For values out of range or unknown choices.
    NotConverged
        If the relaxation does not reach `tol`.

    References
    ----------
    W. B. Dapp, A. Lücke, B. N. J. Persson, M. H. Müser, Phys. Rev. Lett. 108, 244301 (2012).
    """
    positive = {"viscosity": viscosity, "pressure_drop": pressure_drop, "tol": tol}
    for name, value in positive.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(f"{name} must be a positive number, got {value}")
    if is_sealed(gap, sides, representation):
        return LeakRate.sealed(METHOD)
    _check_size(float(gap.values.max()), viscosity, pressure_drop)
    grid = flow_grid(gap, viscosity, sides, representation, links)
    if not grid.carrying.any():
        return LeakRate(
            state="leaking",
            method=METHOD,
            value=0.0,
            converged=False,
            reason="the gap is open only along diagonals of its triangulation, which the "
            "five-point stencil does not follow; sample it finer",
        )
    if cascade:
        return _relaxed(grid, pressure_drop, tol)
    return _eliminated(grid, pressure_drop)


def _check_size(highest: float, viscosity: float, pressure_drop: float) -> None:
    """InvalidInput if the leak rate of a square as high as the largest gap [m] is no number."""
    with np.errstate(over="ignore", under="ignore"):
        size = np.float64(highest) ** 3 / (12 * viscosity) * pressure_drop
    if not LEAST_SIZE < size < 1 / LEAST_SIZE:
        raise InvalidInput(
            f"a gap of {highest:.1e} m at {viscosity:.1e} Pa s and {pressure_drop:.1e} Pa has a "
            "leak rate beyond double precision; check the units"
        )


def _eliminated(grid: FlowGrid, pressure_drop: float) -> LeakRate:
    """Eliminate all nodes; conservation is built in, as one conductance joins the two ends."""
    flux = conductance(grid.network) * pressure_drop
    return LeakRate(
        state="leaking",
        method=METHOD,
        value=flux,
        unknowns=grid.unknowns,
        inflow=flux,
        outflow=flux,
    )


def _relaxed(grid: FlowGrid, pressure_drop: float, tol: float) -> LeakRate:
    """Take the dissipation for the leak rate: its error is the square of the pressure's."""
    state = relax(grid.network, grid.carrying, first_guess(grid), tol)
    return LeakRate(
        state="leaking",
        method=METHOD,
        value=state.energy * pressure_drop,
        unknowns=grid.unknowns,
        inflow=state.inflow * pressure_drop,
        outflow=state.outflow * pressure_drop,
    )
