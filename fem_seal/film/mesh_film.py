"""A film whose gap is given at the vertices of a mesh of any shape and linear on its triangles."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import length_text
from fem_seal.errors import InvalidInput
from fem_seal.film.constriction import CriticalConstriction, highest_spanning
from fem_seal.graphs import components

if TYPE_CHECKING:
    from fem_seal.mesh.triangles import TriangleMesh


@dataclass(frozen=True, eq=False)
class MeshFilm:
    """A gap that is linear on the triangles of a mesh; the mesh names inlet, outlet and walls."""

    mesh: "TriangleMesh"
    #: (V,), gap at the vertices [m], >= 0 and exactly 0 in contact, equal at twins
    values: np.ndarray

    def __post_init__(self) -> None:
        values, twin = np.asarray(self.values, dtype=float), self.mesh.twin
        object.__setattr__(self, "values", values)
        if values.shape != twin.shape:
            raise InvalidInput(f"a gap of shape {values.shape} on a mesh of {len(twin)} vertices")
        for bad, fault in (
            (~np.isfinite(values), "not finite"),
            (values < 0, "negative; contact is a gap of exactly 0"),
            (values != values[twin], "not that at the same point across the seam"),
        ):
            if bad.any():
                x, y = self.mesh.xy[np.argmax(bad)]
                raise InvalidInput(
                    f"the gap at {np.count_nonzero(bad)} of {bad.size} vertices of the mesh, the "
                    f"first of them x = {x:.6g} m, y = {y:.6g} m, is {fault}"
                )

    @property
    def size(self) -> tuple[float, float]:
        """Extent in x and y [m]."""
        x, y = np.ptp(self.mesh.xy, axis=0)
        return float(x), float(y)

    @cached_property
    def largest_gap(self) -> float:
        """Largest gap [m]."""
        return float(self.values.max())

    @cached_property
    def mean_gap(self) -> float:
        """Mean of the gap over the area of the shape [m]."""
        areas = self._areas
        return float((areas * self.values[self.mesh.cells].mean(axis=1)).sum() / areas.sum())

    @cached_property
    def contact_area_fraction(self) -> float:
        """Area of the triangles with a gap of 0 over the area of the shape."""
        return self.area_not_above(0.0)

    @property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet, so that the leak rate is exactly 0."""
        return self.constriction is None

    @cached_property
    def constriction(self) -> CriticalConstriction | None:
        """The tightest place on the widest path from inlet to outlet; None if sealed.

        As on a grid (`film.constriction`), g_c is the largest h at which the vertices with g >= h
        join inlet and outlet, here along the edges of the mesh.
        """
        gap = self.values
        critical = highest_spanning(gap[gap > 0], lambda h: bool(self._spanning(h).any()))
        if critical == 0:
            return None
        x, y = self.mesh.xy[np.argmax(self._spanning(critical) & (gap == critical))]
        return CriticalConstriction(critical, (float(x), float(y)))

    @property
    def pockets(self) -> np.ndarray:
        """(V,) bool: open vertices that no open path joins to inlet or outlet."""
        is_open = self.values > 0
        component = self._components(is_open)
        ends = np.unique(component[(self.mesh.inlet | self.mesh.outlet) & is_open])
        return is_open & ~np.isin(component, ends)

    @cached_property
    def trapped_volume(self) -> float:
        """Volume of the pockets [m³], exact: no triangle has vertices in a pocket and a channel."""
        trapped = np.where(self.pockets, self.values, 0.0)[self.mesh.cells]
        return float((self._areas * trapped.mean(axis=1)).sum())

    def area_not_above(self, gap: float) -> float:
        """Part of the shape's area where the film is not higher than a gap [m].

        On a triangle with gaps a <= b <= c at its corners the part is (h - a)²/((b - a)(c - a))
        up to h = b, and 1 - (c - h)²/((c - a)(c - b)) from there to c.
        """
        a, b, c = np.sort(self.values[self.mesh.cells], axis=1).T
        part = (c <= gap).astype(float)
        low, high = (a < gap) & (gap <= b), (b < gap) & (gap < c)
        part[low] = (gap - a[low]) ** 2 / ((b - a)[low] * (c - a)[low])
        part[high] = 1 - (c[high] - gap) ** 2 / ((c - a)[high] * (c - b)[high])
        return float((self._areas * part).sum() / self._areas.sum())

    def with_gap(self, gap: float) -> "MeshFilm":
        """The same shape with a uniform gap [m]."""
        return MeshFilm(self.mesh, np.full_like(self.values, gap))

    @cached_property
    def _areas(self) -> np.ndarray:
        """Areas (C,) of the triangles [m²]."""
        return self.mesh.doubled_areas() / 2

    def _spanning(self, h: float) -> np.ndarray:
        """(V,) bool: vertices in clusters of {gap >= h} that join inlet and outlet."""
        above, mesh = self.values >= h, self.mesh
        component = self._components(above)
        both = np.intersect1d(component[mesh.inlet & above], component[mesh.outlet & above])
        return above & np.isin(component, both)

    def _components(self, mask: np.ndarray) -> np.ndarray:
        """(V,) int: number of the cluster of masked vertices of each vertex; twins share theirs."""
        edges = self.mesh.twin[self.mesh.edges.ends]
        joined = edges[mask[edges].all(axis=1)]
        return components(joined, len(mask))[self.mesh.twin]

    def summary(self) -> tuple[str, ...]:
        """Lines of text that describe the mesh and the gap on it."""
        mesh = self.mesh
        x0, y0 = map(length_text, mesh.xy.min(axis=0))
        x1, y1 = map(length_text, mesh.xy.max(axis=0))
        edges = ", ".join(f"{len(ends)} {name}" for name, ends in mesh.groups())
        gaps = self.values.min(), self.values.max(), self.mean_gap
        low, high, mean = map(length_text, gaps)
        path = "state      sealed, no open path joins inlet and outlet"
        if self.constriction is not None:
            x, y = self.constriction.position
            height = length_text(self.constriction.gap)
            path = f"tightest   {height} high, at x = {length_text(x)}, y = {length_text(y)}"
        return (
            f"mesh       {len(mesh.cells)} triangles, {self._areas.sum():.6g} m^2, edges: {edges}",
            f"extent     {x0} to {x1} by {y0} to {y1}",
            f"gap        {low} to {high}, mean {mean}",
            path,
        )
