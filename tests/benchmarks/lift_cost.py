"""What resolving the lift costs: CPU time and peak memory over those of the dry run.

    python tests/benchmarks/lift_cost.py [SAMPLES ...]     # 256 if left out

Rough rubber as in demos/scenes/first.toml; three loads from open to next to closing, the fluid at 5
to 80 % of each. Prints a row for each scene and the geometric means. The memory is the largest of
the process, libraries included (0.2 GB).
"""

import sys
from math import exp, log
from pathlib import Path

from rough_gaps import cost_of

from fem_seal import Scene
from fem_seal.coupling import LiftedState
from fem_seal.patch import Patch

SCENE = Path(__file__).parents[2] / "demos" / "scenes" / "first.toml"
LOADS = (0.08e6, 0.15e6, 0.22e6)  # Pa
SHARES = (0.05, 0.2, 0.5, 0.8)  # of the fluid's pressure in the load


def cost(scene: Scene) -> tuple[float, int, float, LiftedState | None]:
    """CPU seconds, peak memory [bytes], contact area fraction and lifted state of a run."""
    patch = Patch(scene)
    _, seconds, memory = cost_of(lambda: patch.leak_rate)
    return seconds, memory, patch.film.contact_area_fraction, patch.lifted


def main(samples: list[int]) -> None:
    """Print the table."""
    print("samples P0 [MPa] p_in/P0 dry A/A0 lifted  steps settled CPU dry [s]  ratio  memory")
    ratios, memories = [], []
    for n in samples:
        for load in LOADS:
            for share in SHARES:
                settings = [f"surface.shape=[{n}, {n}]", f"contact.pressure={load}"]
                settings += [f"flow.pressure_drop={share * load}"]
                settings += ['output.products=["leak_rate"]']
                scenes = [
                    Scene.from_file(SCENE, [*settings, f"flow.lift={lift}"])
                    for lift in ("none", "resolved")
                ]
                cost(scenes[0])  # so that nothing is compiled in what is timed
                dry, low, area, _ = cost(scenes[0])
                lifted, high, lifted_area, state = cost(scenes[1])
                ratios.append(lifted / dry)
                memories.append(high / low)
                print(
                    f"{n:7} {load / 1e6:8.2f} {share:7.2f} {area:8.3f} {lifted_area:6.3f} "
                    f"{state.steps:6} {state.converged!s:>7} {dry:11.2f} {ratios[-1]:6.2f} "
                    f"{memories[-1]:7.2f}",
                    flush=True,
                )
    time, memory = (exp(sum(map(log, some)) / len(some)) for some in (ratios, memories))
    print(f"geometric means of {len(ratios)}: CPU time {time:.2f}, memory {memory:.2f}")


if __name__ == "__main__":
    main([int(text) for text in sys.argv[1:]] or [256])
