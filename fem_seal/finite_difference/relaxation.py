"""Relaxation of the pressure on the grid: conjugate gradients with Jacobi scaling.

Solves Σ_b c_ab (p_b - p_a) = 0 at every free node a, that is A p = b on the free nodes, where A is
the matrix of the network and b comes from p = 1 at the inlet and p = 0 at the outlet. D is the
diagonal of A. Each step of the method of M. R. Hestenes and E. Stiefel, J. Res. Nat. Bur. Stand.
49, 409 (1952)

    α = (r·z)/(d·A d),   p += α d,   r -= α A d,   z = D⁻¹ r,   d = z + (r·z)/(r·z)_before d

lowers the energy Σ c (Δp)² by α (r·z). It is simple and shares no code with `elimination`. Near
percolation it needs very many steps or raises NotConverged; `elimination` is exact to rounding
there too.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.finite_difference.stencil import Network

# The decrease of the energy over this many steps estimates its error before them (G. H. Golub,
# Z. Strakoš, Numer. Algorithms 8, 241 (1994)). The steps are many because the decrease has plateaus
# with Jacobi scaling.
DELAY = 100
# Largest number of steps on a grid of mx × my nodes, over mx + my.
STEPS_PER_NODE = 100
# Stop if r·z has fallen by this factor, far below rounding. A few free nodes are solved exactly in
# fewer than DELAY steps; the recursive residual would then fall until it underflows.
EXHAUSTED = 1e-200


@dataclass(frozen=True, eq=False)
class Relaxed:
    """A pressure with its energy and fluxes, after some steps of conjugate gradients."""

    pressure: np.ndarray  #: (mx, my) float p, from 1 at the inlet to 0 at the outlet
    energy: float  #: dissipation at unit pressure drop, which is the conductance Q/Δp [m^3/(Pa s)]
    inflow: float  #: flux through the inlet at unit pressure drop [m^3/(Pa s)]
    outflow: float  #: flux through the outlet
    iterations: int  #: steps of conjugate gradients


def grid_energy(network: Network, pressure: np.ndarray, carrying: np.ndarray) -> float:
    """Dissipation Σ c_ab (p_a - p_b)² of a pressure field over the links that carry flow.

    At unit pressure drop [m³/(Pa s)]; at least the conductance if p is 1 at the inlet and 0 at the
    outlet (Dirichlet's principle).
    """
    p = np.where(carrying, pressure, 0.0).ravel()
    a, b, c = network.links()
    used = carrying.ravel()[a] & carrying.ravel()[b]
    return float((c * (p[a] - p[b]) ** 2).sum(where=used))


def relax(
    network: Network,
    carrying: np.ndarray,
    start: np.ndarray,
    tol: float,
    max_iterations: int | None = None,
) -> Relaxed:
    """Relax the pressure from a first guess, whose first and last row become 1 and 0.

    `carrying` nodes are joined to both ends; `tol` is the relative tolerance of the energy, so that
    inflow and outflow agree to sqrt(tol). There are at most STEPS_PER_NODE (mx + my) steps if no
    limit is given.
    """
    mx, my = network.shape
    limit = STEPS_PER_NODE * (mx + my) if max_iterations is None else max_iterations
    pressure = np.array(start, dtype=float)
    pressure[0], pressure[-1] = 1.0, 0.0
    matrix = network.laplacian(carrying)
    # The carrying nodes between the two ends, whose pressure is unknown.
    free = np.flatnonzero(carrying[1:-1]) + my
    p = pressure.ravel()
    A = matrix[free][:, free]
    D = A.diagonal()
    r = -(matrix @ np.where(carrying.ravel(), p, 0.0))[free]  # b - A p
    z = r / D
    d, rz = z.copy(), float(r @ z)
    exhausted = EXHAUSTED * rz
    decreases: deque[float] = deque(maxlen=DELAY)
    state = _state(network, pressure, carrying, 0)
    for step in range(1, limit + 1):
        if rz <= exhausted:
            return _state(network, pressure, carrying, step - 1)
        Ad = A @ d
        alpha = rz / float(d @ Ad)
        p[free] += alpha * d
        r -= alpha * Ad
        z = r / D
        decreases.append(alpha * rz)
        rz, rz_before = float(r @ z), rz
        d = z + (rz / rz_before) * d
        if len(decreases) == DELAY and step % (DELAY // 4) == 0 and rz > 0:
            state = _state(network, pressure, carrying, step)
            conserved = abs(state.inflow - state.outflow) <= np.sqrt(tol) * state.energy
            if sum(decreases) <= tol * state.energy and conserved:
                return state
    raise NotConverged(
        f"Jacobi-scaled conjugate gradients: after {limit} steps the energy still falls by "
        f"{sum(decreases) / state.energy:.1e} of itself in {len(decreases)} steps (tolerance "
        f"{tol:.1e}) and inflow and outflow are {state.inflow:.6e} and {state.outflow:.6e}; "
        "use cascade = False, which eliminates the nodes instead"
    )


def _state(network: Network, pressure: np.ndarray, carrying: np.ndarray, steps: int) -> Relaxed:
    """Energy and fluxes of a pressure after a number of steps."""
    both = carrying[:-1] & carrying[1:]
    flux = -np.where(both, network.x, 0.0) * np.diff(pressure, axis=0)
    total = grid_energy(network, pressure, carrying)
    return Relaxed(pressure, total, float(flux[0].sum()), float(flux[-1].sum()), steps)
