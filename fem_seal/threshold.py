"""Distance of a contact from its percolation threshold, at which it begins or ceases to leak."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from fem_seal import parallel
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState
from fem_seal.errors import Inconsistent, NotConverged, present
from fem_seal.film import Film
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene_steps import elastic_contact

PRECISION = 0.01  # largest relative distance of the two pressures between which a contact seals
LOAD_RATIO = 1.5  # ratio of pressures while only a leaking or only a sealed one is known
LEAST_OF_FIRST = 1e-6  # the search ends below this part of the first pressure
MOST_OF_FIRST = 1e18  # and gives up above this multiple of it or E*, the larger one


@dataclass(frozen=True)
class Threshold:
    """The last leaking and the first sealed state while the contact grows.

    Under a fluid that lifts the solid, the pressures are total loads of solid and fluid: under the
    first the patch leaks and under the second it is sealed, at any fluid pressure between those of
    the ends. Both are 0 at least: pressures below ambient may seal the patch without any load.
    """

    model: str  #: how the contact grows: "gfmd" under pressure, "bearing" or "gap" by lowering
    area_leaking: float  #: contact area of the last leaking state, A/A0
    area_sealed: float  #: contact area of the first sealed state, A/A0
    pressure_leaking: float | None = None  #: [Pa], of an elastic contact
    pressure_sealed: float | None = None  #: [Pa]; dry at most 1 % above `pressure_leaking`
    contacts: int = 0  #: elastic contacts that were solved

    def __post_init__(self) -> None:
        ends = self.pressure_leaking, self.pressure_sealed
        # The areas of two elastic contacts are as exact as their solves.
        low, high = (self.area_leaking, self.area_sealed) if ends == (None, None) else ends
        if low is None or high is None or not 0 <= low <= high:
            raise Inconsistent(f"a threshold between {low} (leaking) and {high} (sealed)")


def threshold_of_cut(film: Film, model: str) -> Threshold | None:
    """Lower a gap uniformly until it seals: exact, at the gap of the critical constriction.

    For "bearing", whose contact is exactly this cut, the film is that of the gap before the
    surfaces touch. None if the gap is sealed already.
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
    precision: float = PRECISION,
) -> Threshold:
    """Bisect the pressure between a leaking and a sealed elastic contact.

    Contact only grows with the pressure (J. R. Barber, Q. J. Mech. Appl. Math. 27, 1 (1974)), so
    that the threshold is unique. The search solves about ten contacts, each started from the last
    leaking one. It begins with a contact under any pressure > 0; `press` solves the contact under a
    pressure [Pa], started from another contact.
    """
    first, contacts = start.mean_pressure, 0
    state = start
    leaking, sealed = (None, state) if is_sealed(state.gap) else (state, None)
    while (
        leaking is None
        or sealed is None
        or sealed.mean_pressure > (1 + precision) * leaking.mean_pressure
    ):
        if leaking is not None and sealed is not None:
            pressure = sqrt(leaking.mean_pressure * sealed.mean_pressure)
        elif leaking is not None:
            pressure = state.mean_pressure * LOAD_RATIO
            if pressure > max(MOST_OF_FIRST * first, start.contact_modulus):
                raise NotConverged(
                    f"the contact still leaks at {state.mean_pressure:.3g} Pa: check the heights, "
                    "or take 'threshold' out of output.products"
                )
        else:
            pressure = state.mean_pressure / LOAD_RATIO
            if pressure < LEAST_OF_FIRST * first:
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


def threshold(patch: Patch) -> Threshold | None:
    """Threshold of the contact, or of the given gap, of a patch.

    None if a given gap is sealed already, or a contact has no load.
    """
    dry = dry_threshold(patch)
    if dry is None or dry.pressure_sealed is None or patch.lift == "none":
        return dry
    # The fluid carries at least the outlet's pressure and at most the inlet's. Pressures below
    # ambient press the solids together, so that no load may be needed.
    inlet, outlet = patch.scene.flow.gauge_pressures
    return replace(
        dry,
        pressure_leaking=max(present(dry.pressure_leaking, "pressure") + outlet, 0.0),
        pressure_sealed=max(dry.pressure_sealed + inlet, 0.0),
    )


def dry_threshold(patch: Patch) -> Threshold | None:
    """Threshold without the fluid's pressure; see `threshold`."""
    patch.solve_film()  # by all processes: the first one searches alone
    model = "gap" if patch.scene.contact is None else patch.scene.contact.model
    return parallel.on_root(lambda: THRESHOLDS[model](patch), patch.comm)


def sealing_load(patch: Patch) -> float | None:
    """Least load that seals the dry contact of a patch: mean pressure [Pa], or A/A0 of a bearing.

    That of an elastic contact is up to 1 % too large. None without load.
    """
    dry = dry_threshold(patch)
    if dry is None or dry.pressure_sealed is None:
        return None if dry is None else dry.area_sealed
    return dry.pressure_sealed


def _of_bearing(patch: Patch) -> Threshold | None:
    surface = present(patch.surface, "surface")
    untouched = GridField(
        surface.values.max() - surface.values, surface.spacing, periodic=surface.periodic
    )
    return threshold_of_cut(patch.film_of(untouched), "bearing")


def _of_elastic(patch: Patch) -> Threshold | None:
    surface = present(patch.surface, "surface")
    if patch.elastic_state.mean_pressure == 0:
        return None

    def press(pressure: float, start: ContactState) -> ContactState:
        patch.report("threshold", f"contact at {pressure:.3e} Pa")
        return elastic_contact(patch.scene, surface, start, Load("pressure", pressure))

    return threshold_of_pressure(patch.elastic_state, press, lambda gap: patch.film_of(gap).sealed)


THRESHOLDS: dict[str, Callable[[Patch], Threshold | None]] = {
    "gap": lambda patch: threshold_of_cut(patch.film, "gap"),
    "bearing": _of_bearing,
    "gfmd": _of_elastic,
}
