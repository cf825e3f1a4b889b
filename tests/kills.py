"""Kill and interrupt commands at random moments, and look at what they leave on the disk.

    python tests/kills.py --count 200 --seed 1

A round starts a command (a run, also on two processes or with gmsh, a sweep, also on two processes,
two sweeps into one folder), ends it after a random time by SIGKILL, SIGINT or SIGTERM, and checks
that each result in its folder is whole and right, with the numbers of an undisturbed run, and that
no point of an earlier round is lost. After every few rounds the command is left to end, and its
folder and the temporary folder must hold what an undisturbed run leaves, and nothing else.
"""

import argparse
import csv
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from project import MPI_ENVIRONMENT, RING, alone, scene_of_samples, write_toml

SCENE = scene_of_samples(32)
SCENE["flow"] = {"pressure_drop": "1 bar", "sides": "periodic", "rtol": 0.3}
del SCENE["output"]
FEM_SEAL = (sys.executable, "-c", "import sys; from fem_seal.cli import main; sys.exit(main())")
FD = ("--set", "flow.method=finite-difference")
AREAS = ("0.02", "0.05", "0.08", "0.1", "0.12", "0.15", "0.2", "0.25", "0.3", "0.35")
SEEDS = tuple(map(str, range(1, 13)))
MPIRUN = ("mpirun", "-n", "2", "--oversubscribe")
RUN = ("run", "scene.toml", "--out", "out", "--set", 'output.products=["leak_rate","mesh"]')
AREA_SWEEP = ("sweep", "scene.toml", "--out", "out", *FD, "--vary")
# What differs from one run to the next.
VARYING = ("seconds", "peak_memory_bytes", "finished", "date")


@dataclass
class Job:
    """Commands that are started together, and how an undisturbed run of them ends."""

    name: str
    commands: tuple[tuple[str, ...], ...]
    share: int  #: of the rounds
    duration: float = 0.0  #: of an undisturbed run [s]
    files: dict[str, object] = field(default_factory=dict)  #: by name, what it leaves


JOBS = (
    Job("run", ((*FEM_SEAL, *RUN),), 5),
    Job("run on two processes", ((*MPIRUN, *FEM_SEAL, *RUN),), 3),
    Job("run with gmsh", ((*FEM_SEAL, "run", "ring.toml", "--out", "out"),), 2),
    Job("sweep", ((*FEM_SEAL, *AREA_SWEEP, f"contact.area_fraction={','.join(AREAS)}"),), 4),
    Job(
        "sweep on two processes",
        ((*FEM_SEAL, *AREA_SWEEP, f"surface.seed={','.join(SEEDS)}", "--jobs", "2"),),
        4,
    ),
    Job(
        "two sweeps into one folder",
        (
            (*FEM_SEAL, *AREA_SWEEP, f"surface.seed={','.join(SEEDS[:8])}"),
            (*FEM_SEAL, *AREA_SWEEP, f"surface.seed={','.join(SEEDS[4:])}"),
        ),
        3,
    ),
)


def environment(temporary: Path) -> dict[str, str]:
    """Variables for a command: not those of an mpirun around this process."""
    return alone() | MPI_ENVIRONMENT | {"TMPDIR": str(temporary)}


def start(job: Job, folder: Path, temporary: Path) -> list[subprocess.Popen]:
    """Start the commands of a job in a folder."""

    def hear() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a shell's background jobs ignore it

    return [
        subprocess.Popen(
            command,
            cwd=folder,
            env=environment(temporary),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=hear,
        )
        for command in job.commands
    ]


def wait(processes: list[subprocess.Popen], temporary: Path) -> list[tuple[int, str]]:
    """Status and error of each, once whatever they have started has ended as well."""
    ends = [(process.communicate()[1], process.returncode) for process in processes]
    mark = f"TMPDIR={temporary}".encode()
    while any(mark in text for text in _environments()):
        time.sleep(0.05)
    return [(status, error) for error, status in ends]


def _environments() -> Iterator[bytes]:
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            yield path.read_bytes()
        except OSError:
            continue  # ended meanwhile, or another user's


def content(folder: Path) -> dict[str, object]:
    """Files below a folder, read as far as they are always the same; ValueError if one is cut."""
    return {
        str(path.relative_to(folder)): _read(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and ".fem-seal" not in str(path.relative_to(folder))
    }


def _read(path: Path) -> object:
    if path.suffix == ".json":
        return _steady(json.loads(path.read_text()))
    if path.suffix == ".csv":
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        if any(None in row or None in row.values() for row in rows):
            raise ValueError(f"{path} ends in the middle of a line")
        return sorted(json.dumps(_steady(row)) for row in rows)
    if path.suffix == ".npz":
        with np.load(path) as data:
            return {name: data[name].tobytes() for name in data}
    if path.suffix == ".vtu":
        if not path.read_text().rstrip().endswith("</VTKFile>"):
            raise ValueError(f"{path} ends early")
        return "mesh"
    return path.suffix


def _steady(part: object) -> object:
    """Leave out what differs from run to run; round what two processes sum in another order."""
    if isinstance(part, dict):
        return {name: _steady(value) for name, value in part.items() if name not in VARYING}
    if isinstance(part, list):
        return [_steady(value) for value in part]
    return float(f"{part:.6g}") if isinstance(part, float) else part


def faults(job: Job, folder: Path, ended: bool) -> Iterator[str]:
    """What is wrong with a folder, from which a command has `ended` by itself or was killed."""
    try:
        there = content(folder)
    except (ValueError, OSError, EOFError) as error:
        yield f"not whole: {error}"
        return
    for name, what in there.items():
        if name not in job.files:
            yield f"{name} is no file of an undisturbed run"
        elif name == "out/summary.csv" and not ended:
            continue  # of the points that are there
        elif name.endswith(".csv") and not ended:
            # A table holds fewer rows before the end, but no other ones.
            whole = job.files[name]
            if isinstance(what, list) and not set(what) <= set(whole):
                yield f"{name} has a row that no undisturbed run has"
        elif what != job.files[name]:
            yield f"{name} differs from that of an undisturbed run"
    if "out/result.json" in there:
        missing = {f"out/{name}" for name in there["out/result.json"]["files"]} - set(there)
        if missing:
            yield f"result.json names {missing}, which are missing"
    if ended and set(there) != set(job.files):
        yield f"missing: {set(job.files) - set(there)}"
    left = [path.name for path in folder.rglob(".fem-seal*")]
    if ended and left:
        yield f"left behind: {left}"


def spoken(status: int, error: str) -> str:
    """How a command that met SIGINT or SIGTERM has ended."""
    if "Traceback" not in error and "Fatal Python error" not in error:
        return {130: "interrupted", 0: "done"}.get(status, f"status {status}")
    # Before the first line of fem_seal's commands Python itself speaks.
    early = 'fem_seal/cli/__init__.py", line' not in error
    return "while Python started" if early else f"traceback: {error[-2000:]}"


def campaign(
    count: int, seed: int, jobs: tuple[Job, ...], every: int = 4
) -> tuple[Counter, list[str]]:
    """End commands at random moments, `count` times; after `every` rounds a job is left to end.

    Returns counts of (job, signal, how it ended), and the faults.
    """
    random_numbers = random.Random(seed)
    counts: Counter = Counter()
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        temporary = place / "tmp"
        temporary.mkdir()
        folders = {}
        for job in jobs:
            folders[job.name] = folder = place / job.name.replace(" ", "-")
            _prepare(folder)
            begin = time.perf_counter()
            ends = wait(start(job, folder, temporary), temporary)
            job.duration = time.perf_counter() - begin
            if any(status for status, _ in ends):
                raise SystemExit(f"{job.name} fails undisturbed: {ends}")
            job.files = content(folder)
            _prepare(folder)
        rounds: Counter = Counter()
        before: dict[str, set[str]] = {job.name: set() for job in jobs}
        for _ in range(count):
            job = random_numbers.choices(jobs, [job.share for job in jobs])[0]
            folder, rounds[job.name] = folders[job.name], rounds[job.name] + 1
            number = random_numbers.choice((signal.SIGKILL, signal.SIGINT, signal.SIGTERM))
            processes = start(job, folder, temporary)
            time.sleep(random_numbers.uniform(0, job.duration))
            for process in processes:
                process.send_signal(number)
            for status, error in wait(processes, temporary):
                killed = number == signal.SIGKILL or "mpirun" in job.commands[0]
                how = "killed" if killed else spoken(status, error)
                counts[job.name, number.name, how] += 1
                if how.startswith(("status", "traceback")) and status != -number:
                    wrong.append(f"{job.name}, {number.name}: {how} {error}")
            wrong += [f"{job.name}, {number.name}: {f}" for f in faults(job, folder, ended=False)]
            points = {path.name for path in folder.glob("out/points/[!.]*.json")}
            if lost := before[job.name] - points:
                wrong.append(f"{job.name}, {number.name}: lost {lost}")
            before[job.name] = points
            if rounds[job.name] % every == 0:
                ends = wait(start(job, folder, temporary), temporary)
                wrong += [f"{job.name}, next run: {end}" for end in ends if end[0]]
                wrong += [f"{job.name}, next run: {f}" for f in faults(job, folder, ended=True)]
                counts[job.name, "", "next run"] += 1
                _prepare(folder)
                before[job.name] = set()
        # Open MPI leaves a folder of its own when it is killed.
        left = [path.name for path in temporary.iterdir() if path.name.startswith((".fem", "fem"))]
        if left:
            for job in jobs:
                wait(start(job, folders[job.name], temporary), temporary)
            left = [name for name in left if (temporary / name).exists()]
        wrong += [f"left in the temporary folder: {left}"] * bool(left)
    return counts, wrong


def _prepare(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write_toml(folder / "scene.toml", SCENE)
    write_toml(folder / "ring.toml", RING)


def main() -> int:
    """Run the campaign and print a table of it."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--count", type=int, default=200)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    counts, wrong = campaign(chosen.count, chosen.seed, JOBS)
    print("| command | signal | how it ended | times |\n|---|---|---|---|")
    for (job, number, how), times in sorted(counts.items()):
        print(f"| {job} | {number} | {how.splitlines()[0]} | {times} |")
    print(f"\n{chosen.count} rounds, {len(wrong)} faults")
    print("\n".join(wrong))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
