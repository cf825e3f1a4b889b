"""What the primal and the dual problem need to know of each cell of a mesh."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal.flow import traces
from fem_seal.mesh.grouping import parts
from fem_seal.mesh.nested import NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

_AT_ONCE = 1 << 13  # cells

ISOTROPIC = np.array([1.0, 0.0, 1.0])  # xx, xy, yy


@dataclass(frozen=True, eq=False)
class CellContact:
    """Where the contact is, seen from each cell (C cells).

    shut : (C, 3) bool, sides (opposite each corner) along which the gap is zero
    closed : (C,) bool, cells in which the stream function must be constant
    contact : (C, 3) bool, corners from which the stream function rises as a power
    stiff : (C,) bool, cells so conductive that the pressure is taken to be the same all over them
    """

    shut: np.ndarray
    closed: np.ndarray
    contact: np.ndarray
    stiff: np.ndarray


@dataclass(frozen=True, eq=False)
class CellData(CellContact):
    """What the primal and the dual problem need of each cell (C cells).

    K : (C,), mean of g³; zero where the cell is all contact
    resistivity : (C, 3), tensor xx, xy, yy of the dual, zero where `closed`
    """

    K: np.ndarray
    resistivity: np.ndarray

    @classmethod
    def of_gaps(
        cls,
        xy: np.ndarray,
        aspect: np.ndarray | float,
        gaps: np.ndarray,
        linear: np.ndarray,
        means: tuple[np.ndarray, np.ndarray],
        ceiling: float,
    ) -> "CellData":
        """Of n cells with a gap at their corners.

        Parameters
        ----------
        xy, aspect : corners (3, n, 2), and what their x and y are to be multiplied by
        gaps : (3, n, 2), raised for the primal and lowered for the dual
        linear : (n,) bool, cells on which the gap is linear, or one for all
        means : of g³ and of 1/g³, each (n,)
        ceiling : no cell conducts more than its cube in the dual
        """
        (raised, lowered), (cube, inverse_cube) = np.moveaxis(gaps, -1, 0), means
        zero, contact = (raised == 0) & linear, (lowered == 0) & linear
        shut = zero[[1, 2, 0]] & zero[[2, 0, 1]]
        closed = contact.all(axis=0) | (np.isinf(inverse_cube) & ~linear)
        most = ceiling**3
        limited = np.maximum(inverse_cube, 1 / most)
        tensor = traces.resistivity(xy, aspect, lowered, contact, limited)
        # Beside contact the trace is what resists; the least is added to it.
        tensor[contact.any(axis=0) & ~closed] += ISOTROPIC / most
        return cls(shut.T, closed, contact.T, most < cube, cube, tensor)

    @classmethod
    def joined(
        cls,
        mesh: NestedMesh | TriangleMesh,
        some: Callable[[np.ndarray, np.ndarray], "CellData"],
    ) -> "CellData":
        """Of all cells of a mesh, some after the others: what is at work fits into the cache.

        Parameters
        ----------
        some : data of n cells whose corners are the vertices (3, n), at xy (3, n, 2)
        """
        count = len(mesh.cells)
        flags, sides, numbers = (count, bool), ((count, 3), bool), (count, float)
        kinds = sides, flags, sides, flags, numbers, ((count, 3), float)
        whole = cls(*(np.empty(*kind) for kind in kinds))
        for cells in parts(0, count, _AT_ONCE):
            vertices = mesh.cells[cells].T
            found = some(vertices, mesh.xy.take(vertices, axis=0))
            for name in cls.__dataclass_fields__:
                getattr(whole, name)[cells] = getattr(found, name)
        return whole

    def part(self, cells: np.ndarray) -> "CellData":
        """The data of some cells, (C,) bool or indices."""
        return CellData(*(getattr(self, name)[cells] for name in self.__dataclass_fields__))

    def regularised(self, leak: float, cut: float) -> np.ndarray:
        """Resistivity (C, 3) with closed cells conducting `leak` times what they do in the primal.

        cut : as of the gap; what closed cells conduct counts at least as its cube, since without a
            smallest conductivity the contrast makes deep solves collapse
        """
        conducted = leak * np.maximum(self.K, cut**3)
        # What conducts nothing at all, without a cut, is no part of any problem.
        added = np.divide(self.closed, conducted, out=np.zeros_like(self.K), where=conducted > 0)
        return self.resistivity + added[:, None] * ISOTROPIC

    def without_values(self) -> CellContact:
        """What is left when the averages are no longer needed."""
        return CellContact(self.shut, self.closed, self.contact, self.stiff)
