"""Distance of a contact from its percolation threshold, at which it begins or ceases to leak."""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.errors import present
from fem_seal.film import Film
from fem_seal.grid import GridField

PRECISION = 1.01  # ratio of the two pressures between which an elastic contact seals
STEP = 1.5  # ratio of pressures while only a leaking or only a sealed one is known
LEAST = 1e-6  # the search ends below this part of the first pressure


@dataclass(frozen=True)
class Threshold:
    """The last leaking and the first sealed state while the contact grows.

    Attributes
    ----------
    model : "gfmd", "bearing" or "gap"
        How the contact grows: an elastic contact under rising pressure, a cut at a falling
        plane, or a gap that is lowered uniformly.
    area_leaking, area_sealed : float
        Contact area fractions of the two states.
    pressure_leaking, pressure_sealed : float or None
        Mean pressures of the two states [Pa], which differ by 1 %; elastic contact only. If the
        fluid lifts the solid they are total loads of solid and fluid: under the first the patch
        leaks and under the second it is sealed, at any fluid pressure between those of the ends.
        They then differ by the pressure drop as well.
    contacts : int
        Number of elastic contacts that were solved.
    """

    model: str
    area_leaking: float
    area_sealed: float
    pressure_leaking: float | None = None
    pressure_sealed: float | None = None
    contacts: int = 0


def threshold_of_cut(film: Film, model: str) -> Threshold | None:
    """Lower a gap uniformly until it seals: exact, at the gap of the critical constriction.

    Parameters
    ----------
    film : Film
        Film of the gap or, for "bearing", of the gap before the surfaces touch.
    model : "gap" or "bearing"
        Label of the result. The contact of the bearing model is exactly this cut.

    Returns
    -------
    Threshold, or None if the gap is sealed already.
    """
    if film.constriction is None:
        return None
    critical = film.constriction.gap
    return Threshold(
        model,
        area_leaking=film.area_not_above(np.nextafter(critical, 0.0)),
        area_sealed=film.area_not_above(critical),
    )


def threshold_of_pressure(
    start: ContactState,
    press: Callable[[float, ContactState], ContactState],
    is_sealed: Callable[[GridField], bool],
) -> Threshold:
    """Bisect the pressure between a leaking and a sealed elastic contact.

    Contact only grows with the pressure (J. R. Barber, Q. J. Mech. Appl. Math. 27, 1 (1974)), so
    that the threshold is unique. The search solves about ten contacts, each started from the last
    leaking one.

    Parameters
    ----------
    start : ContactState
        A contact under any pressure > 0.
    press : callable
        Solves the contact under a pressure [Pa], started from another contact.
    is_sealed : callable
        Whether a gap is sealed.

    Raises
    ------
    NotConverged
        If a contact does not converge.
    """
    first, contacts = start.mean_pressure, 0
    state = start
    leaking, sealed = (None, state) if is_sealed(state.gap) else (state, None)
    while leaking is None or sealed is None or _ratio(leaking, sealed) > PRECISION:
        if leaking is not None and sealed is not None:
            pressure = sqrt(leaking.mean_pressure * sealed.mean_pressure)
        elif leaking is not None:
            pressure = state.mean_pressure * STEP
        else:
            pressure = state.mean_pressure / STEP
            if pressure < LEAST * first:
                break  # sealed by the first touch, as by a ring
        state, contacts = press(pressure, leaking or state), contacts + 1
        leaking, sealed = (leaking, state) if is_sealed(state.gap) else (state, sealed)
    sealed = present(sealed, "sealed contact")
    return Threshold(
        "gfmd",
        area_leaking=leaking.contact_area_fraction if leaking else 0.0,
        area_sealed=sealed.contact_area_fraction,
        pressure_leaking=leaking.mean_pressure if leaking else 0.0,
        pressure_sealed=sealed.mean_pressure,
        contacts=contacts,
    )


def _ratio(leaking: ContactState, sealed: ContactState) -> float:
    return sealed.mean_pressure / leaking.mean_pressure
