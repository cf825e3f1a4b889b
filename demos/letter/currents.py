"""Points of the letter's Fig. 3: contacts of both models and their leak rates by all methods."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from demos.letter.contacts import (
    CONTACT_MODULUS,
    PRESSURE_DROP,
    SIDES,
    SLOPE,
    VISCOSITY,
    RoughCase,
    at_area,
    certified,
    pressed,
)
from fem_seal.contact import ContactState
from fem_seal.film import GridFilm, film_conductivity
from fem_seal.finite_difference import by_differences
from fem_seal.grid import GridField
from fem_seal.surface import resample
from fem_seal.theory.bruggeman import effective_conductivity, effective_dimension

# Link rules in increasing order of the leak rate: every link has harmonic <= linear-gap <=
# arithmetic, and no leak rate falls when a link conducts better (Rayleigh).
LINKS = ("harmonic", "linear-gap", "arithmetic")
RATES = (
    "lower", "value", "upper", "harmonic", "linear_gap", "arithmetic",
    "bruggeman", "modified", "finer",
)  # fmt: skip
FLOW_AREA = 0.2  # A/A0 of Fig. 2 and of the total that the models are compared by


@dataclass(frozen=True)
class Current:
    """A contact of one surface and its leak rates [m³/s], or these over that at first contact."""

    case: RoughCase
    model: str
    seed: int
    wanted: float  #: prescribed A/A0; 0 is first contact
    rtol: float  #: (upper - lower) / √(lower upper) at most
    area: float  #: A/A0, counted in samples
    corrected: float  #: A/A0 less what pixels add along the perimeter
    load: float | None  #: p/(E* h'rms); None for the bearing model
    state: str  #: "leaking" or "sealed"
    lower: float
    value: float  #: √(lower upper)
    upper: float
    harmonic: float | None  #: finite differences, as the next two; None if they were left out
    linear_gap: float | None
    arithmetic: float | None
    bruggeman: float  #: effective medium of the same gaps in dimension 2
    modified: float | None  #: the same in the letter's n_eff with A* = 0.42; elastic contact only
    unknowns: int
    seconds: float  #: CPU time of contact and flows [s]
    finer: float | None = None  #: certified value on a finer contact grid under the same pressure

    def over(self, first: float) -> "Current":
        """Leak rates over that at first contact."""
        rates = {name: getattr(self, name) for name in RATES}
        return replace(self, **{n: None if r is None else r / first for n, r in rates.items()})

    @property
    def half_width(self) -> float:
        """ln of upper over value: the relative error of the flow."""
        return float(np.log(self.upper / self.value))

    @property
    def grid_change(self) -> float | None:
        """|ln| of the leak rate on the finer contact grid over this; None if one of them is 0."""
        return abs(float(np.log(self.finer / self.value))) if self.finer and self.value else None


def current(
    case: RoughCase,
    model: str,
    seed: int,
    wanted: float,
    rtol: float,
    differences: bool,
    refine: int,
) -> Current:
    """Press a surface to a contact area and compute its leak rates.

    Under the same pressure an elastic contact is solved on a grid `refine` times as fine as well,
    unless that is 0.
    """
    start = process_time()
    surface = case.surface(seed)
    state = at_area(surface, model, wanted)
    gap, elastic = state.gap, isinstance(state, ContactState)
    leak = certified(gap, rtol)
    lower, upper = leak.bounds
    scales = {"viscosity": VISCOSITY, "pressure_drop": PRESSURE_DROP}
    film = GridFilm(gap, sides=SIDES)
    rates = [
        by_differences(film, link_rule=rule, **scales).value if differences else None
        for rule in LINKS
    ]
    load = state.mean_pressure / (CONTACT_MODULUS * SLOPE) if elastic else None
    finer = None
    if elastic and refine:
        heights = resample(surface, (refine * case.n,) * 2)
        finer = certified(pressed(heights, model, load).gap, rtol).value
    dimension = effective_dimension(state.contact_area_fraction)
    return Current(
        case,
        model,
        seed,
        wanted,
        rtol,
        area=state.contact_area_fraction,
        corrected=state.contact_area_corrected if elastic else state.contact_area_fraction,
        load=load,
        state=leak.state,
        lower=lower,
        value=leak.value,
        upper=upper,
        **dict(zip(("harmonic", "linear_gap", "arithmetic"), rates, strict=True)),
        bruggeman=medium(gap, 2.0),
        modified=medium(gap, dimension) if elastic else None,
        unknowns=leak.unknowns,
        seconds=process_time() - start,
        finer=finer,
    )


def medium(gap: GridField, dimension: float) -> float:
    """Leak rate [m³/s] of Bruggeman's medium with the conductivities g³/(12 η) of a gap."""
    K = film_conductivity(gap.values.ravel(), VISCOSITY)
    square = effective_conductivity(K, dimension=dimension, rtol=1e-10)
    return float(square) * PRESSURE_DROP * gap.size[1] / gap.size[0]


def over_first_contact(points: Sequence[Current]) -> list[Current]:
    """Points over the leak rate of their surface at first contact, which is left out."""
    first = {point.seed: point.value for point in points if point.wanted == 0}
    return [point.over(first[point.seed]) for point in points if point.wanted > 0]
