"""Data of each cell for the primal and the dual problem: averages, contact, resistivity."""

from dataclasses import dataclass

import numpy as np

from fem_seal.film.law import CUBE, FilmLaw
from fem_seal.flow import traces

ISOTROPIC = np.array([1.0, 0.0, 1.0])  # the unit tensor: xx, xy, yy


@dataclass(frozen=True, eq=False)
class CellContact:
    """Contact as each of C cells sees it."""

    #: (C, 3) bool, zero-gap sides (opposite each corner): the gap is zero along the whole side
    zero_gap: np.ndarray
    blocked: np.ndarray  #: (C,) bool, blocked cells: the stream function must be constant in them
    #: (C, 3) bool, contact vertices: corners from which the stream function rises as a power
    contact_vertex: np.ndarray
    #: (C,) bool, cells so conductive that the pressure is taken to be constant in each
    equipotential: np.ndarray


@dataclass(frozen=True, eq=False)
class CellData(CellContact):
    """Data of C cells for the primal and the dual problem."""

    K: np.ndarray  #: (C,), mean of the conductivity; zero where the whole cell is contact
    resistivity: np.ndarray  #: (C, 3), tensor xx, xy, yy of the dual problem; zero where `blocked`

    @classmethod
    def of_gaps(
        cls,
        xy: np.ndarray,
        aspect: np.ndarray | float,
        gaps: np.ndarray,
        linear: np.ndarray | np.bool_,
        means: tuple[np.ndarray, np.ndarray],
        ceiling: float,
        law: FilmLaw = CUBE,
    ) -> "CellData":
        """Data of n cells from the gap at their corners.

        Parameters
        ----------
        xy, aspect
            Coordinates (3, n, 2) of the corners, and the factors that scale x and y.
        gaps : (3, n, 2)
            Gap at the corners, raised for the primal and lowered for the dual.
        linear : (n,) bool
            Cells on which the gap is linear; one bool for all.
        means
            Pair of (n,), means of the conductivity and of its inverse.
        ceiling
            Gap with the largest conductivity in the dual.
        """
        (raised, lowered), (mean_K, mean_inverse_K) = np.moveaxis(gaps, -1, 0), means
        zero, contact = (raised == 0) & linear, (lowered == 0) & linear
        zero_gap = zero[[1, 2, 0]] & zero[[2, 0, 1]]
        # Beside gaps of 0 the mean is infinite; that of tiny gaps leaves double precision.
        blocked = contact.all(axis=0) | (np.isinf(mean_inverse_K) & ~contact.any(axis=0))
        most = law.upper.of_gap(ceiling)
        limited = np.maximum(mean_inverse_K, 1 / most)
        tensor = traces.resistivity(xy, aspect, lowered, contact, limited, law.lower)
        # Elsewhere the resistivity R has become max(R, 1/most). Cells at contact vertices have a
        # tensor, that of the power traces: add 1/most, since max(R, 1/most) <= R + 1/most.
        tensor[contact.any(axis=0) & ~blocked] += ISOTROPIC / most
        return cls(
            zero_gap=zero_gap.T,
            blocked=blocked,
            contact_vertex=contact.T,
            equipotential=most < mean_K,
            K=mean_K,
            resistivity=tensor,
        )

    def subset(self, cells: np.ndarray | slice) -> "CellData":
        """Data of the cells of a mask (C,), of indices or of a slice."""
        return CellData(*(array[cells] for array in vars(self).values()))

    def regularised(self, chi: float, cut: float) -> np.ndarray:
        """Resistivity R_χ (C, 3): in blocked cells 1/(χ K) is added, elsewhere it is unchanged.

        The cube of `cut`, that of the gap, is the smallest K that counts: without it the contrast
        makes CG break down on fine meshes.
        """
        conducted = chi * np.maximum(self.K, cut**3)
        # Cells with K = 0 and cut = 0 carry no flow and are in neither problem.
        added = np.divide(self.blocked, conducted, out=np.zeros_like(self.K), where=conducted > 0)
        return self.resistivity + added[:, None] * ISOTROPIC

    def without_values(self) -> CellContact:
        """The contact without the averages, whose memory can be freed."""
        return CellContact(self.zero_gap, self.blocked, self.contact_vertex, self.equipotential)
