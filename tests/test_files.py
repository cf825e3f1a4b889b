"""Writing that leaves a whole file or none, locks of folders, and what killed processes leave."""

import errno
import fcntl
import os
import resource
import signal
import time
from contextlib import ExitStack, contextmanager, nullcontext
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from threading import Timer

import pytest
from project import RING, started, write_toml

from fem_seal.errors import InvalidInput
from fem_seal.files import (
    atomic_write,
    create_text,
    digest_of_sources,
    locked_folder,
    staging_folder,
    temporary_folder,
    write_text,
)
from fem_seal.files.lock import LOCK_FILE
from fem_seal.interrupts import interruptible
from fem_seal.mesh import geometry
from fem_seal.scene import Scene
from fem_seal.solved import solve

HOLD = (
    "import sys, time; from pathlib import Path; from fem_seal import files\n"
    "out, shared = Path(sys.argv[1]), sys.argv[2] == 'shared'\n"
    "with files.locked_folder(out, shared=shared):\n"
    "    (out / 'points').mkdir()\n"
    "    with files.staging_folder(out), files.atomic_write(out / 'points' / 'a.json') as staged:\n"
    "        staged.touch(); print('held', flush=True); time.sleep(60)"
)


@pytest.fixture
def holder(tmp_path):
    """Start a process that holds a folder and writes into it; it is killed at the end."""
    holders = []

    def hold(mode):
        holders.append(started("-c", HOLD, tmp_path / "out", mode))
        assert holders[-1].stdout.readline() == "held\n"
        return holders[-1]

    yield hold
    for process in holders:
        process.kill()
        process.communicate()


# Files.


def test_a_write_that_fails_leaves_the_old_file(tmp_path):
    path = tmp_path / "table.csv"
    write_text(path, "old")
    with pytest.raises(RuntimeError), atomic_write(path) as staged:  # noqa: PT012
        staged.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("links", [True, False])
def test_one_of_many_creates_a_file(tmp_path, monkeypatch, links):
    def no_links(*paths):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    if not links:
        monkeypatch.setattr("os.link", no_links)
    for text in ("first", "late"):
        create_text(tmp_path / "origin", text)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["first"]


def test_points_of_other_sources_are_others(tmp_path):
    """A commit changes numbers, and not always the version."""
    source = tmp_path / "package" / "module.py"
    source.parent.mkdir()
    digests = set()
    for text in ("x = 1", "x = 2"):
        source.write_text(text)
        digests.add(digest_of_sources.__wrapped__(tmp_path))
    assert len(digests) == 2


# Locks.


@pytest.mark.parametrize("first", ["alone", "shared"])
@pytest.mark.parametrize("second", ["alone", "shared"])
def test_who_may_hold_a_folder(holder, tmp_path, first, second):
    """The next one who holds it alone leaves nothing of what a killed one was writing."""
    out = tmp_path / "out"
    process = holder(first)
    written = [path for path in out.rglob("*") if path.name != LOCK_FILE]
    assert len(written) == 3
    if first == second == "shared":
        with locked_folder(out, shared=True):
            pass
    else:
        with (
            pytest.raises(InvalidInput, match=rf"{out} is in use by another process; wait"),
            locked_folder(out, shared=second == "shared"),
        ):
            pass
    assert all(path.exists() for path in written)
    process.kill()
    process.communicate()
    # A picture, or a run further in, is written without this lock: the writer may be alive.
    (out / ".fem-seal-old.png").touch()
    os.utime(out / ".fem-seal-old.png", (0, 0))
    new, run = out / ".fem-seal-new.png", out / "run" / ".fem-seal-0"
    new.touch()
    run.mkdir(parents=True)
    with locked_folder(out, shared=second == "shared"):
        assert sorted(out.rglob("*")) == [new, out / LOCK_FILE, out / "points", run.parent, run]
    assert sorted(out.rglob("*")) == [new, out / "points", run.parent, run]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every folder")
def test_a_folder_within_that_cannot_be_read_stays(tmp_path):
    (tmp_path / "points").mkdir(mode=0)
    with locked_folder(tmp_path):
        pass


def test_what_another_process_writes_further_in_stays(tmp_path):
    """The folder of a run may lie in that of another."""
    out = tmp_path / "points"
    with locked_folder(out), atomic_write(out / "a.json") as staged:
        staged.touch()
        with locked_folder(tmp_path):
            assert staged.exists()


def test_a_file_system_without_locks(tmp_path, monkeypatch):
    """Nobody is kept out; what others write there stays, since they may be alive."""

    def no_locks(handle, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", no_locks)
    out = tmp_path / "out"
    with locked_folder(out), staging_folder(out) as staged, locked_folder(out):
        assert staged.exists()
    assert not out.exists()


@pytest.mark.parametrize("step", [fcntl.LOCK_EX, fcntl.LOCK_SH])
@pytest.mark.parametrize("stays", [True, False])
def test_another_comes_in_the_instant_of_locking(tmp_path, monkeypatch, step, stays):
    """After the file is opened, or within the conversion to a shared lock; it may leave as well."""
    real, other = fcntl.flock, ExitStack()

    def delayed(handle, kind):
        if kind == step | fcntl.LOCK_NB:
            monkeypatch.setattr("fcntl.flock", real)
            real(handle, fcntl.LOCK_UN)
            other.enter_context(locked_folder(tmp_path))
            if not stays:
                other.close()
        real(handle, kind)

    monkeypatch.setattr("fcntl.flock", delayed)
    in_use = partial(pytest.raises, InvalidInput, match="in use")
    shared, alone = locked_folder(tmp_path, shared=True), locked_folder(tmp_path)
    with other, in_use() if stays else nullcontext(), shared, in_use(), alone:
        pass


def test_a_sweep_waits_for_one_that_begins(tmp_path):
    """That one holds the folder alone for as long as it takes to list many points."""
    other = ExitStack()
    other.enter_context(locked_folder(tmp_path))
    Timer(0.5, other.close).start()
    with locked_folder(tmp_path, shared=True):
        pass


def test_many_that_come_and_go_hold_a_folder_as_they_may(tmp_path):
    """Each counts up, alone, a number that would lose counts if two held the folder at once.

    Nobody counts while others share the folder, nor removes what they write.
    """
    code = (
        "import sys, time; from pathlib import Path\n"
        "from fem_seal.errors import InvalidInput\n"
        "from fem_seal.files import locked_folder, staging_folder\n"
        "out, done = Path(sys.argv[1]), 0\n"
        "count = out.parent / 'count'\n"
        "while done < 60:\n"
        "    try:\n"
        "        with locked_folder(out, shared=done % 2 == 1), staging_folder(out) as staged:\n"
        "            n = int(count.read_text()); time.sleep(0.001)\n"
        "            if done % 2: assert staged.exists() and int(count.read_text()) == n\n"
        "            else: count.write_text(str(n + 1))\n"
        "            done += 1\n"
        "    except InvalidInput: pass\n"
    )
    (tmp_path / "count").write_text("0")
    counters = [started("-c", code, tmp_path / "out") for _ in range(3)]
    errors = [counter.communicate(timeout=60)[1] for counter in counters]
    assert [counter.returncode for counter in counters] == [0, 0, 0], errors
    assert (tmp_path / "count").read_text() == "90"
    # The folder itself may stay: who made it had to leave it to the one who held it next.
    assert not list(tmp_path.glob("out/*"))


# Full disks.


@contextmanager
def full(size):
    """Let no file become longer than this, as on a full disk, nor one of a child."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("size", [100, 5000])
def test_a_full_disk_is_one_line_that_names_the_folder(scene_file, refused, size):
    """At the first array, and in the middle of it."""
    out = scene_file.parent / "out"
    with full(size):
        error = refused("run", scene_file, "--out", out)
    assert error.startswith("fem-seal: the output folder")
    assert f"{out} cannot be written: File too large" in error


@pytest.mark.skipif(not find_spec("gmsh"), reason="needs gmsh")
def test_a_mesh_that_the_disk_cuts_off_is_not_the_geometry_s_fault(tmp_path, refused, monkeypatch):
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "tmp"))
    scene = write_toml(tmp_path / "scene.toml", RING)
    # Less than the mesh takes, more than the job that is handed to gmsh.
    with full(20_000):
        error = refused("mesh", scene)
    assert f"whole mesh of face-seal.geo to {tmp_path}/tmp" in error.replace(
        str(Path(geometry.__file__).parent / "sources") + "/", ""
    )


@pytest.mark.skipif(not find_spec("gmsh"), reason="needs gmsh")
def test_a_mesh_does_not_replace_that_of_another_scene(tmp_path, refused):
    """Its pictures would lie beside the result of that scene, as if they were its own."""
    out = tmp_path / "out"
    solve(Scene.from_mapping(RING | {"output": {"products": ["contact"]}})).save(out)
    wider = RING | {"shape": RING["shape"] | {"gap": "4 um"}}
    error = refused("mesh", write_toml(tmp_path / "wider.toml", wider), "--out", out)
    assert f"{out} holds the result of another scene" in error


def test_a_full_temporary_folder_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    named = r"temporary folder .*TMPDIR.* No space left"
    with pytest.raises(InvalidInput, match=named), temporary_folder() as folder:  # noqa: PT012
        assert folder.parent == tmp_path
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert not list(tmp_path.iterdir())
    with (
        pytest.raises(InvalidInput, match="cannot be written: No such file"),
        staging_folder(tmp_path / "nowhere"),
    ):
        pass


# Interrupts.


def test_an_interrupt_waits_until_a_module_is_imported(tmp_path, monkeypatch):
    (tmp_path / "slow_module.py").write_text(
        "import signal\nsignal.raise_signal(signal.SIGINT)\nwhole = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt), interruptible():  # noqa: PT012
        import slow_module  # not caught here

        time.sleep(10)
    assert slow_module.whole
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_stays_one_whatever_compiled_code_makes_of_it():
    with pytest.raises(KeyboardInterrupt), interruptible():  # noqa: PT012
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise ImportError("initialisation failed") from None
    with pytest.raises(ZeroDivisionError), interruptible():
        raise ZeroDivisionError


def test_an_interrupt_that_a_callback_swallows_comes_again():
    class Swallowing:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt), interruptible():  # noqa: PT012
        Swallowing()
        time.sleep(10)
