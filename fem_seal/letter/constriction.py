"""The critical constriction: its gap, and its share of the dissipation."""

from dataclasses import dataclass

from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.letter.surfaces import PRESSURE_DROP, VISCOSITY
from fem_seal.parallel import alone, communicator
from fem_seal.quantities.constriction import share_within

# Width of the bracket of the leak rate; a share of the dissipation needs no narrower one.
RTOL = 0.2


@dataclass(frozen=True)
class ConstrictionShare:
    """The narrowest point of the widest path through a gap with side walls.

    Attributes
    ----------
    area : float
        A/A0 of the contact.
    gap : float
        Diameter of the largest sphere that passes [m].
    x, y : float
        Position, in fractions of the side.
    radius : float
        Radius of the disc around it [m].
    share : float
        Part of the dissipation, ∫ K|∇p|² over the disc divided by Q Δp. With a single channel
        it is the part of the pressure drop.
    """

    area: float
    gap: float
    x: float
    y: float
    radius: float
    share: float


def constriction_share(gap: GridField, radius: float) -> ConstrictionShare:
    """Find the critical constriction of a leaking gap and its share of the dissipation.

    Parameters
    ----------
    gap : gap [m] that leaks between side walls
    radius : radius of the disc around the constriction [m]

    Raises
    ------
    NotConverged
        If the linear solver fails.
    """
    from fem_seal.flow import leak_rate

    film = GridFilm(gap)
    tightest = present(film.constriction, "constriction of a leaking gap")
    leak = leak_rate(
        film,
        viscosity=VISCOSITY,
        pressure_drop=PRESSURE_DROP,
        rtol=RTOL,
        field=True,
        comm=communicator(alone()),
    )
    field = present(leak.field, "field of the flow")
    (x, y), (Lx, Ly) = tightest.position, gap.size
    return ConstrictionShare(
        area=film.contact_area_fraction,
        gap=tightest.gap,
        x=x / Lx,
        y=y / Ly,
        radius=radius,
        share=share_within(field, field.pressure, tightest.position, radius),
    )
