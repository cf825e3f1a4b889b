"""Random small scenes whose fluid lifts the solid: do contact and flow settle, and rightly?

    python tests/coupling/lift_campaign.py [[FIRST] AFTER_THE_LAST]

Each scene is solved, then from the inlet's pressure, then with a tenth of the tolerance. A state
that has settled and is no range is *wrong* if one of these changes its leak rate by more than both
claim. Where the theorem of the range holds, the lifted leak rate is also compared with the two ends
of the range. A scene follows from its number alone.
"""

import sys
from collections import Counter

import numpy as np
from lifted_scenes import E_STAR, from_pressure, problem_of
from lifted_scenes import scene as rubber

from fem_seal.area_error import area_error
from fem_seal.coupling import LiftedState, lifted_state
from fem_seal.leak_rate import log_ratio
from fem_seal.patch import Given, Patch
from fem_seal.quantities.lift import lift_range
from fem_seal.scene import Scene

SEED, RTOL = 20120612, 0.05
SLOPE = 0.1  # rms, of the scenes
SEALED = 1500.0  # |Δ ln Q| to no leak rate: more than between any two numbers


def random_scene(number: int) -> Scene:
    """Scene of a number: loads up to closing, fluid pressures to lift-off and beyond."""
    rng = np.random.default_rng([SEED, number])
    n = int(rng.choice([48, 64, 128], p=[0.5, 0.4, 0.1]))
    size = 1e-4
    load = SLOPE * E_STAR * float(np.exp(rng.uniform(np.log(0.02), np.log(0.35))))
    inlet = load * float(np.exp(rng.uniform(np.log(0.01), np.log(1.2))))
    method = str(rng.choice(["adaptive", "adaptive", "finite-difference"]))
    gas = rng.random() < 0.2
    fluid, flow = None, {"method": method, "rtol": RTOL}
    if gas:
        fluid = {"kind": "gas", "viscosity": 2e-5, "molar_mass": 0.028, "temperature": 293.0}
        flow |= {"inlet_pressure": 1e5 + inlet, "outlet_pressure": 1e5}
    solid, contact = {}, None
    if rng.random() < 0.2:
        solid = {"layer_thickness": size * float(rng.uniform(0.1, 1)), "layer_poisson_ratio": 0.4}
    if rng.random() < 0.1:
        contact = {"area_fraction": float(rng.uniform(0.02, 0.4))}
    others = {
        "surface.hurst": float(rng.uniform(0.5, 0.9)),
        "surface.long_wavelength": size * float(rng.uniform(0.25, 0.8)),
        "surface.short_wavelength": size / n * float(rng.uniform(2, 7)),
        "accuracy": None,
    }
    flow["sides"] = str(rng.choice(["wall", "periodic"]))
    flow["representation"] = str(rng.choice(["linear", "constant"]))
    # Narrows that no bounds enclose soon are no matter of the lift.
    flow |= {} if method == "finite-difference" else {"max_unknowns": 20000}
    made = rubber(load, inlet, n, number, solid=solid, fluid=fluid, contact=contact, **flow)
    return made.with_(others)


def apart(one: float, other: float) -> float:
    """|Δ ln Q|; 0 if both are sealed."""
    return min(SEALED, log_ratio(one, other))


def verdict_on(number: int) -> tuple[str, str]:
    """Solve the scene of a number: its state, and what other solves say of it."""
    scene = random_scene(number)
    patch = Patch(scene)
    problem = problem_of(scene, patch.surface)
    state = lifted_state(problem, dry=patch.contact)
    if state.state == "lifted off":
        return state.state, "settled"
    rate, claimed = state.leak_rate.value, _claimed(patch, state)
    if _outside(scene, patch, state) > claimed:
        return state.state, "outside the range"
    # Of a stencil that is open along diagonals only, which its leak rate says.
    if "diagonals" in state.leak_rate.reason:
        return state.state, "not settled: diagonals"
    if state.is_range:
        return state.state, f"not settled: {state.reason}" if state.reason else "a range"
    tight = {"flow.rtol": RTOL / 10}
    if scene.flow.method != "finite-difference":
        tight["flow.max_unknowns"] = 10 * scene.flow.max_unknowns
    finer = lifted_state(problem_of(scene.with_(tight), patch.surface))
    known = finer.leak_rate is not None and not finer.is_range
    if known and apart(rate, finer.leak_rate.value) > 1.1 * claimed:
        return state.state, "wrong: a tenth of the tolerance"
    if problem.load is None or problem.load > 1.01 * problem.inlet:
        second = from_pressure(problem, problem.inlet)
        allowed = claimed + _claimed(patch, second)
        if not second.is_range and apart(rate, second.leak_rate.value) > allowed:
            return state.state, "wrong: the other start"
    return state.state, "settled"


def _claimed(patch: Patch, state: LiftedState) -> float:
    """Error of ln Q by the lift, the search for a contact area, and the bounds of the flow."""
    other = patch.with_(Given())
    other.lifted = state
    of_area = area_error(other)
    flow = 0.0 if patch.scene.flow.method == "finite-difference" else RTOL / 2
    return min(SEALED, state.error + flow + (0.0 if of_area is None else of_area.log_error))


def _outside(scene: Scene, patch: Patch, state: LiftedState) -> float:
    """How far ln Q lies outside the leak rates of the dry contacts; 0 where no theorem holds."""
    if scene.contact.pressure is None or scene.solid.layer_thickness is not None:
        return 0.0
    low, high = lift_range(patch)
    value = state.leak_rate.value
    return apart(value, min(max(value, low.value), high.value))


def campaign(numbers: range) -> Counter:
    """States and verdicts of the scenes of these numbers; all but the settled ones are printed."""
    counts: Counter = Counter()
    for number in numbers:
        state, verdict = verdict_on(number)
        counts[state, verdict.split(":")[0]] += 1
        if verdict != "settled":
            print(number, state, verdict, flush=True)
    return counts


if __name__ == "__main__":
    print(campaign(range(*map(int, sys.argv[1:] or ["500"]))))
