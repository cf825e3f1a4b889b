"""Many cheap points, killed again and again and gathered without a lost or a wrong row.

    python tests/many_kills.py [POINTS] [KILLS] [SEED]     (1000, 100 and 1 if left out)

Half the kills are SIGKILL, half Ctrl-C, after random times. After each, every row of the table must
be that of an undisturbed sweep, and every file of a point must still exist.
"""

import csv
import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from project import alone, scene_of_samples, write_toml

SCENE = scene_of_samples(16)
SCENE["contact"]["model"] = "bearing"


def command(points, out, jobs):
    return [
        *(sys.executable, "-m", "fem_seal", "sweep", "scene.toml", "--vary"),
        *(f"surface.seed=1..{points}", "--jobs", str(jobs), "--out", str(out)),
    ]


def rows(folder):
    """Rows by seed, without what differs from run to run."""
    with (folder / "sweep.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    for row in table:
        del row["seconds"], row["peak_memory_bytes"]
    return {row["surface.seed"]: row for row in table}


def points_in(folder):
    """Files of finished points; one that is still being written has a name with a dot in front."""
    return {path.name for path in (folder / "points").glob("[!.]*.json")}


def wait_for_points(number, folder, process):
    """Wait until a folder has a number of points or a process has ended."""
    deadline = time.monotonic() + 60
    while process.poll() is None and len(points_in(folder)) < number:
        assert time.monotonic() < deadline, "a minute without a point"
        time.sleep(0.01)


def campaign(points, kills, seed, folder):
    """Run the campaign in a folder; return what it has counted."""
    moments = random.Random(seed)
    write_toml(folder / "scene.toml", SCENE)
    nowhere = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet = {"cwd": folder, "env": alone(), **nowhere}
    whole, out = folder / "whole", folder / "out"
    subprocess.run(command(points, whole, 1), check=True, **quiet)
    expected = rows(whole)
    assert len(expected) == points
    counts = {"killed": 0, "ended before": 0, "wrong rows": 0, "lost points": 0}
    before: set[str] = set()
    for _ in range(kills):
        process = subprocess.Popen(command(points, out, moments.choice([1, 2])), **quiet)
        # A run ends early where it has a share more points than it found, or in its first seconds.
        more = moments.randint(0, 2 * points // kills)
        wait_for_points(len(before) + more, out, process)
        time.sleep(moments.uniform(0.0, 0.2))
        if process.poll() is None:
            process.send_signal(moments.choice([signal.SIGKILL, signal.SIGINT]))
            process.wait(60)
            counts["killed"] += 1
        else:
            counts["ended before"] += 1
        if (out / "sweep.csv").exists():
            counts["wrong rows"] += sum(expected[s] != row for s, row in rows(out).items())
        there = points_in(out)
        counts["lost points"] += len(before - there)
        before = there
        counts["points when last killed"] = len(there)
    deadline = time.monotonic() + 60
    # Workers of the run that was killed last may still hold the folder for a moment.
    while (status := subprocess.run(command(points, out, 2), check=False, **quiet).returncode) == 2:
        assert time.monotonic() < deadline
    assert status == 0
    counts["wrong or lost rows at the end"] = sum(
        rows(out).get(s) != row for s, row in expected.items()
    )
    # Staging files of killed runs are cleared away by the next one.
    names = {"points", "sweep.csv", "sweep.json", "summary.csv"}
    counts["files left behind"] = len({path.name for path in out.iterdir()} - names)
    counts["files left behind"] += len(list((out / "points").iterdir())) - points
    return counts


def main():
    points, kills, seed = ([int(a) for a in sys.argv[1:]] + [1000, 100, 1][len(sys.argv) - 1 :])[:3]
    with tempfile.TemporaryDirectory() as folder:
        counts = campaign(points, kills, seed, Path(folder))
    print(json.dumps({"points": points, "kills": kills, "seed": seed} | counts, indent=1))
    faults = ("wrong rows", "lost points", "wrong or lost rows at the end", "files left behind")
    sys.exit(any(counts[name] for name in faults))


if __name__ == "__main__":
    main()
