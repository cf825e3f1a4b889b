"""What changes once where contact percolates, and the measures of one contact."""

from dataclasses import dataclass

import numpy as np

from fem_seal.contact import GapState
from fem_seal.contact.state import PERIMETER_FACTOR
from fem_seal.film.clusters import joins_ends
from fem_seal.grid import diagonal_rises

# Connectivities of contact and of open. All but the last are dual pairs. In the last one neither
# phase is connected through corners, and both may fail to span.
PAIRS = {
    "triangulation": ("triangulation", "triangulation"),
    "contact-8": ("8", "4"),
    "contact-4": ("4", "8"),
    "both-4": ("4", "4"),
}
REFERENCE = "triangulation"  # the pair by which the flow solver decides whether a gap leaks


@dataclass(frozen=True)
class Event:
    """Contact begins to join the ends of the cell, or open ceases to; each occurs once.

    Paths go from the first row to the last, between side walls.
    """

    phase: str  #: "contact" or "open"
    connectivity: str

    def __str__(self) -> str:
        return f"{self.phase} {self.connectivity}"

    def occurred(self, contact: np.ndarray) -> bool:
        """Whether it has occurred in a contact, (nx, ny) bool."""
        if self.phase == "contact":
            return joins_ends(contact, self.connectivity)
        return not joins_ends(~contact, self.connectivity)


EVENTS = [
    Event(phase, connectivity)
    for phase in ("contact", "open")
    for connectivity in ("triangulation", "4", "8")
]


def euler_characteristic(mask: np.ndarray) -> int:
    """Vertices minus edges plus triangles of the pixel triangulation in a mask on the torus.

    It is the number of pieces minus that of their holes (K. R. Mecke, Lect. Notes Phys. 554, 111
    (2000)): negative for a "Swiss cheese". Both sides of the mask have an even number of samples.
    """

    def count(*masks: np.ndarray) -> int:
        return int(np.count_nonzero(np.logical_and.reduce(masks)))

    a, b, c = mask, np.roll(mask, -1, axis=0), np.roll(mask, -1, axis=1)
    d = np.roll(b, -1, axis=1)
    rises = diagonal_rises(*np.indices(mask.shape))
    edges = count(a, b) + count(a, c) + count(a, d, rises) + count(b, c, ~rises)
    rising = count(a, b, d, rises) + count(a, c, d, rises)
    falling = count(a, b, c, ~rises) + count(b, c, d, ~rises)
    return count(a) - edges + rising + falling


@dataclass(frozen=True)
class Snapshot:
    """Measures of one contact."""

    load: float
    area: float  #: A/A0, counted in samples
    corrected: float  #: A/A0 less what pixels add along the perimeter
    #: Euler characteristic of contact on the torus, by the triangulation; open has its opposite
    euler: int

    @property
    def perimeter(self) -> float:
        """Number of pixel edges between contact and open over the number of samples."""
        return (self.area - self.corrected) / PERIMETER_FACTOR

    @classmethod
    def of(cls, state: GapState, load: float) -> "Snapshot":
        """Measure a contact."""
        return cls(
            load,
            state.contact_area_fraction,
            state.contact_area_corrected,
            euler_characteristic(state.contact),
        )


Bracket = tuple[Snapshot, Snapshot]  # the last contact before an event, and the first one after
