"""How sure are the inputs: the leak rate at the two corners of the box of [tolerances].

Dry, on a half-space and under a pressure, the contact depends on one number x = P/(s E*), with s a
factor on all heights, and

    Q = (Δp/η) s³ f(x),    f falling

by the order of gaps (docs/theory/mathematics.md). Q therefore takes its extremes over the box at
two corners: all inputs at the ends that open the film, and all at those that close it. The order
holds for the half-space, not for its grid, and lifted contacts and layers have no such theorem: the
entry is an estimate.
"""

from functools import partial
from math import log, prod

import numpy as np

from fem_seal.digits import in_digits
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import INPUTS, Uncertainty
from fem_seal.scene import Scene

# Direction of each input in which more leaks.
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
TINY = 1e-9  # least part of the load that counts as left to the solid
LOADS = ("contact.pressure", "seal.line_load")
STIFFNESSES = ("solid.youngs_modulus", "solid.contact_modulus", "heights")


def exact_inputs_entry(patch: Patch) -> Uncertainty | None:
    """Entry of a scene without [tolerances]."""
    if patch.scene.tolerances is not None:
        return None
    return _not_covered("load, solid, fluid and heights count as exact, without [tolerances]")


def floating_inputs_entry() -> Uncertainty:
    """Entry of [tolerances] if the solid floats: higher heights then lower the leak rate."""
    return _not_covered(
        "the solid floats on the fluid, and at which ends of [tolerances] most leaks is known of a "
        "solid in contact only: change one input at a time"
    )


def _not_covered(sentence: str) -> Uncertainty:
    return Uncertainty(INPUTS, "not covered", sentence)


def corner(scene: Scene, end: int) -> Scene:
    """The scene with all inputs at the ends that open (1) or close (-1) the film.

    It asks for nothing but the leak rate.
    """
    product = "leak_rate" if scene.seal is None else "seal"
    return scene.scaled(_ends(scene, end)).with_(
        {"tolerances": None, "limit": None, "output.products": [product]}
    )


def _ends(scene: Scene, end: int) -> dict[str, float]:
    """Factor on each input at one end of its tolerance."""
    return {name: 1 + end * OPENS[name] * part for name, part in scene.tolerated.items()}


def inputs_entry(
    scene: Scene, leak: LeakRate, closed: LeakRate, opened: LeakRate, carried: float
) -> Uncertainty:
    """Entry of the inputs in the error budget.

    Parameters
    ----------
    leak, closed, opened
        Leak rates of the scene and of its two corners.
    carried
        Part of the load that the fluid carries: at most all of it.
    """
    carried = min(carried, 1 - TINY)
    shares = input_shares(scene, leak, closed, opened, carried)
    name = max(shares, key=lambda name: shares[name])
    part = scene.tolerated[name]
    sentence = (
        "leak rates with all inputs of [tolerances] at the ends that close or open the film; "
        f"{name} (±{in_digits(100 * part, 2)} %) matters most; that these ends are the extremes is "
        "a theorem for the half-space, not for its grid"
    )
    entry = partial(
        Uncertainty,
        INPUTS,
        "estimated",
        sentence,
        largest=(name, part, shares[name] / (sum(shares.values()) or 1.0)),
    )
    if leak.state == "lifted off" or opened.state == "sealed":
        return entry(1.0, 1.0)
    if opened.state == "lifted off":
        return entry(0.0, None, caution=True)
    most = opened.bounds[1]
    if leak.state == "sealed":
        return entry(1.0, None, caution=True, upper_rate=most)
    least = closed.bounds[0] if closed.state == "leaking" else 0.0
    return entry(min(1.0, least / leak.value), max(1.0, most / leak.value))


def input_shares(
    scene: Scene, leak: LeakRate, closed: LeakRate, opened: LeakRate, carried: float
) -> dict[str, float]:
    """|Δ ln Q| of each input between its own two ends, the others kept; arguments as above.

    ln f is interpolated between those of the three leak rates that are not 0, linearly in ln x.
    Where the fluid carries a part of the load, x has the part that is left to the solid.
    """

    def laws(factors: dict[str, float]) -> tuple[float, float]:
        """Logarithms of x and of Δp s³/η, over those of the scene, with factors on the inputs."""
        other = scene.scaled(factors)
        drop = other.drive.pressure_drop / scene.drive.pressure_drop
        load = prod(factors.get(name, 1.0) for name in LOADS) - carried * drop
        x = max(load, TINY) / (1 - carried) / prod(factors.get(name, 1.0) for name in STIFFNESSES)
        s = factors.get("heights", 1.0)
        return log(x), log(drop * s**3 * scene.viscosity / other.viscosity)

    points = []
    for factors, flow in ((_ends(scene, 1), opened), ({}, leak), (_ends(scene, -1), closed)):
        x, driven = laws(factors)
        if flow.state == "leaking":
            points.append((x, log(flow.value) - driven))

    def change(name: str, end: int) -> float:
        x, driven = laws({name: _ends(scene, end)[name]})
        return driven + _on_line(x, sorted(points))

    return {name: abs(change(name, 1) - change(name, -1)) for name in scene.tolerated}


def _on_line(x: float, points: list[tuple[float, float]]) -> float:
    """Value at x of the line through points (x, y), continued straight; -x through fewer than two.

    Near sealing nothing is known of a slope but its sign: -x then orders the loads.
    """
    if len(points) < 2 or points[0][0] == points[-1][0]:
        return -x
    xs, ys = np.array(points).T
    i = min(max(int(np.searchsorted(xs, x)) - 1, 0), len(xs) - 2)
    return float(ys[i] + (ys[i + 1] - ys[i]) * (x - xs[i]) / (xs[i + 1] - xs[i]))
