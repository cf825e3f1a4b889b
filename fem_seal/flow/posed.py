"""What the flow solver needs to know of a gap, be it on a grid or on a mesh of any shape."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS, ConstantGap, LinearGap, VertexGap
from fem_seal.grid import GridField
from fem_seal.mesh.mesh_gap import MeshGap
from fem_seal.mesh.nested import NestedMesh, coarsest_width, uniform_mesh
from fem_seal.mesh.triangles import TriangleMesh
from fem_seal.topology.constriction import critical_constriction
from fem_seal.topology.percolation import carrying, is_sealed


@dataclass(frozen=True, eq=False)
class GridFlow:
    """Flow along the first axis of a grid.

    gap : [m]; sides : "wall" or "periodic"; representation : "linear" or "constant"
    """

    gap: GridField
    sides: str
    representation: str

    def check(self) -> None:
        """InvalidInput if the gap has no area as represented."""
        if self.representation == "linear" and min(self.gap.vertices().shape) < 2:
            raise InvalidInput(
                f"a linear gap needs two samples along each axis, got shape {self.gap.shape}; "
                "use representation = 'constant' for a single row"
            )

    @property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet."""
        return is_sealed(self.gap, self.sides, self.representation)

    @property
    def highest(self) -> float:
        """Largest gap [m]."""
        return float(self.gap.values.max())

    @property
    def unit(self) -> float:
        """Length [m] in which the normalised problem is written."""
        return max(self.gap.spacing)

    @property
    def narrowest(self) -> float:
        """Gap of the critical constriction over the largest one."""
        scaled = GridField(self.gap.values / self.highest, self.gap.spacing, self.gap.periodic)
        return critical_constriction(scaled, self.sides, self.representation).gap

    def start(
        self, cut: float, floor: float, ceiling: float, coarsest: int | None
    ) -> tuple[LinearGap | ConstantGap, NestedMesh]:
        """Gap in units of its maximum and the first mesh: the pixels if `coarsest` is None.

        Pockets, which do not join inlet and outlet, count as contact: nothing flows there, but on
        cells that hold a piece of a pocket and one of a channel they would seem to conduct.
        """
        linear = self.representation == "linear"
        samples = self.gap.vertices() if linear else self.gap.values
        carries = carrying(self.gap, self.sides, self.representation)
        scaled = GridField(np.where(carries, samples / self.highest, 0.0), self.gap.spacing)
        squares = tuple(n - linear for n in samples.shape)
        width = 1 if coarsest is None else coarsest_width(squares, coarsest)
        gap = REPRESENTATIONS[self.representation](scaled, cut, floor, width, ceiling)
        return gap, uniform_mesh(gap.squares, width, self.sides == "periodic")

    def points(self, mesh: NestedMesh) -> np.ndarray:
        """Vertex coordinates (V, 2) [m]."""
        return mesh.points(self.gap.spacing)


@dataclass(frozen=True, eq=False)
class MeshFlow:
    """Flow from the inlet to the outlet of a shape; its mesh says what its sides are."""

    gap: MeshGap

    def check(self) -> None:
        """Nothing: a MeshGap has been checked when it was made."""

    @property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet."""
        return self.gap.constriction is None

    @property
    def highest(self) -> float:
        """Largest gap [m]."""
        return float(self.gap.values.max())

    @property
    def unit(self) -> float:
        """Length [m] in which the normalised problem is written."""
        return float(np.ptp(self.gap.mesh.xy, axis=0).max())

    @property
    def narrowest(self) -> float:
        """Gap of the critical constriction over the largest one."""
        return self.gap.constriction.gap / self.highest

    def start(
        self, cut: float, floor: float, ceiling: float, coarsest: int | None
    ) -> tuple[VertexGap, TriangleMesh]:
        """Gap in units of its maximum and the given mesh, which is the coarsest there is."""
        # Pockets stay: no cell, on which the gap is linear, holds a piece of one and of a channel.
        values = self.gap.values / self.highest
        return VertexGap(values, self.unit, cut, floor, ceiling), self.gap.mesh

    def points(self, mesh: TriangleMesh) -> np.ndarray:
        """Vertex coordinates (V, 2) [m]."""
        return mesh.xy


def posed(gap: GridField | MeshGap, sides: str, representation: str) -> GridFlow | MeshFlow:
    """Pose the flow through a gap; a mesh has its own sides and is linear on its cells.

    Raises
    ------
    InvalidInput
        If it is neither, such as an array without a spacing.
    """
    if isinstance(gap, MeshGap):
        return MeshFlow(gap)
    if not isinstance(gap, GridField):
        raise InvalidInput(
            f"the gap is a {type(gap).__name__}; make it a GridField(values, spacing, periodic)"
        )
    return GridFlow(gap, sides, representation)
