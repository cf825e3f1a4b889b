"""A patch whose contact closes: gap and flow under loads that rise until it is sealed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from fem_seal.errors import InvalidInput, present
from fem_seal.film import GridFilm
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.progress import Report, silent
from fem_seal.quantities.of_patch import quantities
from fem_seal.scene import Scene

FIRST = 0.1  # first load, as part of the one that seals
MOST_LOADS = 200


@dataclass(frozen=True, eq=False)
class LoadedFilm:
    """Gap and flow of a patch under one load.

    Parameters
    ----------
    pressure : float
        Mean contact pressure [Pa].
    film : GridFilm
        Film between the solids.
    leak_rate : LeakRate
        Leak rate with its flow field, unless the film is sealed.
    """

    pressure: float
    film: GridFilm
    leak_rate: LeakRate


@dataclass(frozen=True)
class LoadRow:
    """A row of closing.csv.

    Attributes
    ----------
    pressure : float
        Mean contact pressure [Pa].
    contact_area_fraction : float
        Contact area over nominal area.
    state : str
        "leaking" or "sealed".
    leak_rate : float
        Best estimate [m³/s].
    lower, upper : float or None
        Bounds [m³/s]; None for finite differences.
    reason : str
        Sentence on why the flow has not reached its tolerance; empty if it has.
    """

    pressure: float = field(metadata={"header": "pressure [Pa]"})
    contact_area_fraction: float = field(metadata={"header": "contact area"})
    state: str
    leak_rate: float = field(metadata={"header": "leak rate [m^3/s]"})
    lower: float | None = field(metadata={"header": "lower [m^3/s]"})
    upper: float | None = field(metadata={"header": "upper [m^3/s]"})
    reason: str

    @classmethod
    def of(cls, step: LoadedFilm) -> "LoadRow":
        """Numbers of a load."""
        leak, area = step.leak_rate, step.film.contact_area_fraction
        return cls(step.pressure, area, leak.state, leak.value, leak.lower, leak.upper, leak.reason)


def loads_to_closing(scene: Scene, count: int, report: Report = silent) -> tuple[float, ...]:
    """Mean pressures [Pa] from a tenth of the pressure that seals up to it, ever closer.

    The distance from the last load is proportional to the square of the number of loads left, since
    near closing the leak rate falls as a power of this distance.

    Parameters
    ----------
    scene : Scene
        A scene of an elastic contact on a grid under `contact.pressure`.
    count : int
        Number of loads, 2 to MOST_LOADS.
    report : callable
        Called with stage and detail.

    Raises
    ------
    InvalidInput
        If the scene has no such contact, or the count is out of range.
    NotConverged
        If a contact does not converge.
    """
    if not 2 <= count <= MOST_LOADS:
        raise InvalidInput(f"a closing contact needs 2 to {MOST_LOADS} loads, got {count}")
    patch = _dry(scene, ("threshold",), report)
    # All processes read the contact before the first one searches for the threshold.
    patch.film  # noqa: B018
    threshold = present(present(quantities(patch), "quantities").threshold, "threshold")
    closing = present(threshold.pressure_sealed, "pressure that seals")
    left = np.linspace(1.0, 0.0, count)
    return tuple(float(p) for p in closing * (1 - (1 - FIRST) * left**2))


def closing_contact(
    scene: Scene, pressures: Sequence[float], report: Report = silent
) -> Iterator[LoadedFilm]:
    """Yield gap and flow of a scene under one mean pressure after the other.

    The contact is dry: the fluid's pressure does not lift the solid.

    Parameters
    ----------
    scene : Scene
        As of `loads_to_closing`.
    pressures : sequence of float
        Mean contact pressures [Pa], > 0.
    report : callable
        Called with stage and detail.

    Yields
    ------
    LoadedFilm

    Raises
    ------
    InvalidInput
        If the scene has no such contact or a pressure is not positive.
    NotConverged
        If a contact does not converge.
    """
    if not all(0 < pressure < np.inf for pressure in pressures):
        raise InvalidInput(f"the loads must be positive pressures, got {list(pressures)} Pa")
    patch = _dry(scene, ("contact", "leak_rate", "pictures"), report)
    for pressure in pressures:
        patch = patch.pressed_by(pressure)
        film = patch.film
        assert isinstance(film, GridFilm)
        yield LoadedFilm(pressure, film, patch.leak_rate)


def _dry(scene: Scene, products: tuple[str, ...], report: Report) -> Patch:
    """Patch of a scene with other products, without lift, seal and limit.

    InvalidInput if its load cannot rise, or nothing flows.
    """
    contact = scene.contact
    elastic = contact is not None and contact.is_elastic and contact.pressure is not None
    if not elastic or scene.shape is not None or scene.accuracy is not None:
        raise InvalidInput(
            "a closing contact needs an elastic contact under a pressure on a given grid: "
            "[surface], [solid] and [contact] with contact.model = 'gfmd' and contact.pressure, "
            "without [shape] and [accuracy]"
        )
    if scene.fluid is None:
        raise InvalidInput("a closing contact needs [fluid] and the pressures of [flow]")
    changes = {
        "output": scene.output.model_copy(update={"products": products}),
        "flow": scene.flow.model_copy(update={"lift": "none"}),
        "seal": None,
        # A limit would end the refinement of the flow as soon as it is kept or exceeded.
        "limit": None,
    }
    return Patch(scene.model_copy(update=changes), report)
