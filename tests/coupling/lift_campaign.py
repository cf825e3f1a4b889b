"""Random small scenes whose fluid lifts the solid: do contact and flow settle, and rightly?

Each scene is solved, then solved again from the inlet's pressure, and the first state is passed on
ten times by another iteration (plain passes, damped by half). A state that calls itself settled is
*wrong* if one of these changes its leak rate by more than the tolerance of the flow. The lifted
leak rate is held against the two ends of the range as well, where the theorem speaks of it.

    python tests/coupling/lift_campaign.py [SCENES] [FIRST]     # one line a scene, then the counts
"""

import sys
from collections import Counter
from dataclasses import dataclass
from math import inf, log
from time import process_time

import numpy as np
from lifted_scenes import problem_of

from fem_seal.coupling.fluid_pressure import pressure_on_samples
from fem_seal.coupling.lifted import LiftedState, LiftProblem, lifted, lifted_from
from fem_seal.errors import NotConverged
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene import Scene

SEED, RTOL, MORE = 20120612, 0.05, 10
E_STAR, SLOPE = 1e7, 0.1


@dataclass(frozen=True)
class Outcome:
    """One scene: its state, how far other iterations take ln Q from it, and what it cost."""

    state: str
    converged: bool
    passes: int
    drift: float  # largest |Δ ln Q| of ten more passes
    apart: float  # |Δ ln Q| between the two starts; None-like inf if one of them has not settled
    both: bool  # whether both starts have settled
    outside: float  # how far ln Q is outside the range, 0 inside
    seconds: float

    @property
    def wrong(self) -> bool:
        """Whether a state called settled is not that of other iterations."""
        return self.converged and (self.drift > RTOL or (self.both and self.apart > RTOL))


def random_scene(number: int) -> Scene:
    """Scene of a number: loads to near closing, fluid pressures to lift-off and beyond."""
    rng = np.random.default_rng([SEED, number])
    n = int(rng.choice([32, 48, 64]))
    size = 1e-4
    load = SLOPE * E_STAR * float(np.exp(rng.uniform(np.log(0.02), np.log(0.35))))
    inlet = load * float(np.exp(rng.uniform(np.log(0.01), np.log(1.2))))
    method = str(rng.choice(["adaptive", "adaptive", "finite-difference"]))
    gas = rng.random() < 0.2
    fluid = {"viscosity": 1e-3}
    pressures = {"pressure_drop": inlet}
    if gas:
        fluid = {"kind": "gas", "viscosity": 2e-5, "molar_mass": 0.028, "temperature": 293.0}
        pressures = {"inlet_pressure": 1e5 + inlet, "outlet_pressure": 1e5}
    solid = {"contact_modulus": E_STAR}
    if rng.random() < 0.2:
        solid |= {"layer_thickness": size * float(rng.uniform(0.1, 1)), "layer_poisson_ratio": 0.4}
    contact = {"pressure": load}
    if rng.random() < 0.1:
        contact = {"area_fraction": float(rng.uniform(0.02, 0.4))}
    return Scene.from_mapping(
        {
            "surface": {
                **{"kind": "self-affine", "shape": [n, n], "size": [size, size]},
                **{"hurst": float(rng.uniform(0.5, 0.9)), "rms_slope": SLOPE, "seed": number},
                "long_wavelength": size * float(rng.uniform(0.25, 0.8)),
                "short_wavelength": size / n * float(rng.uniform(2, 7)),
            },
            "solid": solid,
            "contact": contact,
            "fluid": fluid,
            "flow": {
                **{"sides": str(rng.choice(["wall", "periodic"])), "lift": "resolved"},
                **{"representation": str(rng.choice(["linear", "constant"])), "rtol": RTOL},
                # Narrows that no bounds enclose soon are no matter of the lift.
                **({} if method == "finite-difference" else {"max_unknowns": 20000}),
                **{"method": method},
                **pressures,
            },
            "output": {"products": ["leak_rate"]},
        }
    )


def apart(one: float, other: float) -> float:
    """|Δ ln Q|; 0 if both are sealed."""
    if one == other:
        return 0.0
    return abs(log(one / other)) if one > 0 and other > 0 else inf


def drift(problem: LiftProblem, state: LiftedState) -> float:
    """Largest |Δ ln Q| on ten more passes, each going half of the way to the flow's pressure."""
    pressure, contact, far = state.fluid_pressure.values, state.contact, 0.0
    for _ in range(MORE):
        heights = problem.height.values - problem.displacement(pressure)
        load = None if problem.load is None else problem.load - pressure.mean()
        if load is not None and load <= 0:
            return inf
        surface = GridField(heights, problem.height.spacing, periodic=True)
        contact = problem.press(surface, load, contact)
        film = problem.film(contact.gap)
        leak = problem.flow(film, RTOL)
        far = max(far, apart(leak.value, state.leak_rate.value))
        carried = None if leak.state == "sealed" else problem.carried(film, leak)
        made = pressure_on_samples(film, problem.inlet, problem.outlet, carried)
        pressure = (pressure + made) / 2
    return far


def outcome(scene: Scene) -> Outcome:
    """Solve a scene and check its state."""
    start = process_time()
    patch = Patch(scene)
    problem = problem_of(scene, patch.surface)
    state = lifted(problem, RTOL, dry=patch.contact)
    seconds = process_time() - start
    if state.state == "lifted off":
        return Outcome(state.state, True, state.passes, 0.0, inf, False, 0.0, seconds)
    other, both = inf, False
    if problem.load is None or problem.load > 1.01 * problem.inlet:
        high = np.full(problem.height.shape, problem.inlet)
        second = lifted_from(problem, RTOL, high, None)
        if second.state != "lifted off":
            both = state.converged and second.converged
            other = apart(state.leak_rate.value, second.leak_rate.value)
    return Outcome(
        state=state.state,
        converged=state.converged,
        passes=state.passes,
        drift=drift(problem, state) if state.converged else inf,
        apart=other,
        both=both,
        outside=_outside(scene, patch, state),
        seconds=seconds,
    )


def _outside(scene: Scene, patch: Patch, state: LiftedState) -> float:
    """How far ln Q lies outside the leak rates of the dry contacts; 0 where no theorem holds."""
    if scene.contact.pressure is None or scene.solid.layer_thickness is not None:
        return 0.0
    low, high = patch.lift_range
    value = state.leak_rate.value
    below = apart(value, low.value) if value < low.value else 0.0
    above = apart(value, high.value) if value > high.value else 0.0
    return max(below, above)


def main(scenes: int, first: int) -> int:
    """Print a line for each scene and the counts; 1 if a settled state is wrong."""
    outcomes, failed = [], 0
    for number in range(first, first + scenes):
        try:
            one = outcome(random_scene(number))
        except NotConverged as error:
            failed += 1
            print(number, "not converged:", error, flush=True)
            continue
        outcomes.append(one)
        mark = "WRONG" if one.wrong else "" if one.converged else "not settled"
        print(
            f"{number:4} {one.state:10} passes {one.passes:3} drift {one.drift:8.2g} "
            f"apart {one.apart:8.2g} outside {one.outside:8.2g} {one.seconds:6.2f} s {mark}",
            flush=True,
        )
    wrong = sum(one.wrong for one in outcomes)
    settled = [one for one in outcomes if one.converged]
    print(f"{len(outcomes)} scenes: {dict(Counter(one.state for one in outcomes))}")
    print(f"settled {len(settled)}, not settled {len(outcomes) - len(settled)}, failed {failed}")
    print(
        f"wrong {wrong}; outside the range by more than the flow's tolerance "
        f"{sum(one.outside > RTOL for one in outcomes)}"
    )
    passes = sorted(one.passes for one in settled)
    print(
        f"passes: median {passes[len(passes) // 2]}, most {passes[-1]}; "
        f"CPU {sum(one.seconds for one in outcomes):.0f} s"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:3]]
    sys.exit(main(*(numbers + [500, 0][len(numbers) :])))
