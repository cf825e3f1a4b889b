"""What the search for a prescribed contact area leaves open in the leak rate.

The number of touching samples is a step function of the load, so that a prescribed area is reached
to a few samples only. How far the load that was found is from the loads at which the number passes
the asked one is known to first order, while no other sample changes: a sample closes when its gap,
and opens when its pressure has fallen to 0,

    ΔP = g / (-∂g/∂P)  or  p_c / (∂p_c/∂P)

and the load at which the n-th of them does so is the n-th smallest of these. On 64² to 512² samples
the first order miscounts at most one sample in 25.

ln Q changes by at most `AREA_SAFETY` times the larger of two: ∂ ln Q/∂P ΔP on a network, which may
be too coarse for a narrow place, and 3 Δg_c/g_c of the critical constriction alone, which governs
the flow next to closing.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import ceil, floor, inf

import numpy as np

from fem_seal.contact.state import BearingState, ContactState
from fem_seal.digits import with_prefix
from fem_seal.error_budget import CONTACT_AREA, Uncertainty, estimate
from fem_seal.errors import NotConverged, narrowed, present
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField
from fem_seal.grid_series import by_load, critical_gap, error_beyond
from fem_seal.patch import Patch, once

# Factor on the larger of both changes of ln Q, for what the network and the first order leave out.
AREA_SAFETY = 1.25
# Factor on that of the critical constriction where it stands alone, without a network.
WITHOUT_NETWORK = 2.0
# Change of ln Q, by the constriction alone, up to which a dry contact needs no network.
SMALL_CHANGE = 0.01


@once
def area_error(patch: Patch) -> Uncertainty | None:
    """Estimate how far the leak rate is from that at the prescribed area; None without one."""
    if patch.scene.contact is None or patch.load.kind != "area_fraction" or patch.load.value == 0:
        return None
    if patch.lifted is not None and not patch.lifted.converged:
        return estimate(CONTACT_AREA, "contact and flow have not settled")
    contact = present(patch.film_contact, "contact")
    touching, samples = int(np.count_nonzero(contact.contact)), contact.contact.size
    # Six digits take the rounding of a fraction off.
    asked = round(patch.load.value * samples, 6)
    closing = floor(asked) - touching + 1 if touching <= asked else 0
    # The highest sample touches without load.
    opening = touching - max(ceil(asked), 1) + 1 if touching >= asked else 0
    words = f"{touching} of {samples} samples touch, and {asked:.7g} were asked for"
    sealed = patch.sealed
    try:
        reached = partial(_reach, patch, closing, opening)
        reach = patch.timed_on_root("contact area", reached)
    except NotConverged as error:
        return estimate(CONTACT_AREA, f"{words}; {error}")
    if sealed:
        return _of_sealed(patch, reach, words)
    less, more = (reach.rate * distance / 3 for distance in (reach.closed, reach.opened))
    if isinstance(contact, ContactState):
        load = with_prefix(present(patch.carried_load, "load"), "Pa")
        words += f"; contact.pressure = {load} in place of the area leaves this out"
    # A constriction that narrows by the part x conducts as (1 - x)³.
    lower = (1 - less) ** 3 if less < 1 else None
    return estimate(CONTACT_AREA, words, lower, (1 + more) ** 3)


@dataclass(frozen=True)
class _Reach:
    """How far the loads are at which the number of samples passes the asked one."""

    closed: float  #: ΔP [Pa] to the larger load, or the way of the plane of a bearing contact [m]
    opened: float  #: to the smaller load
    rate: float  #: most that ln Q may change by it, per ΔP
    sealed_with_fewer: bool  #: whether the samples that open leave a sealed film sealed


def _reach(patch: Patch, closing: int, opening: int) -> _Reach:
    """Reach to the load at which so many samples have closed or opened."""
    contact, height = patch.film_contact, present(patch.surface, "surface")
    gap, by = present(contact, "contact").gap.values, None
    if isinstance(contact, ContactState):
        by = by_load(patch)
        narrowing, kept, easing = np.maximum(-by.gap, 0.0), contact.pressure.values, by.pressure
    else:
        shift = narrowed(contact, BearingState, "bearing").shift
        narrowing = easing = np.ones(gap.shape)
        kept = np.maximum(height.values - (height.values.max() - shift), 0.0)
    closes, opens = (gap > 0) & (narrowing > 0), (gap == 0) & (easing > 0)
    closed = _smallest(gap[closes] / narrowing[closes], closing)
    opened = _smallest(kept[opens] / easing[opens], opening)

    def film_of(values: np.ndarray) -> GridFilm | MeshFilm:
        return patch.film_of(GridField(values, height.spacing, height.periodic))

    if patch.sealed:
        free = (gap > 0) | (opens & (kept <= AREA_SAFETY * opened * easing))
        return _Reach(closed, opened, 0.0, film_of(free.astype(float)).sealed)
    film, narrows, critical = patch.film, film_of(narrowing), critical_gap(patch)
    narrowest = _values(narrows)[_values(film) == critical]
    of_constriction = 3 * float(narrowest.max()) / critical
    rate = WITHOUT_NETWORK * of_constriction
    matters = patch.lifted is not None or rate * max(closed, opened) > SMALL_CHANGE
    if matters and by is not None and isinstance(film, GridFilm):
        rate = AREA_SAFETY * max(of_constriction, abs(by.log_rate))
    return _Reach(closed, opened, rate, False)


def _values(film: GridFilm | MeshFilm) -> np.ndarray:
    return film.gap.values if isinstance(film, GridFilm) else film.values


def _smallest(values: np.ndarray, number: int) -> float:
    """The value of that number in rising order; 0 of none, infinite if there are not so many."""
    if number == 0:
        return 0.0
    return float(np.partition(values, number - 1)[number - 1]) if number <= values.size else inf


def _of_sealed(patch: Patch, reach: _Reach, words: str) -> Uncertainty:
    """Whether a film that is sealed as computed leaks under the load of the asked area."""
    if reach.opened == 0 or reach.sealed_with_fewer:
        words += "; with the number asked for the film is sealed as well"
        return estimate(CONTACT_AREA, words, 1.0, 1.0)
    words += "; with fewer a path may open"
    load = (patch.carried_load or 0.0) - AREA_SAFETY * reach.opened
    if not isinstance(patch.film_contact, ContactState) or load <= 0:
        return estimate(CONTACT_AREA, words, 1.0)
    lighter = patch.pressed_by(load, patch.lift)
    rate, lifted = lighter.leak_rate, lighter.lifted
    if lifted is not None and lifted.is_range:
        low, high = rate.range
        rate = replace(rate, lower=low, upper=max(high, lifted.highest))
    most = rate.widened(error_beyond(patch, lighter)).range[1]
    return estimate(CONTACT_AREA, words, 1.0, upper_rate=most if most < inf else None)
