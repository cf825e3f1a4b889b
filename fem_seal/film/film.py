"""Protocol of a film, whose gap is given on a grid (`GridFilm`) or on a mesh (`MeshFilm`)."""

from typing import Protocol

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.film.constriction import CriticalConstriction


class Film(Protocol):
    """The domain of the fluid; contact is where its gap is exactly 0.

    Properties that take time are computed on first use and kept.
    """

    @property
    def highest(self) -> float:
        """Largest gap [m]."""

    @property
    def mean_gap(self) -> float:
        """Mean of the gap over the nominal area, contact included [m]."""

    @property
    def contact_area_fraction(self) -> float:
        """Contact area over nominal area, A/A0."""

    @property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet, so that the leak rate is exactly 0."""

    @property
    def constriction(self) -> CriticalConstriction | None:
        """The tightest place on the widest path from inlet to outlet; None if sealed."""

    @property
    def pockets(self) -> np.ndarray:
        """Mask, bool, of the samples or vertices in pockets: open, but joined to neither end."""

    @property
    def trapped_volume(self) -> float:
        """Volume of the pockets [m³], exact for the gap as it is read between its values."""

    def area_not_above(self, gap: float) -> float:
        """Part of the nominal area where the film is not higher than a gap [m]."""


def require_film(film: object, kinds: tuple[type, ...]) -> None:
    """Raise InvalidInput unless an argument is a film of one of the kinds that a solver takes."""
    if not isinstance(film, kinds):
        raise InvalidInput(
            f"the film is a {type(film).__name__}; make it a GridFilm(gap, sides, representation)"
        )
