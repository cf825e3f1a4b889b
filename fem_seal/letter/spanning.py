"""Measures of a contact: spanning phases, Euler characteristics, largest patches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.film.clusters import label, sizes
from fem_seal.film.euler import euler_characteristic
from fem_seal.film.lattice import DUAL_CONNECTIVITY
from fem_seal.film.percolation import spans, winds
from fem_seal.registry import require_known

if TYPE_CHECKING:
    from fem_seal.contact.state import GapState

# Connectivities of contact and of open. All but the last are dual pairs. In the last one neither
# phase is connected through corners, and both may fail to span.
PAIRS = {
    "triangulation": ("triangulation", "triangulation"),
    "contact-8": ("8", "4"),
    "contact-4": ("4", "8"),
    "both-4": ("4", "4"),
}

# Paths that span. "open": from the first row to the last between side walls; "cylinder": the same
# with the sides joined; "periodic": a closed path around the torus along x.
EDGES: dict[str, Callable[[np.ndarray, str], bool]] = {
    "open": lambda mask, connectivity: spans(mask, connectivity, "wall"),
    "cylinder": lambda mask, connectivity: spans(mask, connectivity, "periodic"),
    "periodic": lambda mask, connectivity: winds(mask, connectivity, axis=0),
}

TORUS = (True, True)


@dataclass(frozen=True)
class Criterion:
    """An event that occurs once as the load grows: contact begins or open ceases to span.

    Parameters
    ----------
    phase : "contact" or "open"
        Phase that spans.
    connectivity : str
        Connectivity of that phase.
    edges : str
        Kind of edges, a name in EDGES.
    """

    phase: str
    connectivity: str
    edges: str

    def crossed(self, contact: np.ndarray) -> bool:
        """Whether the event has occurred in a contact, (nx, ny) bool."""
        spans_edges = EDGES[self.edges]
        if self.phase == "contact":
            return spans_edges(contact, self.connectivity)
        return not spans_edges(~contact, self.connectivity)


@dataclass(frozen=True)
class Snapshot:
    """Measures of one contact.

    Attributes
    ----------
    load : float
        Load of the model.
    area : float
        A/A0, counted in samples.
    area_corrected : float
        A/A0 less the area that pixels add along the perimeter.
    euler_contact, euler_open : dict[str, int]
        Euler characteristics on the torus by connectivity of the phase.
    largest_contact, largest_open : float
        Part of A0 in the largest cluster of each phase.
    mean_gap : float
        Mean gap [m].
    """

    load: float
    area: float
    area_corrected: float
    euler_contact: dict[str, int]
    euler_open: dict[str, int]
    largest_contact: float
    largest_open: float
    mean_gap: float

    @property
    def perimeter(self) -> float:
        """Number of pixel edges between contact and open over the number of samples."""
        from fem_seal.contact.state import PERIMETER_FACTOR

        return (self.area - self.area_corrected) / PERIMETER_FACTOR

    @classmethod
    def of(cls, state: "GapState", load: float) -> "Snapshot":
        """Measure a contact."""
        contact = state.contact
        return cls(
            load=load,
            area=state.contact_area_fraction,
            area_corrected=state.contact_area_corrected,
            euler_contact=_euler(contact),
            euler_open=_euler(~contact),
            largest_contact=_largest_share(contact),
            largest_open=_largest_share(~contact),
            mean_gap=state.mean_gap,
        )


def _euler(mask: np.ndarray) -> dict[str, int]:
    return {name: euler_characteristic(mask, name, TORUS) for name in DUAL_CONNECTIVITY}


def _largest_share(mask: np.ndarray) -> float:
    return float(sizes(*label(mask, "triangulation", TORUS)).max()) / mask.size


def criteria_of(edges: Sequence[str]) -> tuple[Criterion, ...]:
    """All criteria that the pairs need for these edges.

    Raises
    ------
    InvalidInput
        For unknown edges.
    """
    for name in edges:
        require_known(EDGES, name, "edges")
    return tuple(
        Criterion(phase, connectivity, name)
        for name in edges
        for phase in ("contact", "open")
        for connectivity in DUAL_CONNECTIVITY
    )
