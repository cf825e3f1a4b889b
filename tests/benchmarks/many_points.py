"""How much faster two jobs are than one, over seeds of a scene; alternating runs.

    python tests/benchmarks/many_points.py [SCENE.toml] [SEEDS]

Prints the wall time of each, their ratio, the load of the machine before each run, and whether both
tables are the same. The ratio means something only if that load is near 0.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))
from project import ROOT, rows

SCENE = ROOT / "demos" / "scenes" / "first.toml"


def timed(scene, seeds, jobs, out):
    command = [sys.executable, "-m", "fem_seal", "sweep", scene, "--jobs", jobs, "--out", out]
    command += ["--vary", f"surface.seed=1..{seeds}", "--set", "flow.lift=none"]
    load = os.getloadavg()[0]
    start = time.monotonic()
    subprocess.run(
        list(map(str, command)),
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        check=True,
        stdout=subprocess.DEVNULL,
    )
    seconds = time.monotonic() - start
    print(f"{jobs} jobs: {seconds:.1f} s (load before: {load:.2f})", flush=True)
    return seconds


def main():
    scene = Path(sys.argv[1]) if len(sys.argv) > 1 else SCENE
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 24
    with tempfile.TemporaryDirectory() as folder:
        timed(scene, 1, 1, Path(folder, "forms"))
        one = timed(scene, seeds, 1, Path(folder, "one"))
        two = timed(scene, seeds, 2, Path(folder, "two"))
        same = rows(Path(folder, "one")) == rows(Path(folder, "two"))
    print(f"{seeds} seeds of {scene.name}: {one / two:.2f} times as fast; the same rows: {same}")


if __name__ == "__main__":
    main()
