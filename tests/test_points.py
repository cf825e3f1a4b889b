"""Points in many processes: same rows for any number of jobs and parts, whichever is killed."""

import csv
import pickle
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import in_workers
import pytest
from project import MPI_ENVIRONMENT, alone, rows, scene_of_samples, started, write_toml

from fem_seal import cli
from fem_seal.errors import Inconsistent, InvalidInput, InvalidScene
from fem_seal.points import (
    Expected,
    Outcome,
    PointFolder,
    StudyTask,
    compute_points,
    compute_study,
)
from fem_seal.points.compute import compute_point
from fem_seal.points.farm import farm
from fem_seal.prediction import PICTURE_IMPORTS, predicted
from fem_seal.scene import Scene
from fem_seal.sweep import Work, combinations, read_points, sweep
from fem_seal.sweep.point import numbers_only
from fem_seal.worker import Worker, peak_of_workers

MB = in_workers.MB
VARY = ("--vary", "surface.seed=1..2", "--vary", "contact.area_fraction=0.1,0.2")


pytestmark = pytest.mark.usefixtures("scene_file")


def run(*arguments):
    return cli.main(["sweep", "scene.toml", *arguments])


@pytest.fixture(scope="module")
def rows_of_one(tmp_path_factory):
    """Rows of the small scene varied by VARY, all computed by this process."""
    folder = tmp_path_factory.mktemp("one")
    scene = write_toml(folder / "scene.toml", scene_of_samples(32))
    sweep(scene, combinations(*VARY[1::2]), folder / "out")
    return rows(folder / "out")


def test_rows_are_the_same_for_jobs_and_parts(rows_of_one, capsys):
    """To the last digit: each point is computed by one process, wherever that runs."""
    assert run(*VARY, "--out", "two", "--jobs", "2") == 0
    assert rows("two") == rows_of_one
    for k in (2, 1):
        assert run(*VARY, "--out", "parts", "--part", f"{k}/2") == 0
        assert len(rows("parts")) == {2: 2, 1: 4}[k]
    assert rows("parts") == rows_of_one
    capsys.readouterr()
    Path("two/sweep.csv").unlink()
    assert run(*VARY, "--out", "two", "--gather") == 0
    assert "0 of them computed now" in capsys.readouterr().out
    assert rows("two") == rows_of_one
    assert run("--vary", "surface.seed=1..3", "--vary", VARY[3], "--out", "two", "--gather") == 3
    said = capsys.readouterr()
    assert "2 of 6 points are not computed yet" in said.err
    assert "4 points, 0 of them computed now" in said.out


@contextmanager
def dask_cluster():
    """A process that talks over loopback; two that share the points are tested above."""
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 1, "threads_per_worker": 1, "host": "127.0.0.1"}
    with (
        distributed.LocalCluster(**options, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()
        assert len(client.scheduler_info()["workers"]) == 1


@pytest.mark.parametrize("begun", [partial(ThreadPoolExecutor, 1), dask_cluster])
def test_rows_are_the_same_for_any_executor(begun, scene_file, rows_of_one):
    """Workers of MPI: test_two_processes.py."""
    points = combinations(*VARY[1::2])
    with begun() as executor:
        tally = sweep(scene_file, points, Path("other"), work=Work(executor=executor))
    assert (tally.points, tally.computed, tally.failed) == (4, 4, 0)
    assert rows("other") == rows_of_one


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a.b=0.1,0.2", "0.1 0.2"),
        ("a.b=0.1", "0.1"),
        ("a.b=1 MPa , 2 MPa", "1 MPa|2 MPa"),
        ("a.b=[8, 8],[16,16]", "[8, 8]|[16,16]"),
        ("a.path='a,b.npz',\"c\"", "'a,b.npz'|\"c\""),
        ("a.b=3..5,9", "3 4 5 9"),
        ("a.path=maps/*.npz", "'maps/a.npz' 'maps/b.npz'"),
    ],
)
def test_values_of_a_field(text, values):
    Path("maps").mkdir()
    for name in ("b.npz", "a.npz", "c.txt"):
        Path("maps", name).touch()
    keys, points = combinations(text)
    assert keys == (text.partition("=")[0],)
    assert [value for (value,) in points] == values.split("|" if "|" in values else " ")


def of_table(*lines):
    """Points of a table in a file."""
    Path("points.csv").write_text("".join(f"{line}\n" for line in lines))
    return read_points(Path("points.csv"))


@pytest.mark.parametrize(
    ("read", "texts", "message"),
    [
        *((combinations, [text], "flow.rtol") for text in ("flow.rtol", "flow.rtol=")),
        *(
            (combinations, [f"a.b={text}"], r"a\.b")
            for text in ("1,,2", "[1,2", "5..3", "1..9999999")
        ),
        (combinations, ["surface.path=none/*.npz"], "none"),
        (combinations, ["a.b=1,2,1"], "gives 1 twice"),
        (combinations, ["a.b=1", "a.b=2"], r"^a\.b is varied twice"),
        (of_table, [], "no table"),
        (of_table, ["surface.seed"], "a line for each point"),
        (of_table, ["seed", "1"], "names 'seed', which is no field"),
        (of_table, ["a.b;c.d", "1;2"], "names 'a.b;c.d', .* separated by commas"),
        (of_table, ["a.b,a.b", "1,2"], "names each field once"),
        (of_table, ["a.b", "1,2"], "has 2 values for 1 field$"),
        (of_table, ["a.b", "1", "1"], r"names the point \(1\) 2 times; keep one"),
        (lambda *points: sweep(Path("scene.toml"), points, Path("out")), ["a.b", []], "no points"),
        (Work, [1.5], "^jobs = 1.5 must be a whole number of at least 1"),
    ],
)
def test_what_are_no_points(read, texts, message):
    with pytest.raises(InvalidInput, match=message):
        read(*texts)


def test_a_worker_that_is_killed_while_idle_is_replaced(monkeypatch):
    def answer_and_wait(worker, answer=Worker.answer):
        reply = answer(worker)
        time.sleep(0.3)
        return reply

    monkeypatch.setattr(Worker, "answer", answer_and_wait)
    assert farm([True, False], in_workers.answer, 1, lambda: 0) == ([True, False], [])


def test_an_interrupt_ends_the_process_of_each_point(tmp_path):
    path = tmp_path / "process"

    def interrupt():
        if path.exists() and path.read_text():
            raise KeyboardInterrupt
        return 0

    with pytest.raises(KeyboardInterrupt):
        farm([path], in_workers.stay, 1, interrupt)
    process = Path("/proc", path.read_text())
    end = time.monotonic() + 20
    while process.exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert not process.exists()


def test_a_defect_of_a_task_ends_the_computation(capfd):
    with pytest.raises(Inconsistent, match="error stands above"):
        farm(["there"], in_workers.no_answer, 1, lambda: 0)
    assert "ZeroDivisionError: there" in capfd.readouterr().err


def tasks_of(*names):
    """Points of functions of `in_workers`."""
    return [StudyTask(name, name, getattr(in_workers, name), ()) for name in names]


def test_each_point_whose_process_is_killed_has_its_own_error(tmp_path):
    """But one that has its file. What the system refuses is said in words."""
    folder = PointFolder(tmp_path, int)
    kept = StudyTask("kept", "kept", in_workers.keep_and_die, (folder.path_of("kept"),))
    tasks = [*tasks_of("fail", "exhaust", "die", "fine"), kept]
    said = []
    report = lambda stage, _: said.append(stage)  # noqa: E731
    outcome = compute_points(folder, tasks, Work(2), report=report)
    assert said[-1].startswith("2 of 5 points done")
    assert {label: str(error)[:24] for label, error in outcome.failures.items()} == {
        "fail": "an error of its own",
        "exhaust": "not enough memory for th",
        "die": "the process that compute",
    }
    assert (outcome.computed, outcome.missing) == (2, 3)
    assert folder.point("fine") == folder.point("kept") == 1


def test_a_point_that_cannot_be_read_does_not_count_as_missing(tmp_path):
    """A disk that fails for a moment must not cost the hours of its points again."""
    folder = PointFolder(tmp_path, int)
    assert folder.point("none") is None
    folder.path_of("damaged").write_text("{")
    assert folder.point("damaged") is None
    folder.path_of("held").mkdir()
    with pytest.raises(IsADirectoryError):
        folder.finished("held")


def test_a_study_says_how_many_points_have_failed(tmp_path):
    folder = PointFolder(tmp_path, int)
    said = []
    with pytest.raises(InvalidInput, match=r"^fail: an error of its own$"):
        compute_study(folder, tasks_of("fail"), Work(), lambda stage, _: said.append(stage))
    assert said[-1] == "1 of 1 points done"
    with pytest.raises(InvalidInput, match=r"^fail: .*own, and 1 other point failed$"):
        compute_study(folder, tasks_of("fail", "exhaust"), Work(), lambda *_: None)


def test_errors_of_the_scene_of_a_point_are_told_with_the_point(tmp_path):
    def refuse():
        raise InvalidScene("a.toml", ["shape is missing", "hurst = 2 is too large"])

    task = StudyTask("first", "first", refuse, ())
    with pytest.raises(InvalidInput) as raised:
        compute_study(PointFolder(tmp_path, int), [task], Work(), lambda *_: None)
    assert " ".join(raised.value.lines).startswith("first: a.toml: 2 errors: shape is missing; ")


def test_a_point_of_another_process_is_not_computed_again(tmp_path):
    """One that was missing at the start, and has a file by its turn."""
    folder = PointFolder(tmp_path, int)
    folder.save("fail", 1)
    (task,) = tasks_of("fail")
    assert compute_point(folder, task) == {}


class FullFolder(PointFolder):
    def save(self, name, point):
        raise InvalidInput("the disk is full")


@pytest.mark.parametrize("begun", [nullcontext, partial(ThreadPoolExecutor, 1)])
def test_a_folder_that_cannot_be_written_ends_the_computation(begun, tmp_path):
    """Points that have not begun are not computed any more."""
    computed, full = [], FullFolder(tmp_path, int)

    def take(number):
        computed.append(number)
        time.sleep(0.2)

    tasks = [StudyTask(f"{k}", f"{k}", take, (k,)) for k in range(20)]
    with begun() as executor, pytest.raises(InvalidInput, match="full"):
        compute_points(full, tasks, Work(executor=executor))
    assert 0 < len(computed) < (2 if executor is None else len(tasks))


MPI_REFUSED = """
from pathlib import Path
from fem_seal import parallel
from fem_seal.points import PointFolder, StudyTask, Work, compute_points

def refuse():
    raise MemoryError("8 TB")

def on_the_first():
    parallel.on_root(refuse)

parallel.abort_together()
task = StudyTask("point", "point", on_the_first, ())
compute_points(PointFolder(Path("points"), int), [task], Work())
"""


@pytest.mark.mpi
def test_processes_that_solve_together_end_together(tmp_path):
    """The others would wait for ever for a first one without memory."""
    (tmp_path / "script.py").write_text(MPI_REFUSED)
    program = ["mpirun", "-n", "2", "--oversubscribe", sys.executable, "script.py"]
    options = {"capture_output": True, "text": True, "env": alone() | MPI_ENVIRONMENT}
    done = subprocess.run(program, timeout=60, check=False, cwd=tmp_path, **options)
    assert done.returncode
    assert "MemoryError: 8 TB" in done.stderr


def test_sweeps_that_are_killed_go_on():
    """Two into one folder: no point is lost or half written, and the next one leaves nothing else.

    Their workers end, though nobody hands out points any more: who still runs holds the pipes open.
    """
    sweep = ("-m", "fem_seal", "sweep", "scene.toml", "--out", "out", "--vary")
    ways = ("surface.seed=1..99", "--jobs", "2"), ("surface.seed=50..149",)
    sweeps = [started(*sweep, *way) for way in ways]
    while not list(Path("out").glob("points/[!.]*")):
        assert [process.poll() for process in sweeps] == [None, None]
        time.sleep(0.05)
    for process in sweeps:
        process.kill()
    for process in sweeps:
        process.communicate(timeout=30)
    kept = {path: path.read_bytes() for path in Path("out").glob("points/[!.]*")}
    assert kept
    table = {}
    for folder in ("out", "undisturbed"):
        assert run("--vary", "surface.seed=1,50", "--out", folder) == 0
        table[folder] = {row["surface.seed"]: row for row in rows(folder)}
    assert table["undisturbed"].items() <= table["out"].items()
    assert all(path.read_bytes() == point for path, point in kept.items())
    left, whole = ({path.name for path in Path(name).iterdir()} for name in table)
    assert left == whole
    assert not list(Path("out").glob("points/.*"))


def test_summary_and_picture(capsys):
    """Their numbers: render/test_sweep_picture.py. The picture is drawn on request."""
    assert run("--vary", "surface.seed=1..3", *VARY[2:], "--out", "out", "--picture") == 0
    with Path("out/summary.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    counts = [(line["contact.area_fraction"], line["points"]) for line in lines]
    assert counts == [("0.1", "3"), ("0.2", "3")]
    assert Path("out/sweep.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    sealed = ("--vary", "contact.area_fraction=0.9,0.95", "--out", "sealed", "--picture")
    assert run(*sealed) == 0
    *points, tally, drawn = capsys.readouterr().out.splitlines()
    assert ["sealed" in line for line in points] == [True, True]
    assert tally.startswith("2 points")
    assert "not drawn: no point of the sweep has a leak rate above 0" in drawn


def test_errors_of_a_scene_come_back_from_a_worker():
    error = InvalidScene("a.toml", ["shape is missing", "hurst = 2 is too large"])
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.lines) == (str(error), error.lines)


def test_processes_do_not_wait_for_the_first_point(tmp_path):
    """Both of two begin at once."""
    here = tmp_path / "here"
    here.mkdir()
    assert farm([here, here], in_workers.meet, 2, lambda: 0) == ([True, True], [])


@pytest.mark.parametrize(
    ("work", "points", "seconds", "memory", "jobs"),
    [
        (Work(None), 24, 1.0, 400 * MB, 8),  # a core each
        (Work(None), 3, 3.0, 400 * MB, 3),  # no more than points
        (Work(None), 24, 0.1, 400 * MB, 1),  # workers would take longer to start
        (Work(None), 24, 1.0, 2000 * MB, 3),  # 10 GB hold three of up to 1.5 times 2 GB
        (Work(None, memory=3000 * MB), 24, 1.0, 400 * MB, 5),
        (Work(2), 24, 0.1, 2000 * MB, 2),  # the user has the last word
        (Work(4), 24, 0.1, 2000 * MB, 3),  # but for the memory
        (Work(4, memory=100 * MB), 24, 0.1, 2000 * MB, 1),
        (Work(), 24, 1.0, 400 * MB, 1),
    ],
)
def test_there_are_as_many_workers_as_pay(work, points, seconds, memory, jobs, monkeypatch):
    monkeypatch.setattr("fem_seal.points.work.available_memory", lambda: 10_000 * MB)
    monkeypatch.setattr("fem_seal.parallel.usable_cores", lambda: 8)
    assert work.jobs_for(points, Expected(seconds, memory)) == jobs
    monkeypatch.setattr("fem_seal.parallel.processes", lambda: 8)
    if work.jobs is None:
        assert work.jobs_for(points, Expected(seconds, memory)) == 1


@pytest.mark.parametrize(
    ("work", "jobs"), [(Work(None), 1), (Work(99), 99), (Work(99, memory=9000 * MB), 2)]
)
def test_workers_for_points_of_which_nothing_is_known(work, jobs):
    """The user has the last word; 4 GB of a prescribed memory for each."""
    assert work.jobs_for(24, None) == jobs


@pytest.mark.parametrize("jobs", [None, 2])
def test_a_point_is_expected_to_take_no_more_than_its_numbers(jobs, scene_file, monkeypatch):
    """Not the memory of pictures, which no point draws; also where the user sets the jobs."""
    compute = Mock(return_value=Outcome(0, 2, {}))
    monkeypatch.setattr("fem_seal.sweep.run.compute_points", compute)
    points = combinations("surface.seed=1,2", "output.products=['leak_rate','pictures']")
    sweep(scene_file, points, Path("out"), work=Work(jobs))
    scene = Scene.from_file(scene_file, ["output.products=['leak_rate']"])
    assert compute.call_args.kwargs["each"].memory == predicted(scene).memory < PICTURE_IMPORTS[1]


def test_workers_have_the_memory_of_the_largest_point(scene_file, monkeypatch):
    """Wherever in the table it stands."""
    compute = Mock(return_value=Outcome(0, 3, {}))
    monkeypatch.setattr("fem_seal.sweep.run.compute_points", compute)
    points = combinations("surface.shape=[32,32],[2048,2048],[64,64]")
    sweep(scene_file, points, Path("out"), work=Work(2))
    large = numbers_only(Scene.from_file(scene_file, ["surface.shape=[2048,2048]"]))
    assert compute.call_args.kwargs["each"].memory == predicted(large).memory


def test_no_more_than_the_jobs_run_at_once(tmp_path, monkeypatch):
    """Their memory is reported: 300 MB and the libraries for each of two."""
    monkeypatch.setattr("fem_seal.worker._peak", 0)
    times = tmp_path / "times"
    times.mkdir()
    farm([times] * 3, in_workers.hold_memory, 2, lambda: 0)
    spans = [tuple(map(float, path.read_text().split()[:2])) for path in times.iterdir()]
    assert len(spans) == 3
    assert max(sum(a <= start < b for a, b in spans) for start, _ in spans) <= 2
    assert 600 * MB <= peak_of_workers() <= 1000 * MB
