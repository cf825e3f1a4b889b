"""How far predicted time and memory are off (`fem-seal run --dry-run`).

    OMP_NUM_THREADS=1 python tests/benchmarks/prediction.py [--most SECONDS] [--runs N]

Runs scenes of all kinds as a user does, each in a process of its own: contacts, dry and lifted
flows, seals, pictures. Prints CPU seconds and peak memory over those predicted, and how many lie
within a factor of 1.5. Scenes that are predicted to take longer than --most (60 s) are left out.
The constants of `fem_seal/prediction.py` were fitted to the first column of seconds on one machine.
The machine's pace is taken anew before each run: on a virtual one it may change twofold within
seconds, which the factors contain. The means of several runs contain less of it.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path
from statistics import mean

from fem_seal import prediction
from fem_seal.scene import Scene

SCENES = Path(__file__).parents[2] / "demos" / "scenes"
WITHIN = 1.5


def cases() -> list[tuple[str, list[str]]]:
    """Scene files of demos/scenes with settings."""
    found = [("first.toml", [])]
    for n, load, rtol, lift in product(
        (64, 256, 512, 1024), (0.08, 0.15), (0.05, 0.3), ("none", "resolved")
    ):
        settings = [f"surface.shape=[{n},{n}]", f"surface.size=['{n} um','{n} um']"]
        settings += [f"surface.long_wavelength={n / 4} um", "surface.short_wavelength=4 um"]
        settings += [f"contact.pressure={load} MPa", "flow.pressure_drop=0.3 bar"]
        settings += [f"flow.rtol={rtol}", f"flow.lift={lift}", 'output.products=["leak_rate"]']
        found.append(("first.toml", settings))
    for n in (256, 1024, 2048):
        dry = [f"surface.shape=[{n},{n}]", 'output.products=["contact"]', "flow.lift=none"]
        found.append(("first.toml", dry))
    for n, profile, load, rtol in product(
        (64, 128, 256), ("uniform", "hertz"), (0.4, 0.5), (0.1, 0.5)
    ):
        settings = [f"surface.shape=[{n},{n}]", f"surface.size=['{n} um','{n} um']"]
        settings += [f"surface.long_wavelength={n / 4} um", "surface.short_wavelength=4 um"]
        settings += [f"contact.pressure={load} MPa", f"seal.pressure_profile={profile}"]
        settings += [f"seal.rtol={rtol}", "seal.patches=3", 'output.products=["seal"]']
        found.append(("o-ring.toml", settings))
    found += [("o-ring.toml", []), ("o-ring-measured.toml", [])]
    return found


def measured(scene: str, settings: list[str], out: str) -> tuple[float, float]:
    """CPU seconds and peak memory [bytes] of `fem-seal run`."""
    command = [sys.executable, "-m", "fem_seal", "run", str(SCENES / scene), "--out", out]
    if scene.startswith("o-ring"):
        command += ["--jobs", "1"]  # the CPU time of workers is not counted
    command += [word for setting in settings for word in ("--set", setting)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, _, used = os.wait4(process.pid, 0)
    result = json.loads((Path(out) / "result.json").read_text(encoding="utf-8"))
    return used.ru_utime + used.ru_stime, result["peak_memory_bytes"]


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--most", type=float, default=60.0)
    options.add_argument("--runs", type=int, default=1, help="runs of each scene")
    given = options.parse_args()
    times, memories = [], []
    print("seconds  predicted  factor  GB    predicted  factor  scene")
    for scene, settings in cases():
        runs = []
        for _ in range(given.runs):
            prediction._pace.cache_clear()
            said = prediction.predicted(Scene.from_file(SCENES / scene, settings))
            if said.seconds > given.most:
                break
            with tempfile.TemporaryDirectory() as out:
                seconds, memory = measured(scene, settings, out)
            runs.append((seconds, said.seconds, memory, said.memory))
        if not runs:
            continue
        seconds, expected, memory, expected_memory = map(mean, zip(*runs, strict=True))
        times.append(seconds / expected)
        memories.append(memory / expected_memory)
        print(
            f"{seconds:7.1f}  {expected:9.1f}  {times[-1]:6.2f}  {memory / 1e9:4.2f}  "
            f"{expected_memory / 1e9:9.2f}  {memories[-1]:6.2f}  {scene} {' '.join(settings)}",
            flush=True,
        )
    if not times:
        print("no scene is predicted to be so short")
        return
    for name, factors in (("time", times), ("memory", memories)):
        within = sum(1 / WITHIN <= factor <= WITHIN for factor in factors)
        print(
            f"{name}: {within} of {len(factors)} within a factor of {WITHIN}; "
            f"{min(factors):.2f} to {max(factors):.2f}"
        )


if __name__ == "__main__":
    main()
