"""What resolving the lift costs: CPU time over that of the dry run, on twelve scenes.

    python tests/benchmarks/lift_cost.py [SAMPLES ...]     # 256 if left out

Rough rubber as in demos/scenes/first.toml; contact pressures from open to near closing, the fluid
at 5 to 80 % of each. Prints a row a scene and the geometric mean.
"""

import sys
from math import exp, log
from pathlib import Path
from time import process_time

from fem_seal import Scene
from fem_seal.patch import Patch

SCENE = Path(__file__).parents[2] / "demos" / "scenes" / "first.toml"
LOADS = (0.08e6, 0.15e6, 0.22e6)  # Pa
SHARES = (0.05, 0.2, 0.5, 0.8)  # of the fluid's pressure in the load


def cost(scene: Scene) -> tuple[float, Patch]:
    """CPU seconds of a run, and its patch."""
    start = process_time()
    patch = Patch(scene)
    patch.leak_rate  # noqa: B018
    return process_time() - start, patch


def main(samples: list[int]) -> None:
    """Print the table."""
    print("samples  P0 [MPa]  p_in/P0  dry A/A0  lifted  passes  settled  CPU dry [s]  ratio")
    ratios = []
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
                (dry, before), (lifted, after) = (cost(scene) for scene in scenes)
                ratios.append(lifted / dry)
                print(
                    f"{n:7} {load / 1e6:9.2f} {share:8.2f} "
                    f"{before.film.contact_area_fraction:9.3f} "
                    f"{after.film.contact_area_fraction:7.3f} {after.lifted.passes:7} "
                    f"{after.lifted.converged!s:>8} {dry:12.2f} {lifted / dry:6.2f}",
                    flush=True,
                )
    mean = exp(sum(map(log, ratios)) / len(ratios))
    print(f"geometric mean of {len(ratios)} ratios: {mean:.2f}")


if __name__ == "__main__":
    main([int(text) for text in sys.argv[1:]] or [256])
