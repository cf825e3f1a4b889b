"""The letter's cascade of grids: each halves the spacing of the last and starts from its pressure.

On every grid the network equations Σ_b c_ab (p_b - p_a) = 0 of `solver` are relaxed. On a coarse
grid a cell is a block of samples, and its conductivity K that of their Bruggeman medium,

    mean over the block of (g³ - K)/(g³ + K) = 0,

and c_ab puts the halves of two neighbouring cells in series. The pressure is interpolated to the
next grid and relaxed again, down to the samples themselves (W. B. Dapp et al., Phys. Rev. Lett.
108, 244301 (2012)).

The relaxation, `relax`, is conjugate gradients with Jacobi scaling. The equations are A p = b on
the free nodes a, where A is the matrix of the network, D its diagonal, and b comes from p = 1 at
the inlet and p = 0 at the outlet. Each step of the method of M. R. Hestenes and E. Stiefel, J. Res.
Nat. Bur. Stand. 49, 409 (1952)

    α = (r·z)/(d·A d),   p += α d,   r -= α A d,   z = D⁻¹ r,   d = z + (r·z)/(r·z)_before d

lowers the energy Σ c (Δp)² by α (r·z). It shares no code with `elimination`, which is exact to
rounding also near percolation, where the relaxation takes very many steps or raises NotConverged.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.finite_difference.stencil import FlowGrid, Network
from fem_seal.theory.bruggeman import effective_conductivity

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
    decreases: tuple[float, ...]  #: of the energy, in each step of conjugate gradients

    @property
    def iterations(self) -> int:
        """Steps of conjugate gradients."""
        return len(self.decreases)

    @property
    def residuals(self) -> tuple[float, ...]:
        """Decrease of the energy in each step, over the energy after the last one."""
        return tuple(decrease / self.energy for decrease in self.decreases)


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
    decreases: list[float] = []
    state = _state(network, pressure, carrying, decreases)
    for step in range(1, limit + 1):
        if rz <= exhausted:
            return _state(network, pressure, carrying, decreases)
        Ad = A @ d
        alpha = rz / float(d @ Ad)
        p[free] += alpha * d
        r -= alpha * Ad
        z = r / D
        decreases.append(alpha * rz)
        rz, rz_before = float(r @ z), rz
        d = z + (rz / rz_before) * d
        if step >= DELAY and step % (DELAY // 4) == 0 and rz > 0:
            state = _state(network, pressure, carrying, decreases)
            conserved = abs(state.inflow - state.outflow) <= np.sqrt(tol) * state.energy
            if sum(decreases[-DELAY:]) <= tol * state.energy and conserved:
                return state
    raise NotConverged(
        f"Jacobi-scaled conjugate gradients: after {limit} steps the energy still falls by "
        f"{sum(decreases[-DELAY:]) / state.energy:.1e} of itself in {min(limit, DELAY)} steps "
        f"(tolerance {tol:.1e}), and inflow and outflow are {state.inflow:.6e} and "
        f"{state.outflow:.6e}; "
        "use cascade = False, which eliminates the nodes instead"
    )


def _state(
    network: Network, pressure: np.ndarray, carrying: np.ndarray, decreases: Sequence[float]
) -> Relaxed:
    """Energy and fluxes of a pressure after some steps."""
    both = carrying[:-1] & carrying[1:]
    flux = -np.where(both, network.x, 0.0) * np.diff(pressure, axis=0)
    total = grid_energy(network, pressure, carrying)
    return Relaxed(pressure, total, float(flux[0].sum()), float(flux[-1].sum()), tuple(decreases))


# Least number of cells along the shorter side of the coarsest grid.
COARSEST = 4
# Least conductivity of a cell over the largest one: cells with K = 0 need a pressure too.
CLOSED_BLOCK = 1e-6
# Tolerances of the effective conductivity and of the energy on the coarse grids; their pressure is
# only a first guess for the next grid.
BLOCK_RTOL = 1e-3
GUESS_TOL = 1e-6


@dataclass(frozen=True, eq=False)
class CoarseGrid:
    """Cells of a coarse grid, each a block of samples."""

    #: (cx, cy), effective conductivity of the cells, in units of the largest g³
    conductivity: np.ndarray
    edges_x: np.ndarray  #: (cx + 1,), ends of the cells along x [m]
    edges_y: np.ndarray  #: (cy + 1,), ends along y [m]
    periodic: bool  #: whether y = 0 and y = Ly are the same line

    def network(self) -> Network:
        """Links between the centres of neighbouring cells, and to the two ends."""
        K, dx, dy = self.conductivity, np.diff(self.edges_x), np.diff(self.edges_y)
        half_x = 0.5 * dx[:, None] / (K * dy)
        half_y = 0.5 * dy / (K * dx[:, None])
        x = 1 / np.concatenate([half_x[:1], half_x[:-1] + half_x[1:], half_x[-1:]])
        next_y = np.roll(half_y, -1, axis=1) if self.periodic else half_y[:, 1:]
        y = 1 / ((half_y if self.periodic else half_y[:, :-1]) + next_y)
        return Network(x, np.pad(y, ((1, 1), (0, 0))), self.periodic)

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates of the nodes along x, with the two ends, and along y [m]."""
        centres_x, centres_y = (0.5 * (e[:-1] + e[1:]) for e in (self.edges_x, self.edges_y))
        return np.concatenate([self.edges_x[:1], centres_x, self.edges_x[-1:]]), centres_y


def coarse_grid(grid: FlowGrid, block: int) -> CoarseGrid:
    """Group the samples of a gap into blocks, each a cell of Bruggeman's effective medium.

    A block has `block` samples along its side; the last ones may be smaller.
    """
    sites = grid.sites
    cubes = (sites.gap / sites.gap.max()) ** 3
    nx, ny = (-(-n // block) for n in cubes.shape)
    padded = np.full((nx * block, ny * block), np.nan)
    padded[: cubes.shape[0], : cubes.shape[1]] = cubes
    samples = padded.reshape(nx, block, ny, block).transpose(0, 2, 1, 3).reshape(nx, ny, -1)
    present = np.isfinite(samples)
    K = effective_conductivity(
        np.where(present, samples, 0.0), weights=present.astype(float), rtol=BLOCK_RTOL
    )
    K = np.maximum(K, CLOSED_BLOCK * K.max()) if K.any() else np.ones(K.shape)
    return CoarseGrid(
        K, _block_edges(grid, 0, block), _block_edges(grid, 1, block), sites.periodic[1]
    )


def _block_edges(grid: FlowGrid, axis: int, block: int) -> np.ndarray:
    """Coordinates [m] of the sides of the blocks; a vertex on the boundary covers half a pixel."""
    count, spacing = grid.sites.gap.shape[axis], grid.sites.spacing[axis]
    first = grid.sites.origin[axis] - 0.5 * spacing
    edges = first + spacing * np.append(np.arange(0, count, block), count)
    return edges if grid.sites.periodic[axis] else np.clip(edges, 0.0, grid.size[axis])


def first_guess(grid: FlowGrid) -> np.ndarray:
    """Pressure (mx, my), from 1 to 0, of the cascade on the finest grid before it is relaxed."""
    sites = grid.sites
    period = grid.size[1] if sites.periodic[1] else None
    x, y, pressure = grid.nodes_x[[0, -1]], np.zeros(1), np.array([[1.0], [0.0]])
    levels = max(0, int(np.log2(min(sites.gap.shape) / COARSEST)))
    for level in range(levels, 0, -1):
        coarse = coarse_grid(grid, 2**level)
        guess = _interpolate(x, y, pressure, *coarse.nodes(), period)
        everywhere = np.ones(guess.shape, dtype=bool)
        pressure = relax(coarse.network(), everywhere, guess, GUESS_TOL).pressure
        x, y = coarse.nodes()
    nodes_y = sites.origin[1] + sites.spacing[1] * np.arange(sites.gap.shape[1])
    return _interpolate(x, y, pressure, grid.nodes_x, nodes_y, period)


def _interpolate(
    x: np.ndarray,
    y: np.ndarray,
    values: np.ndarray,
    new_x: np.ndarray,
    new_y: np.ndarray,
    period: float | None,
) -> np.ndarray:
    """Bilinear interpolation from nodes (x, y); constant beyond the outer y unless periodic."""
    along_x = np.array([np.interp(new_x, x, column) for column in values.T])
    return np.array([np.interp(new_y, y, row, period=period) for row in along_x.T])
