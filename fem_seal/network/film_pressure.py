"""The fluid's pressure in a film that conducts a little where there is contact, and its tangent.

    ∇·(c³ ∇u) = 0 on the whole patch,    c³ = k(g) + ε³,    u = 1 at the inlet, 0 at the outlet

with k = g³ for a liquid. Since c > 0 everywhere, u is a smooth function of the gap, under contact
and in pockets as well. With the incidence matrix B of the network, its conductances C(c) and the
matrix A = Bᵀ C B of the free nodes, a change of the gap changes the pressure by

    A δu = -Bᵀ (C' δc) B u

with the matrix and the preconditioner of the flow itself.
"""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fem_seal.errors import NotConverged
from fem_seal.finite_difference.stencil import laplacian
from fem_seal.network.network import Network

# Right side and relative tolerance -> solution.
Solve = Callable[[np.ndarray, float], np.ndarray]
Solver = Callable[[sparse.csr_array], Solve]
PRESSURE_TOLERANCE = 1e-6  # relative tolerance of the pressure


def eliminated(matrix: sparse.csr_array) -> Solve:
    """Solver of a symmetric matrix by elimination, exact at any tolerance."""
    try:
        factors = splu(
            sparse.csc_matrix(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:  # SciPy's of a singular matrix
        raise NotConverged(
            "the fluid's pressure cannot be solved: its conductances are so far apart that the "
            "matrix is singular in double precision"
        ) from error
    return lambda right_side, tolerance: factors.solve(right_side)


class FilmPressure:
    """Pressure u of one film on the samples of a contact, from 1 at the inlet to 0 at the outlet.

    Parameters
    ----------
    network
        The network.
    conducting : (nx, ny)
        Gap c > 0 that conducts as the film does, at the samples [m].
    slope : (nx, ny)
        Derivative of c by the gap between the solids.
    solver
        Makes a solver of the matrix of the free nodes.
    """

    def __init__(
        self,
        network: Network,
        conducting: np.ndarray,
        slope: np.ndarray,
        solver: Solver,
    ):
        self._network, self._slope = network, slope
        self._unit = float(conducting.max())
        places = network.to_places @ (conducting.ravel() / self._unit)
        links, self._by_places = network.conductances(places), network.conductances_by_gap(places)
        a, b = network.ends
        matrix = laplacian(a, b, links, len(network.free))[network.free]
        self._solve = solver(sparse.csr_array(matrix[:, network.free]))
        u = network.inlet.astype(float)
        u[network.free] = self._solve(-(matrix @ u), PRESSURE_TOLERANCE)
        self._links, self._u, self._drop, self._places = links, u, u[a] - u[b], places
        self.on_samples = np.clip(self._to_samples(u), 0.0, 1.0)  #: (nx, ny)
        self.dissipation = links * self._drop**2  #: (links,), in a unit of its own
        one, other = places[network.between]
        #: (legs,), square of (c - c')/(c + c') with the gaps c, c' at the two places of each leg
        self.varies = ((one - other) / (one + other)) ** 2

    @property
    def conductance(self) -> float:
        """Leak rate per pressure drop, times 12 η [m³]."""
        return float(self.dissipation.sum()) * self._unit**3

    @cached_property
    def log_rate_by_gap(self) -> np.ndarray:
        """Derivative (nx, ny) of the logarithm of the leak rate by the gap at the samples [1/m]."""
        return self._by_gap(self._drop**2) / (self.dissipation.sum() * self._unit)

    def change(self, gap: np.ndarray, tolerance: float) -> np.ndarray:
        """Change of u (nx, ny) with one of the gap (nx, ny) [m], to a relative tolerance."""
        network = self._network
        moved = network.to_places @ (self._slope * gap).ravel() / self._unit
        flux = (self._by_places @ moved) * self._drop
        (a, b), nodes = network.ends, len(network.free)
        inflow = np.bincount(b, flux, nodes) - np.bincount(a, flux, nodes)
        return self._to_samples(self._solved(inflow, tolerance))

    def transposed(self, weight: np.ndarray, tolerance: float) -> np.ndarray:
        """Transpose of `change`: derivative by the gap [1/m] of Σ weight u, all (nx, ny)."""
        adjoint, (a, b) = self._adjoint(weight, tolerance), self._network.ends
        return self._by_gap((adjoint[b] - adjoint[a]) * self._drop) / self._unit

    def by_parts(self, weight: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
        """How much each part of the network may change Σ weight u: sizes, to first order.

        Returns
        -------
        (links,)
            Change of the sum with the logarithm of the conductance of each link.
        (C,)
            Change if each triangle also conducted what it does along its longest side, beside its
            legs (`Network.past_legs`).
        """
        adjoint, network = self._adjoint(weight, tolerance), self._network
        a, b = network.ends
        by_links = np.abs(self._links * self._drop * (adjoint[a] - adjoint[b]))
        _, a, b = network.mesh.twin[network.mesh.cells].T
        fluxes = network.past_legs(self._places) * (self._u[a] - self._u[b])
        return by_links, np.abs(fluxes * (adjoint[a] - adjoint[b]))

    def lost_with(self, gap: np.ndarray) -> float:
        """Part of the leak rate that is lost with a smaller gap (nx, ny) [m], to first order."""
        network = self._network
        links = network.conductances(network.to_places @ (gap.ravel() / self._unit))
        return 1 - float(links @ self._drop**2) / float(self.dissipation.sum())

    def _adjoint(self, weight: np.ndarray, tolerance: float) -> np.ndarray:
        """Solution at the nodes with the weights as sources."""
        return self._solved(self._network.to_samples.T @ weight.ravel(), tolerance)

    def _solved(self, inflow: np.ndarray, tolerance: float) -> np.ndarray:
        """Pressure of all nodes with an inflow into the free ones, 0 at the others."""
        u, free = np.zeros(len(inflow)), self._network.free
        u[free] = self._solve(inflow[free], tolerance)
        return u

    def _by_gap(self, by_links: np.ndarray) -> np.ndarray:
        """Derivative by the gap at the samples from that by the conductances of the links."""
        network = self._network
        by_samples: np.ndarray = network.to_places.T @ (self._by_places.T @ by_links)
        return by_samples.reshape(network.film.gap.shape) * self._slope

    def _to_samples(self, of_nodes: np.ndarray) -> np.ndarray:
        at_samples: np.ndarray = self._network.to_samples @ of_nodes
        return at_samples.reshape(self._network.film.gap.shape)
