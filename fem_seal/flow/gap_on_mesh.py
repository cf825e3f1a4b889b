"""The gap as a function on nested meshes, and what the two bounds need to know of each cell.

Gaps are in units of the largest one, lengths in pixels (scaled by the aspect of a pixel).
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_seal.flow import averages, traces
from fem_seal.grid import GridField
from fem_seal.mesh.nested import PIXEL, NestedMesh
from fem_seal.mesh.triangles import TriangleMesh

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

    def part(self, cells: np.ndarray) -> "CellData":
        """The data of some cells, (C,) bool or indices."""
        return CellData(*(getattr(self, name)[cells] for name in self.__dataclass_fields__))

    def regularised(self, leak: float, cut: float) -> np.ndarray:
        """Resistivity (C, 3) with closed cells conducting `leak` times what they do in the primal.

        cut : as of the gap; what closed cells conduct counts at least as its cube, since without a
            smallest conductivity the contrast makes deep solves collapse
        """
        conducted = leak * np.maximum(self.K, cut**3)
        return self.resistivity + (self.closed / conducted)[:, None] * ISOTROPIC

    def without_values(self) -> CellContact:
        """What is left when the averages are no longer needed."""
        return CellContact(self.shut, self.closed, self.contact, self.stiff)


class LinearGap:
    """Samples are vertices, the gap is linear on the pixel triangles.

    Parameters
    ----------
    gap : GridField, in units of its maximum
    cut : the dual takes gaps below it for contact (lowering the gap lowers the lower bound)
    floor : the primal raises positive gaps below it (raising the gap raises the upper bound)
    width : pixels, squares of the starting mesh
    ceiling : cells of a higher mean cube are `stiff` in the primal, and in the dual as conductive
        as the ceiling; both err to the safe side
    """

    def __init__(
        self, gap: GridField, cut: float, floor: float, width: int, ceiling: float = np.inf
    ):
        samples = gap.vertices()
        self.squares = (samples.shape[0] - 1, samples.shape[1] - 1)
        self.aspect = np.asarray(gap.spacing) / max(gap.spacing)
        self.cut, self._ceiling = cut, ceiling
        self._samples = np.stack([samples, samples], axis=-1)
        raised, lowered = np.moveaxis(self._samples, -1, 0)
        raised[(raised > 0) & (raised < floor)] = floor
        lowered[lowered < cut] = 0.0
        self._cube, self._inverse_cube = (
            averages.Pyramid.from_pixels(partial(_pixel_means, gaps, mean), self.squares, width)
            for gaps, mean in (
                (raised, averages.mean_cube),
                (lowered, averages.mean_inverse_cube),
            )
        )

    def vertex_values(self, mesh: NestedMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of a mesh of whole pixels."""
        i, j = (mesh.xy // PIXEL).T
        return self._samples[i, j]

    def refined_values(
        self, values: np.ndarray, fine: NestedMesh, edge_ends: np.ndarray
    ) -> np.ndarray:
        """Vertex values (V', 2) of a finer mesh whose new vertices lie midway between `edge_ends`.

        Samples on pixel vertices, linear between them.
        """
        new = fine.xy[len(values) :]
        middle = (values[edge_ends[:, 0]] + values[edge_ends[:, 1]]) / 2
        on_pixel = (new[:, 0] % PIXEL == 0) & (new[:, 1] % PIXEL == 0)
        i, j = (new[on_pixel] // PIXEL).T
        middle[on_pixel] = self._samples[i, j]
        return np.concatenate([values, middle])

    def plotted_values(self, mesh: NestedMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) at the vertices, for pictures."""
        return values[:, 0]

    def cell_data(self, mesh: NestedMesh, values: np.ndarray, limited: bool = True) -> CellData:
        """Averages, shut sides and resistivity tensors of all cells.

        Parameters
        ----------
        mesh, values : the mesh and the gap at its vertices
        limited : no resistivity is below that of the ceiling
        """
        fine = mesh.at_or_below_pixel()
        coarse = np.flatnonzero(~fine)
        raised, lowered = np.moveaxis(values[mesh.cells], -1, 0)
        K = averages.mean_cube(raised)
        place = averages.Place.of(mesh, coarse)
        K[coarse] = self._cube.lookup(place)
        inverse = averages.mean_inverse_cube(lowered)
        inverse[coarse] = self._inverse_cube.lookup(place)
        shut, contact = _contact_of(raised, lowered, fine[:, None])
        closed = contact.all(axis=1) | (~fine & np.isinf(inverse))
        most = self._ceiling**3
        inverse = np.maximum(inverse, 1 / most) if limited else inverse
        tensor = _resistivity(mesh, self.aspect, lowered, contact, inverse)
        return CellData(shut, closed, contact, most < K, K, tensor)


def _pixel_means(gaps: np.ndarray, mean, strip: slice) -> np.ndarray:
    """`mean` of the triangles of a strip of pixels, from all vertex samples."""
    return averages.linear_pixel_means(gaps[strip.start : strip.stop + 1], mean)


class VertexGap:
    """The gap is given at the vertices of any triangles and linear on them and on their parts.

    Parameters
    ----------
    values : (V,), gap at the vertices of the first mesh, in units of its maximum
    unit : lengths of the mesh are measured in it [m]
    cut, floor, ceiling : as for LinearGap
    """

    def __init__(
        self, values: np.ndarray, unit: float, cut: float, floor: float, ceiling: float = np.inf
    ):
        self.aspect = 1 / unit
        self.cut, self._ceiling = cut, ceiling
        raised = np.where(values > 0, np.maximum(values, floor), 0.0)
        lowered = np.where(values < cut, 0.0, values)
        self._values = np.stack([raised, lowered], axis=-1)

    def vertex_values(self, mesh: TriangleMesh) -> np.ndarray:
        """Gap (raised, lowered) at the vertices (V, 2) of the first mesh."""
        return self._values

    def refined_values(
        self, values: np.ndarray, fine: TriangleMesh, edge_ends: np.ndarray
    ) -> np.ndarray:
        """Vertex values (V', 2) of a finer mesh whose new vertices lie midway between `edge_ends`.

        The middle of an edge has the mean of its ends: the gap stays the same function.
        """
        return np.concatenate([values, (values[edge_ends[:, 0]] + values[edge_ends[:, 1]]) / 2])

    def plotted_values(self, mesh: TriangleMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) at the vertices, for pictures."""
        return values[:, 0]

    def cell_data(self, mesh: TriangleMesh, values: np.ndarray, limited: bool = True) -> CellData:
        """Averages, shut sides and resistivity tensors, in closed form on every cell."""
        raised, lowered = np.moveaxis(values[mesh.cells], -1, 0)
        shut, contact = _contact_of(raised, lowered, True)
        K, most = averages.mean_cube(raised), self._ceiling**3
        inverse = averages.mean_inverse_cube(lowered)
        inverse = np.maximum(inverse, 1 / most) if limited else inverse
        tensor = _resistivity(mesh, self.aspect, lowered, contact, inverse)
        return CellData(shut, contact.all(axis=1), contact, most < K, K, tensor)


def _contact_of(
    raised: np.ndarray, lowered: np.ndarray, linear: np.ndarray | bool
) -> tuple[np.ndarray, np.ndarray]:
    """Shut sides and contact corners (C, 3) bool of the cells on which the gap is linear."""
    zero = (raised == 0) & linear
    return zero[:, [1, 2, 0]] & zero[:, [2, 0, 1]], (lowered == 0) & linear


def _resistivity(
    mesh: NestedMesh | TriangleMesh,
    aspect: np.ndarray | float,
    lowered: np.ndarray,
    contact: np.ndarray,
    inverse: np.ndarray,
) -> np.ndarray:
    """Tensor (C, 3) of the dual: the mean of 1/g³, or that of the power trace at contact."""
    count = contact.sum(axis=1)
    isotropic = np.where(np.isinf(inverse), 0.0, inverse)
    two = np.flatnonzero(count == 2)
    isotropic[two] = traces.contact_edge_resistivity(lowered[two].max(axis=1))
    tensor = isotropic[:, None] * ISOTROPIC
    one = np.flatnonzero(count == 1)
    k = contact[one].argmax(axis=1)
    turned = (k[:, None] + np.arange(3)) % 3
    corners = mesh.points(aspect, mesh.cells[one[:, None], turned])
    b, c = lowered[one, turned[:, 1]], lowered[one, turned[:, 2]]
    tensor[one] = traces.one_contact_tensor(corners, b, c)
    return tensor


class ConstantGap:
    """Each sample fills one square pixel; no vertex carries a gap. Parameters: as for LinearGap."""

    def __init__(
        self, gap: GridField, cut: float, floor: float, width: int, ceiling: float = np.inf
    ):
        self.squares = gap.shape
        self.aspect = np.asarray(gap.spacing) / max(gap.spacing)
        self.cut, self._ceiling = cut, ceiling
        raised = np.where(gap.values > 0, np.maximum(gap.values, floor), 0.0)
        lowered = np.where(gap.values < cut, 0.0, gap.values)
        self._K = raised**3
        with np.errstate(divide="ignore"):
            self._inverse = 1 / lowered**3
        self._cube, self._inverse_cube = (
            averages.Pyramid.from_pixels(partial(_both_triangles, means), self.squares, width)
            for means in (self._K, self._inverse)
        )

    def vertex_values(self, mesh: NestedMesh) -> np.ndarray:
        """Nothing (V, 0): the gap jumps at the vertices."""
        return np.empty((len(mesh.xy), 0))

    def refined_values(
        self, values: np.ndarray, fine: NestedMesh, edge_ends: np.ndarray
    ) -> np.ndarray:
        """Nothing (V', 0)."""
        return np.empty((len(fine.xy), 0))

    def plotted_values(self, mesh: NestedMesh, values: np.ndarray) -> np.ndarray:
        """Gap (V,) of the pixel above and to the right of each vertex, for pictures."""
        i, j = np.minimum(mesh.xy // PIXEL, np.asarray(self.squares) - 1).T
        return np.cbrt(self._K[i, j])

    def cell_data(self, mesh: NestedMesh, values: np.ndarray, limited: bool = True) -> CellData:
        """Averages of all cells; contact is whole pixels, so no side is shut by itself."""
        coarse = np.flatnonzero(~mesh.at_or_below_pixel())
        i, j = (mesh.xy[mesh.cells].sum(axis=1) // (3 * PIXEL)).T
        K, inverse = self._K[i, j], self._inverse[i, j]
        place = averages.Place.of(mesh, coarse)
        K[coarse] = self._cube.lookup(place)
        inverse[coarse] = self._inverse_cube.lookup(place)
        closed, most = np.isinf(inverse), self._ceiling**3
        inverse = np.maximum(inverse, 1 / most) if limited else inverse
        isotropic = np.where(closed, 0.0, inverse)
        none = np.zeros((len(K), 3), dtype=bool)
        tensor = isotropic[:, None] * ISOTROPIC
        return CellData(none, closed, none, most < K, K, tensor)


def _both_triangles(means: np.ndarray, strip: slice) -> np.ndarray:
    """(n, my, 2), the same on both triangles of each pixel of a strip."""
    return np.repeat(means[strip][..., None], 2, axis=-1)


REPRESENTATIONS = {"linear": LinearGap, "constant": ConstantGap}
