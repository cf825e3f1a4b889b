"""A film whose gap is given on a grid; the fluid flows along its first axis."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film import clusters
from fem_seal.film.constriction import CriticalConstriction, critical_constriction
from fem_seal.film.lattice import Lattice, lattice
from fem_seal.grid import GridField, Representation, Sides, require_grid_field


@dataclass(frozen=True, eq=False)
class GridFilm:
    """A gap on a grid, the way it is read between its samples, and its sides.

    Raises
    ------
    InvalidInput
        If the gap is not a GridField or is negative, a choice is unknown, or the sides are
        periodic while a linear gap is neither periodic nor has equal first and last columns.
    """

    gap: GridField  #: gap [m], >= 0 and exactly 0 in contact; inlet at x = 0, outlet at x = Lx
    #: "wall" or "periodic": no flow through y = 0 and y = Ly, or the two are one line
    sides: Sides = "wall"
    #: "linear" or "constant": the samples are vertices and the gap is linear on triangles between
    #: them, or each sample fills one pixel
    representation: Representation = "linear"
    #: the gap's vertices or pixels, each physical point once, and their neighbourhood
    sites: Lattice = field(init=False, repr=False)

    def __post_init__(self) -> None:
        require_grid_field(self.gap, "gap")
        object.__setattr__(self, "sites", lattice(self.gap, self.sides, self.representation))

    @property
    def samples(self) -> np.ndarray:
        """Gap at all vertices (linear) or pixels (constant), (mx, my) [m]."""
        return self.sampled(self.gap)

    def sampled(self, field: GridField) -> np.ndarray:
        """A field of the gap's grid at all vertices (linear) or pixels (constant), (mx, my)."""
        return field.vertices() if self.representation == "linear" else field.values

    @property
    def pixels(self) -> tuple[int, int]:
        """Number of pixels of the film along each axis: between the samples, or around them."""
        mx, my = self.samples.shape
        return (mx - 1, my - 1) if self.representation == "linear" else (mx, my)

    @property
    def size(self) -> tuple[float, float]:
        """Lengths (Lx, Ly) of the film [m]."""
        (mx, my), (dx, dy) = self.pixels, self.gap.spacing
        return mx * dx, my * dy

    @cached_property
    def largest_gap(self) -> float:
        """Largest gap [m]."""
        return float(self.gap.values.max())

    @cached_property
    def mean_gap(self) -> float:
        """Mean of the gap over all samples, contact included [m]."""
        return float(self.gap.values.mean())

    @cached_property
    def contact_area_fraction(self) -> float:
        """Part of the samples with a gap of exactly 0."""
        return self.area_not_above(0.0)

    @cached_property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet, so that the leak rate is exactly 0.

        A path follows the edges of the triangulation between open vertices (linear), which is
        exact since the gap is positive on all triangles around an open vertex; or the common
        sides of open pixels (constant).
        """
        sites = self.sites
        return not clusters.joins_ends(sites.open, sites.connectivity, sites.periodic)

    @cached_property
    def constriction(self) -> CriticalConstriction | None:
        """The tightest place on the widest path from inlet to outlet; None if sealed."""
        return None if self.sealed else critical_constriction(self.sites)

    @cached_property
    def carrying(self) -> np.ndarray:
        """Mask, bool, of the samples joined to both inlet and outlet: no others carry flow."""
        labels, count = self._labels
        spanning = clusters.on_all_lines(labels, count, labels[0], labels[-1])
        return self.sites.on_samples(spanning)

    @property
    def joined_to_outlet(self) -> np.ndarray:
        """Mask, bool, of the samples that open paths join to the outlet."""
        labels, count = self._labels
        return self.sites.on_samples(clusters.on_all_lines(labels, count, labels[-1]))

    @cached_property
    def pockets(self) -> np.ndarray:
        """Mask, bool, of the samples in pockets: open, but joined to neither inlet nor outlet."""
        return self.sites.on_samples(self._sites_in_pockets())

    @cached_property
    def trapped_volume(self) -> float:
        """Volume of the pockets [m³], exact for the gap as represented.

        Sum of g_i ∫ φ_i dA over the sites i in pockets; φ_i is the hat function of vertex i
        (linear) or 1 on pixel i (constant).
        """
        dx, dy = self.sites.spacing
        volumes = self.sites.gap * (self.sites.areas() * dx * dy)
        return float(volumes[self._sites_in_pockets()].sum())

    def area_not_above(self, gap: float) -> float:
        """Part of the samples where the film is not higher than a gap [m]."""
        values = self.gap.values
        return float(np.count_nonzero(values <= gap) / values.size)

    @cached_property
    def _labels(self) -> tuple[np.ndarray, int]:
        """Labels of the open clusters, and their number."""
        sites = self.sites
        return clusters.label(sites.open, sites.connectivity, sites.periodic)

    def _sites_in_pockets(self) -> np.ndarray:
        """(mx, my) bool: open sites whose cluster has no site on the inlet or the outlet."""
        labels, count = self._labels
        at_an_end = clusters.on_all_lines(labels, count, np.append(labels[0], labels[-1]))
        return self.sites.open & ~at_an_end


def require_film(film: object, kinds: tuple[type, ...]) -> None:
    """Raise InvalidInput unless an argument is a film of one of the kinds that a solver takes."""
    if not isinstance(film, kinds):
        on_mesh = "" if kinds == (GridFilm,) else ", or a MeshFilm on a mesh"
        raise InvalidInput(
            f"the film is a {type(film).__name__}; make it a GridFilm(gap, sides, representation)"
            f"{on_mesh}"
        )
