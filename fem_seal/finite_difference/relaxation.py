"""Relaxation of the pressure on the grid: conjugate gradients with Jacobi scaling.

Simple and its own code path. Near percolation it needs very many steps or fails, and says so;
`elimination` does not.
"""

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.finite_difference.stencil import Network

if TYPE_CHECKING:
    from scipy import sparse

# Energy decreases summed over this many steps estimate the error left before them (G. H. Golub,
# Z. Strakoš, Numer. Algorithms 8, 241 (1994)); long, because Jacobi scaling has plateaus.
DELAY = 100
# Steps allowed for each node along the flow and across it together.
STEPS_PER_NODE = 100
# Where few nodes are left the recursion ends at the exact pressure long before DELAY steps; its
# residual then falls on until it underflows. Rounding left it behind 170 decades before.
EXHAUSTED = 1e-200


@dataclass(frozen=True, eq=False)
class Relaxed:
    """A relaxed pressure and how it was reached.

    pressure : (mx, my) float, 1 at the inlet, 0 at the outlet
    energy : dissipation at unit pressure drop, which is the leak rate's conductance
    inflow, outflow : flux through inlet and outlet at unit pressure drop
    iterations : steps of conjugate gradients
    """

    pressure: np.ndarray
    energy: float
    inflow: float
    outflow: float
    iterations: int


def energy(network: Network, pressure: np.ndarray, carrying: np.ndarray) -> float:
    """Dissipation of a pressure field, the sum of c (Δp)² over the carrying links.

    Parameters
    ----------
    network : links
    pressure : (mx, my) float
    carrying : (mx, my) bool, nodes joined to both ends

    Returns
    -------
    float; never below the conductance if the pressure is 1 at the inlet and 0 at the outlet
    (Dirichlet's principle).
    """
    along_x, along_y = _links_between(network, carrying)
    drop_x, drop_y = np.diff(pressure, axis=0), _differences_y(network, pressure)
    return float((along_x * drop_x**2).sum() + (along_y * drop_y**2).sum())


def relax(
    network: Network,
    carrying: np.ndarray,
    start: np.ndarray,
    tol: float,
    max_iterations: int | None = None,
) -> Relaxed:
    """Solve for the pressure from a given start.

    Parameters
    ----------
    network : links
    carrying : (mx, my) bool, nodes joined to both ends
    start : (mx, my) float, first guess; its first and last rows are set to 1 and 0
    tol : relative tolerance of the energy; inflow and outflow then agree to sqrt(tol)
    max_iterations : STEPS_PER_NODE (mx + my) if left out

    Returns
    -------
    Relaxed

    Raises
    ------
    NotConverged
        If the tolerance is not met within the steps allowed.
    """
    mx, my = network.shape
    allowed = STEPS_PER_NODE * (mx + my) if max_iterations is None else max_iterations
    pressure = np.array(start, dtype=float)
    pressure[0], pressure[-1] = 1.0, 0.0
    matrix, free = _laplacian(network, carrying), _free_nodes(carrying)
    p = pressure.ravel()
    inner = matrix[free][:, free]
    diagonal = inner.diagonal()
    residual = -(matrix @ np.where(carrying.ravel(), p, 0.0))[free]
    scaled = residual / diagonal
    direction, norm = scaled.copy(), float(residual @ scaled)
    exhausted = EXHAUSTED * norm
    decreases: deque[float] = deque(maxlen=DELAY)
    state = _state(network, pressure, carrying, 0)
    for step in range(1, allowed + 1):
        if norm <= exhausted:
            return _state(network, pressure, carrying, step - 1)
        image = inner @ direction
        length = norm / float(direction @ image)
        p[free] += length * direction
        residual -= length * image
        scaled = residual / diagonal
        decreases.append(length * norm)
        norm, previous = float(residual @ scaled), norm
        direction = scaled + (norm / previous) * direction
        if len(decreases) == DELAY and step % (DELAY // 4) == 0 and norm > 0:
            state = _state(network, pressure, carrying, step)
            if sum(decreases) <= tol * state.energy and _conserves(state, np.sqrt(tol)):
                return state
    raise _not_converged(state, allowed, sum(decreases), len(decreases), tol)


def _not_converged(
    state: Relaxed, allowed: int, decrease: float, steps: int, tol: float
) -> NotConverged:
    """Say how far from its tolerance the relaxation is; `decrease` of the last `steps` steps."""
    return NotConverged(
        f"Jacobi-scaled conjugate gradients: after {allowed} steps the energy still falls by "
        f"{decrease / state.energy:.1e} of itself in {steps} steps (wanted {tol:.1e}) and inflow "
        f"and outflow are {state.inflow:.6e} and {state.outflow:.6e}; use cascade = False, which "
        "eliminates the nodes instead"
    )


def _conserves(state: Relaxed, rtol: float) -> bool:
    return abs(state.inflow - state.outflow) <= rtol * state.energy


def _state(network: Network, pressure: np.ndarray, carrying: np.ndarray, steps: int) -> Relaxed:
    along_x, _ = _links_between(network, carrying)
    flux = -along_x * np.diff(pressure, axis=0)
    total = energy(network, pressure, carrying)
    return Relaxed(pressure, total, float(flux[0].sum()), float(flux[-1].sum()), steps)


def _links_between(network: Network, carrying: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Conductances along x and y with the links of other nodes closed."""
    along_x = np.where(carrying[:-1] & carrying[1:], network.x, 0.0)
    if network.periodic:
        return along_x, np.where(carrying & np.roll(carrying, -1, axis=1), network.y, 0.0)
    return along_x, np.where(carrying[:, :-1] & carrying[:, 1:], network.y, 0.0)


def _differences_y(network: Network, field: np.ndarray) -> np.ndarray:
    if network.periodic:
        return np.roll(field, -1, axis=1) - field
    return np.diff(field, axis=1)


def _free_nodes(carrying: np.ndarray) -> np.ndarray:
    """Flat numbers of the nodes whose pressure is unknown."""
    inner = carrying.copy()
    inner[[0, -1]] = False
    return np.flatnonzero(inner)


def _laplacian(network: Network, carrying: np.ndarray) -> "sparse.csr_matrix":
    """Matrix of the network on all nodes: row sums zero, no entry for closed links."""
    from scipy import sparse

    number = np.arange(carrying.size).reshape(carrying.shape)
    along_x, along_y = _links_between(network, carrying)
    beyond_y = np.roll(number, -1, axis=1) if network.periodic else number[:, 1:]
    before_y = number if network.periodic else number[:, :-1]
    a = np.concatenate([number[:-1].ravel(), before_y.ravel()])
    b = np.concatenate([number[1:].ravel(), beyond_y.ravel()])
    c = np.concatenate([along_x.ravel(), along_y.ravel()])
    a, b, c = a[c > 0], b[c > 0], c[c > 0]
    ones = (number.size, number.size)
    links = sparse.coo_matrix((np.tile(c, 2), (np.r_[a, b], np.r_[b, a])), shape=ones).tocsr()
    return sparse.diags(np.asarray(links.sum(axis=1)).ravel()) - links
