"""Random small scenes whose fluid lifts the solid: do contact and flow settle, and rightly?

Each scene is solved, then from the inlet's pressure, then with a tenth of the tolerance. A state
that has settled and is no range is *wrong* if one of these changes its leak rate by more than both
claim. Where the theorem of the range holds, the lifted leak rate is also compared with the two ends
of the range.

    python tests/coupling/lift_campaign.py [SCENES] [--into FOLDER] [--part 1/2]

Each scene is a file in FOLDER. Scenes in the folder are not solved again: a campaign can be stopped
and continued, and can run in several processes, each with a part of the scenes. The counts at the
end are those of all scenes in the folder.
"""

import argparse
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np
from lifted_scenes import E_STAR, from_pressure, problem_of
from lifted_scenes import scene as rubber

from fem_seal.area_error import area_error
from fem_seal.coupling import LiftedState, lifted_state
from fem_seal.errors import NotConverged
from fem_seal.leak_rate import log_ratio
from fem_seal.patch import Given, Patch
from fem_seal.points import PointFolder, StudyTask, Work, compute_points
from fem_seal.quantities.lift import lift_range
from fem_seal.scene import Scene

SEED, RTOL = 20120612, 0.05
SLOPE = 0.1  # rms, of the scenes
SEALED = 1500.0  # |Δ ln Q| to no leak rate: more than between any two numbers


@dataclass(frozen=True)
class Outcome:
    """One scene: its state, how far other solves take ln Q from it, and what it cost."""

    state: str
    converged: bool
    reason: str
    seconds: float  # CPU time of dry contact, steps and flow
    steps: int = 0
    claimed: float = 0.0  # error of ln Q by the error budget, with the bounds of the flow
    exact: float | None = None  # |Δ ln Q| to the state with a tenth of the tolerance, if it settles
    apart: float | None = None  # |Δ ln Q| between the two starts, if both settle
    second: float = 0.0  # error of ln Q that the state of the second start claims
    outside: float = 0.0  # how far ln Q is outside the range, 0 inside
    all_seconds: float = 0.0  # the checks included

    @property
    def wrong(self) -> bool:
        """Whether a state called settled is not that of other solves."""
        return self.converged and (
            (self.exact is not None and self.exact > 1.1 * self.claimed)
            or (self.apart is not None and self.apart > self.claimed + self.second)
        )


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


def outcome(number: int) -> Outcome:
    """Solve the scene of a number and check its state."""
    scene, start = random_scene(number), process_time()
    patch = Patch(scene)
    problem = problem_of(scene, patch.surface)
    try:
        state = lifted_state(problem, dry=patch.contact)
    except NotConverged as error:
        return Outcome("failed", False, str(error), process_time() - start)
    seconds = process_time() - start
    checks: dict[str, float | None] = {}
    # Of a network of links that is open along diagonals only, which its leak rate says.
    unfinished = "" if state.leak_rate is None else state.leak_rate.reason
    if "diagonals" not in unfinished:
        unfinished = ""
    if state.state != "lifted off":
        flow = 0.0 if scene.flow.method == "finite-difference" else RTOL / 2
        checks = {"claimed": _claimed(patch, state) + flow}
        checks["outside"] = _outside(scene, patch, state)
        tight = {"flow.rtol": RTOL / 10}
        if scene.flow.method != "finite-difference":
            tight["flow.max_unknowns"] = 10 * scene.flow.max_unknowns
        finer = lifted_state(problem_of(scene.with_(tight), patch.surface))
        if finer.state != "lifted off" and not finer.is_range:
            checks["exact"] = apart(state.leak_rate.value, finer.leak_rate.value)
        if problem.load is None or problem.load > 1.01 * problem.inlet:
            second = from_pressure(problem, problem.inlet)
            checks["second"] = _claimed(patch, second) + flow
            if not (state.is_range or second.is_range):
                checks["apart"] = apart(state.leak_rate.value, second.leak_rate.value)
    return Outcome(
        state=state.state,
        converged=not (state.is_range or unfinished),
        reason=state.reason or unfinished or ("sealed, with a range" if state.is_range else ""),
        seconds=seconds,
        steps=state.steps,
        all_seconds=process_time() - start,
        **checks,
    )


def _claimed(patch: Patch, state: LiftedState) -> float:
    """Error of ln Q by the lift, and by the search for a contact area."""
    other = patch.with_(Given())
    other.lifted = state
    of_area = area_error(other)
    return min(SEALED, state.error + (0.0 if of_area is None else of_area.log_error))


def _outside(scene: Scene, patch: Patch, state: LiftedState) -> float:
    """How far ln Q lies outside the leak rates of the dry contacts; 0 where no theorem holds."""
    if scene.contact.pressure is None or scene.solid.layer_thickness is not None:
        return 0.0
    low, high = lift_range(patch)
    value = state.leak_rate.value
    return apart(value, min(max(value, low.value), high.value))


def print_all(outcomes: dict[int, Outcome]) -> int:
    """Print each scene and the counts; 1 if a settled state is wrong."""
    for number, one in outcomes.items():
        print(number, "WRONG" if one.wrong else "", one)
    every = outcomes.values()
    wrong = [number for number, one in outcomes.items() if one.wrong]
    print(f"{len(every)} scenes: {dict(Counter(one.state for one in every))}")
    print(f"settled {sum(one.converged for one in every)}, the others:")
    print(dict(Counter(one.reason.split(":")[0].split(" after ")[0] for one in every)))
    print(f"both starts settled {sum(one.apart is not None for one in every)}, wrong {wrong}")
    print("outside the range", [n for n, one in outcomes.items() if one.outside > one.claimed])
    print("steps, median", median(one.steps for one in every))
    seconds = sum(one.seconds for one in every), sum(one.all_seconds for one in every)
    print("CPU {:.0f} s, with checks {:.0f} s".format(*seconds))
    return 1 if wrong else 0


def main() -> int:
    """Solve the scenes of this part that the folder lacks; print all and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", type=int, nargs="?", default=500)
    parser.add_argument("--into", type=Path, default=Path("lift_campaign"))
    parser.add_argument("--part", default="1/1")
    args = parser.parse_args()
    folder, numbers = PointFolder(args.into, Outcome), range(args.scenes)
    tasks = [StudyTask(str(n), f"scene {n}", outcome, (n,)) for n in numbers]
    part = tuple(int(text) for text in args.part.split("/"))
    compute_points(folder, tasks, Work(part=part), report=lambda *words: print(*words, flush=True))
    found = {n: folder.load(str(n)) for n in numbers if folder.finished(str(n))}
    return print_all(found)


if __name__ == "__main__":
    sys.exit(main())
