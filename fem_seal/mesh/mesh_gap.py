"""MeshGap: a gap given at the vertices of a shape, the counterpart of a GridField."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from fem_seal.digits import with_prefix
from fem_seal.errors import InvalidInput
from fem_seal.mesh.triangles import TriangleMesh
from fem_seal.topology.constriction import Constriction
from fem_seal.topology.triangulation import mesh_constriction


@dataclass(frozen=True, eq=False)
class MeshGap:
    """A gap that is linear on the triangles of a mesh.

    Parameters
    ----------
    mesh : TriangleMesh
    values : (V,) float
        Gap at the vertices [m], >= 0, 0 in contact, and equal at twins.

    Raises
    ------
    InvalidInput
        If a value is negative or not finite.
    """

    mesh: TriangleMesh
    values: np.ndarray

    def __post_init__(self):
        bad = ~np.isfinite(self.values)
        fault = "not finite"
        if not bad.any():
            bad, fault = self.values < 0, "negative; contact is a gap of exactly 0"
        if bad.any():
            x, y = self.mesh.xy[np.argmax(bad)]
            raise InvalidInput(
                f"the gap at {np.count_nonzero(bad)} of {bad.size} vertices of the mesh, the first "
                f"of them x = {x:.6g} m, y = {y:.6g} m, is {fault}"
            )

    @cached_property
    def constriction(self) -> Constriction | None:
        """The critical constriction, None if no open path joins inlet and outlet."""
        mesh = self.mesh
        edges = mesh.twin[mesh.edges[0]]
        # If a cut starts where inlet and wall meet, only one of the two twins is on an inlet side.
        inlet, outlet = (np.isin(mesh.twin, mesh.twin[end]) for end in (mesh.inlet, mesh.outlet))
        return mesh_constriction(self.values, mesh.xy, edges, inlet, outlet)

    @property
    def contact_area_fraction(self) -> float:
        """Area of the triangles with a gap of 0 over the area of the shape."""
        in_contact = (self.values[self.mesh.cells] == 0).all(axis=1)
        areas = self.mesh.doubled_areas()
        return float(areas[in_contact].sum() / areas.sum())

    @property
    def mean(self) -> float:
        """Mean gap [m] over the area of the shape."""
        areas = self.mesh.doubled_areas()
        return float((areas * self.values[self.mesh.cells].mean(axis=1)).sum() / areas.sum())

    def summary(self) -> tuple[str, ...]:
        """Lines of text that describe the mesh and the gap on it."""
        length = partial(with_prefix, unit="m")
        mesh, areas = self.mesh, self.mesh.doubled_areas()
        (x0, y0), (x1, y1) = mesh.xy.min(axis=0), mesh.xy.max(axis=0)
        edges = ", ".join(f"{len(ends)} {name}" for name, ends in mesh.groups())
        low, high = self.values.min(), self.values.max()
        path = "sealed: no open path joins inlet and outlet"
        if self.constriction is not None:
            x, y = self.constriction.position
            tightest = length(self.constriction.gap)
            path = f"critical constriction {tightest} at x = {length(x)}, y = {length(y)}"
        return (
            f"mesh       {len(mesh.cells)} triangles, {areas.sum() / 2:.6g} m^2, edges: {edges}",
            f"extent     {length(x0)} to {length(x1)} by {length(y0)} to {length(y1)}",
            f"gap        {length(low)} to {length(high)}, mean {length(self.mean)}",
            f"way        {path}",
        )
