"""How sure are the inputs: the leak rate at the two corners of the box of [tolerances].

Dry, on a half-space and under a pressure, the contact depends on one number x = P/(s E*), with s a
factor on all heights, and

    Q = (Δp/η) s³ f(x),    f falling

by the order of gaps (docs/theory/mathematics.md). Q therefore takes its extremes over the box at
two corners: all inputs at the ends that open the film, and all at those that close it. The order
holds for the half-space, not for its grid, and lifted contacts and layers have no such theorem: the
entry is an estimate.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import inf, log, prod

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.digits import in_digits
from fem_seal.error_budget import INPUTS, LargestInput, Uncertainty
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Given, Patch
from fem_seal.scene import Scene
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.path_flow import seal_flow
from fem_seal.upscaling.scene_profile import leak_path_of

# Direction of each input in which more leaks; but see `_viscosity` and `_modulus`.
OPENS = {
    "contact.pressure": -1,
    "seal.line_load": -1,
    "solid.youngs_modulus": 1,
    "solid.contact_modulus": 1,
    "fluid.viscosity": -1,
    "flow.pressure_drop": 1,
    "flow.inlet_pressure": 1,
    "flow.outlet_pressure": -1,
    "heights": 1,
}
# A lifted corner that leaks less than this part of the scene may leak nothing: next to closing its
# leak rate would take many times as long as that of the scene.
NEGLIGIBLE_LEAK = 1e-4
NOT_KNOWN = "errors of the inputs"  # name of the entry without factors
TINY = 1e-9  # least part of the load that counts as left to the solid
TRIED_VALUES = 17  # values of an input between the ends of its tolerance, where it has no direction
COMPARED_CELLS = 200  # of the leak path, for the leak rates that are compared
MODULI = ("solid.youngs_modulus", "solid.contact_modulus")
STIFFNESSES = (*MODULI, "heights")


@dataclass(frozen=True)
class Probe:
    """Tells at which end of an input most leaks where its sign alone does not."""

    gap: float | None = None  #: that of the critical constriction [m]; None where no path is open
    table: ConductivityTable | None = None  #: of a patch of a seal
    lifted_off: bool = False  #: whether a seal is lifted off


def inputs_entry(
    patch: Patch, leak: LeakRate, rate_of: Callable[[Patch], LeakRate], probe: Probe
) -> Uncertainty:
    """Entry of the inputs, from the leak rates at the two ends of [tolerances].

    `rate_of` gives the leak rate of another patch, or of a seal of such patches, with bounds that
    hold what its contact grid, and the patches of a seal, err more than those of the scene.
    """
    scene, load, lifted = patch.scene, patch.carried_load, patch.lifted
    if scene.tolerances is None:
        sentence = "load, solid, fluid and heights count as exact, without [tolerances]"
        return Uncertainty(INPUTS, "not covered", sentence, name=NOT_KNOWN)
    if scene.scales_exactly:
        viscosities = (_ends(scene, end, probe)["fluid.viscosity"] for end in (-1, 1))
        closed, opened = (_times(leak, 1 / viscosity) for viscosity in viscosities)
        return _entry(scene, leak, closed, opened, 0.0, probe)
    if lifted is not None and (lifted.floats or _may_float(patch)):
        # Higher heights, or a stiffer solid, may then lower the leak rate.
        sentence = (
            "the fluid may carry the whole load, and only for a solid in contact is it known at "
            "which ends of [tolerances] most leaks: change one input at a time and compare"
        )
        return Uncertainty(INPUTS, "not covered", sentence, name=NOT_KNOWN)
    if leak.state == "lifted off":
        with patch.timed("inputs"):
            return _of_lifted_off(_is_lifted_off(_at_corner(patch, -1, probe), rate_of))
    with patch.timed("inputs"):
        closed, opened = (rate_of(_at_corner(patch, end, probe)) for end in (-1, 1))
    carried = lifted.fluid_load / load if lifted is not None and load else 0.0
    return _entry(scene, leak, closed, opened, carried, probe)


def _is_lifted_off(closing: Patch, rate_of: Callable[[Patch], LeakRate]) -> bool:
    """Whether a patch, or the seal of its scene, is lifted off."""
    if closing.scene.seal is not None:
        profile, _, ends = leak_path_of(closing.scene)
        return profile.highest <= ends.inlet
    # Of a film that floats `rate_of` tells no leak rate, and yet it is finite.
    return closing.lifted_off or (closing.lifted is None and rate_of(closing).state == "lifted off")


def _of_lifted_off(stays: bool) -> Uncertainty:
    """Entry of a film that is lifted off, by whether it stays so at the ends that close it."""
    sentence = "with all inputs of [tolerances] at the ends that close the film, "
    if stays:
        return Uncertainty(INPUTS, "estimated", f"{sentence}it is lifted off as well", 1.0, 1.0)
    sentence += "the solid is not lifted off, and the leak rate is finite"
    return Uncertainty(INPUTS, "estimated", sentence, 0.0, 1.0, caution=True)


def _times(leak: LeakRate, factor: float) -> LeakRate:
    lower, upper = (factor * end for end in leak.bounds)
    return replace(leak, value=factor * leak.value, lower=lower, upper=upper)


def _may_float(patch: Patch) -> bool:
    """Whether the fluid may carry all of a load of [tolerances] on a solid that is uncertain."""
    opened = corner(patch.scene, 1, Probe())
    load, inlet = opened.load, opened.flow.gauge_pressures.inlet
    uncertain = not patch.scene.tolerated.keys().isdisjoint(STIFFNESSES)
    return uncertain and load.kind == "pressure" and load.value <= inlet


def rate_in_range(patch: Patch) -> LeakRate:
    """Leak rate of a patch; all of its range where the fluid's pressure leaves one."""
    leak, lifted = patch.leak_rate, patch.lifted
    if lifted is None or not (lifted.is_range or lifted.floats):
        return leak
    lower, upper = min(leak.bounds[0], lifted.lowest), max(leak.bounds[1], lifted.highest)
    if lifted.floats or upper == inf:
        # At which ends a film without contact leaks most is not known.
        return LeakRate.lifted_off(leak.method)
    return replace(leak, state="leaking", value=leak.value or upper, lower=lower, upper=upper)


def _at_corner(patch: Patch, end: int, probe: Probe) -> Patch:
    """Patch with all inputs of [tolerances] at the ends where most (1) or least (-1) leaks."""
    scene, surface, contact = corner(patch.scene, end, probe), patch.surface, patch.contact
    if surface is not None:
        factor = 1 + end * patch.scene.tolerated.get("heights", 0.0)
        surface = replace(surface, values=factor * surface.values)
    start = contact.pressure.values if isinstance(contact, ContactState) else None
    settings = replace(scene.flow_settings, rtol=patch.flow_settings.rtol)
    if end < 0 and patch.lifted is not None and patch.state == "leaking":
        settings = replace(settings, negligible=NEGLIGIBLE_LEAK * patch.leak_rate.value)
    given = Given(surface, contact_start=start, lift=patch.lift, flow_settings=settings)
    return Patch(scene, patch.report, given=given, trust=patch.trust, comm=patch.comm)


def corner(scene: Scene, end: int, probe: Probe) -> Scene:
    """The scene with all inputs at the ends that open (1) or close (-1) the film.

    It asks for nothing but the leak rate.
    """
    product = "leak_rate" if scene.seal is None else "seal"
    return scene.scaled(_ends(scene, end, probe)).with_(
        {"limit": None, "output.products": [product]}
    )


def _ends(scene: Scene, end: int, probe: Probe) -> dict[str, float]:
    """Factor on each input at one end of its tolerance."""
    ends = {name: 1 + end * OPENS[name] * part for name, part in scene.tolerated.items()}
    if scene.slip is not None and "fluid.viscosity" in ends:
        ends["fluid.viscosity"] = _viscosity(scene, end, probe.gap)
    if probe.lifted_off and _under_cylinder(scene):
        # A stiffer cylinder presses harder, and may close the seal.
        ends |= {name: 2 - ends[name] for name in ends.keys() & {*MODULI}}
    elif probe.table is not None and _under_cylinder(scene):
        others = scene.scaled({name: ends[name] for name in ends.keys() - {*MODULI}})
        for name in ends.keys() & {*MODULI}:
            factors = 1 + scene.tolerated[name] * np.linspace(-1, 1, TRIED_VALUES)
            ends[name] = _modulus(others, name, factors, end, probe.table, ends.get("heights", 1.0))
    return ends


def _under_cylinder(scene: Scene) -> bool:
    return scene.seal is not None and scene.seal.line_load is not None


def _modulus(
    scene: Scene,
    name: str,
    factors: np.ndarray,
    end: int,
    table: ConductivityTable,
    heights: float,
) -> float:
    """Factor on a modulus at which a seal under a line load leaks most, or least at the end -1.

    The scene has its other inputs at their ends, and the table a factor on the heights. A stiffer
    cylinder presses harder on a narrower path. Where the fluid carries most of its pressure, that
    closes the film: (P - p)/E*, on which K depends, then grows with E*. Of two films that are
    sealed or lifted off, the one with the larger ratio leaks less.
    """

    def by_leak(factor: float) -> tuple[float, float]:
        """Leak rate with a factor on the modulus, and by what two of 0 or of infinity compare."""
        profile, path, ends = leak_path_of(scene.scaled({name: factor}))
        decisive, loads = profile.highest - ends.inlet, factor * heights * table.loads
        scaled = ConductivityTable(loads, table.lower, table.upper)
        if decisive >= scaled.sealing_load:
            rate = 0.0
        elif scaled.sealing_load == loads[0]:
            rate = inf  # the table has no load at which the patch leaks
        else:
            rate = seal_flow(scaled, profile, path, ends, cells=COMPARED_CELLS).value
        return rate, -decisive / factor

    return (max if end > 0 else min)(factors.tolist(), key=by_leak)


def _viscosity(scene: Scene, end: int, gap: float | None) -> float:
    """Factor on the viscosity at which a channel as high as the critical constriction leaks most.

    Or least, at the end -1. Slip grows with the viscosity, since the mean free path does: below
    Knudsen's minimum more of a gas leaks the more viscous it is.
    """
    part = scene.tolerated["fluid.viscosity"]
    factors = 1 + part * np.linspace(-1, 1, TRIED_VALUES)
    leaks = [end * _slot_leak(scene.scaled({"fluid.viscosity": f}), gap) for f in factors.tolist()]
    return float(factors[np.argmax(leaks)])


def _slot_leak(scene: Scene, gap: float | None) -> float:
    """Leak rate of a channel of a gap [m] over g³: Δp/η, times what slip adds."""
    gain = 1.0 if scene.slip is None or gap is None else scene.slip.mean_gain(gap)
    return gain * scene.drive.pressure_drop / scene.viscosity


def _entry(
    scene: Scene,
    leak: LeakRate,
    closed: LeakRate,
    opened: LeakRate,
    carried: float,
    probe: Probe,
) -> Uncertainty:
    """Entry from three leak rates, and the part of the load that the fluid carries."""
    carried = min(carried, 1 - TINY)
    shares = input_shares(scene, leak, closed, opened, carried, probe)
    name = max(shares, key=lambda name: shares[name])
    part = scene.tolerated[name]
    sentence = (
        "leak rates with all inputs of [tolerances] at the ends that close or open the film; "
        f"{name} (±{in_digits(100 * part, 2)} %) matters most; that these ends are the extremes is "
        "a theorem for the half-space, not for its grid"
    )
    unlimited = leak.state != "lifted off" and opened.bounds[1] == inf
    if unlimited:
        sentence += "; no upper bound is known at those that open it"
    entry = partial(
        Uncertainty,
        INPUTS,
        "estimated",
        sentence,
        largest=LargestInput(name, part, shares[name] / (sum(shares.values()) or 1.0)),
    )
    if leak.state == "lifted off" or opened.state == "sealed":
        return entry(1.0, 1.0)
    if unlimited:
        return entry(0.0, None, caution=True)
    most = opened.bounds[1]
    if leak.state == "sealed":
        return entry(1.0, None, caution=True, upper_rate=most)
    least = closed.bounds[0] if closed.state == "leaking" else 0.0
    lower, upper = leak.bounds
    # The bounds of the flow multiply these factors: a product is then the bound of the corner.
    return entry(min(1.0, least / lower) if lower else 1.0, max(1.0, most / upper))


def input_shares(
    scene: Scene,
    leak: LeakRate,
    closed: LeakRate,
    opened: LeakRate,
    carried: float,
    probe: Probe,
) -> dict[str, float]:
    """|Δ ln Q| of each input between its own two ends, the others kept.

    ln f is taken as linear in ln x, through the outer two of the three leak rates that are not 0.
    Where the fluid carries a part of the load, `carried`, x has the part that is left to the solid.
    """
    own = 0.0 if scene.contact is None else scene.load.value

    def laws(factors: dict[str, float]) -> tuple[float, float]:
        """Logarithms of x and of Q s³/L, over those of the scene, with factors on the inputs.

        Q is that of a channel as high as the critical constriction, and L the leak path: under a
        cylinder it is the line load over the mean pressure.
        """
        other = scene.scaled(factors)
        drop = other.drive.pressure_drop / scene.drive.pressure_drop
        pressed = other.load.value / own if own else 1.0
        path = factors.get("seal.line_load", 1.0) / pressed if _under_cylinder(scene) else 1.0
        load = max(pressed - carried * drop, TINY)
        x = load / (1 - carried) / prod(factors.get(name, 1.0) for name in STIFFNESSES)
        s = factors.get("heights", 1.0)
        return log(x), log(
            _slot_leak(other, probe.gap) / _slot_leak(scene, probe.gap) * s**3 / path
        )

    closing, opening = (_ends(scene, end, probe) for end in (-1, 1))
    points: dict[float, float] = {}
    # The ends come last: they replace the scene where x is the same.
    for factors, flow in ({}, leak), (opening, opened), (closing, closed):
        x, driven = laws(factors)
        if flow.state == "leaking" and flow.value > 0:
            points[x] = log(flow.value) - driven

    # Where one alone leaks nothing is known of the slope but its sign.
    low, high = min(points, default=0.0), max(points, default=0.0)
    slope = (points[high] - points[low]) / (high - low) if high > low else -1.0

    def change(name: str) -> float:
        (x, driven), (other, against) = (laws({name: ends[name]}) for ends in (opening, closing))
        return abs(driven - against + slope * (x - other))

    return {name: change(name) for name in scene.tolerated}
