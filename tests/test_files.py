"""Writing that leaves a whole file or none, locks of folders, and what killed processes leave."""

import errno
import os
import resource
import signal
import subprocess
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest
from project import RING, started, write_toml

from fem_seal.errors import InvalidInput
from fem_seal.files import (
    atomic_write,
    clear_abandoned,
    create_text,
    digest_of_sources,
    locked_folder,
    staging_folder,
    temporary_folder,
    write_text,
)
from fem_seal.files.lock import LOCK_FILE
from fem_seal.files.owner import Owner, staging_name, this_process
from fem_seal.interrupts import interruptible
from fem_seal.mesh import geometry
from fem_seal.scene import Scene
from fem_seal.solved import solve

HOLD = (
    "import sys, time; from pathlib import Path; from fem_seal import files\n"
    "out, shared = Path(sys.argv[1]), sys.argv[2] == 'shared'\n"
    "with files.locked_folder(out, shared=shared), files.staging_folder(out) as staged:\n"
    "    (staged / 'part').touch(); print('held', flush=True); time.sleep(60)"
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


def test_points_of_other_sources_are_others(tmp_path):
    """A commit changes numbers, and not always the version."""
    source = tmp_path / "package" / "module.py"
    source.parent.mkdir()
    digests = set()
    for text in ("x = 1", "x = 2"):
        source.write_text(text)
        digests.add(digest_of_sources.__wrapped__(tmp_path))
    assert len(digests) == 2


def test_one_of_many_creates_a_file(tmp_path):
    code = (
        "import sys; from pathlib import Path; from fem_seal.files import create_text\n"
        "create_text(Path(sys.argv[1]), sys.argv[2] * 100_000)"
    )
    writers = [started("-c", code, tmp_path / "origin", letter) for letter in "abcd"]
    for writer in writers:
        writer.communicate(timeout=60)
    assert [writer.returncode for writer in writers] == 4 * [0]
    text = (tmp_path / "origin").read_text()
    assert text == 100_000 * text[0]
    create_text(tmp_path / "origin", "late")
    assert (tmp_path / "origin").read_text() == text
    assert len(list(tmp_path.iterdir())) == 1


# Owners.


def test_an_owner_is_gone_when_its_process_is(tmp_path):
    process = started("-c", "import sys; sys.stdin.read()", stdin=subprocess.PIPE)
    start = int(Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[19])
    owner = Owner(this_process().place, process.pid, start)
    assert not owner.gone()
    # The number of an ended process may be another's by now: the start tells them apart.
    assert Owner(owner.place, process.pid, start - 1).gone()
    process.kill()
    # Dead, though nobody has asked for its status yet.
    deadline = time.monotonic() + 10
    while not owner.gone() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert owner.gone()
    process.communicate()
    assert owner.gone()
    assert not Owner("elsewhere+1", process.pid, start).gone()
    assert not this_process().gone()


def test_only_what_the_dead_of_this_host_left_is_cleared(tmp_path):
    process = started("-c", "pass")
    process.communicate()
    place = this_process().place
    dead = (f".fem-seal-{place}-{process.pid}-1-0a.png", f".fem-seal-{place}-{process.pid}-1-0b")
    kept = (f".fem-seal-elsewhere+1-{process.pid}-1-0c", staging_name(), ".fem-seal-notes", "a.png")
    for name in (*dead, *kept):
        (tmp_path / name).mkdir() if name.endswith("b") else (tmp_path / name).touch()
    (tmp_path / dead[1] / "inside").touch()
    clear_abandoned(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(kept)


# Locks.


@pytest.mark.parametrize("first", ["alone", "shared"])
@pytest.mark.parametrize("second", ["alone", "shared"])
@pytest.mark.parametrize("kernel", [True, False])
def test_who_may_hold_a_folder(holder, tmp_path, monkeypatch, first, second, kernel):
    """With the kernel's locks, and on a file system that has none.

    The next one who holds it leaves nothing of what a killed one was writing.
    """
    both = first == second == "shared"
    if not kernel:

        def no_locks(handle, operation):
            raise OSError(errno.ENOLCK, "No locks available")

        monkeypatch.setattr("fcntl.flock", no_locks)
        both |= (first, second) == ("alone", "shared")  # which only flock can tell
    process = holder(first)
    if both:
        with locked_folder(tmp_path / "out", shared=second == "shared"):
            pass
    else:
        named = rf"in use by process {process.pid} on \S+ since \d{{4}}-"
        with (
            pytest.raises(InvalidInput, match=named),
            locked_folder(tmp_path / "out", shared=second == "shared"),
        ):
            pass
    process.kill()
    process.communicate()
    assert len(list((tmp_path / "out").iterdir())) == 2
    with locked_folder(tmp_path / "out"):
        assert [path.name for path in (tmp_path / "out").iterdir()] == [LOCK_FILE]
    assert not list((tmp_path / "out").iterdir())


def test_many_that_come_and_go_never_hold_a_folder_together(tmp_path):
    """Each counts up a number that would lose counts if two held the folder at once."""
    code = (
        "import sys, time; from pathlib import Path\n"
        "from fem_seal.errors import InvalidInput; from fem_seal.files import locked_folder\n"
        "count, done = Path(sys.argv[1]).parent / 'count', 0\n"
        "while done < 30:\n"
        "    try:\n"
        "        with locked_folder(Path(sys.argv[1])):\n"
        "            n = int(count.read_text()); time.sleep(0.001); count.write_text(str(n + 1))\n"
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
