"""Available memory: the machine's, and limits of control groups as batch systems set them."""

import os

import numpy as np
import pytest

from fem_seal import scene_steps
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.memory import available_memory
from fem_seal.patch import Patch
from fem_seal.prediction import predicted
from fem_seal.scene import Scene

MACHINE = 8_000_000 * 1024


# Names of limit, usage and statistics of a group in version 2 of control groups, and in version 1.
NAMES = {
    2: ("memory.max", "memory.current", "memory.stat"),
    1: ("memory.limit_in_bytes", "memory.usage_in_bytes", "memory.stat"),
}
LINES = {2: "0::/slurm/job/step\n", 1: "12:cpuset:/\n5:cpu,memory:/slurm/job\n1:name=systemd:/\n"}
# Of version 1 the entry without "total_" leaves out the groups below.
CACHE = {2: "anon 2000\ninactive_file 700", 1: "inactive_file 1\ntotal_inactive_file 700"}


@pytest.mark.parametrize(
    ("version", "groups", "expected"),
    [
        (None, {}, MACHINE),
        (2, {}, MACHINE),
        (2, {"slurm/job/step": ("max",)}, MACHINE),
        # Its own limit, less its usage, of which unused file pages do not count.
        (2, {"slurm/job/step": (5000, 3000, CACHE[2])}, 2700),
        (1, {"memory/slurm/job": (6000, 2000, CACHE[1])}, 4700),
        # That of a group above it.
        (2, {"slurm/job/step": ("max", 3000), "slurm": (5000, 4000)}, 1000),
        # Over its limit, while pages are written out; a container sees its own group as the mount.
        (2, {"": (5000, 6000)}, 0),
        (2, {"": (5000, 1000)}, 4000),
        # Version 1 writes no limit as a number above all memory.
        (1, {"memory/slurm/job": (2**63 - 4096, 2000)}, MACHINE),
    ],
)
def test_limits_of_control_groups(tmp_path, version, groups, expected):
    """Of a machine with 8 GB available: limit, usage and statistics of groups by their folders."""
    (tmp_path / "proc/self").mkdir(parents=True)
    (tmp_path / "proc/meminfo").write_text("MemTotal: 9000000 kB\nMemAvailable: 8000000 kB\n")
    if version is not None:
        (tmp_path / "proc/self/cgroup").write_text(LINES[version])
    for name, values in groups.items():
        folder = tmp_path / "sys/fs/cgroup" / name
        folder.mkdir(parents=True, exist_ok=True)
        for file, value in zip(NAMES[version], values, strict=False):
            (folder / file).write_text(f"{value}\n")
    assert available_memory(tmp_path) == expected


@pytest.mark.parametrize("most", [1.0, 1e9])
def test_a_contact_that_exceeds_the_limit_is_not_begun(small_scene, most):
    """Its arrays take 72 bytes a sample at least: more than a byte, less than a gigabyte."""
    small_scene["flow"] = {"pressure_drop": "1 bar", "max_memory": f"{most:g} B"}
    patch = Patch(Scene.from_mapping(small_scene))
    if most > 1:
        assert patch.contact is not None
        return
    with pytest.raises(InvalidInput, match=r"contact of .* GB of memory, .* flow\.max_memory"):
        _ = patch.contact


def test_what_a_dry_run_predicts_is_not_refused(small_scene, monkeypatch):
    """Of a contact so large that the libraries are little beside it; it is not solved here."""
    monkeypatch.setattr(scene_steps, "press", lambda *_: "pressed")
    monkeypatch.setattr("fem_seal.memory.available_memory", lambda: np.inf)
    shape, output = (4096, 4096), {"products": ["contact"]}
    data = small_scene | {"surface": small_scene["surface"] | {"shape": shape}, "output": output}
    most = predicted(Scene.from_mapping(data | {"flow": {"lift": "none"}})).memory
    scene = Scene.from_mapping(data | {"flow": {"lift": "none", "max_memory": f"{most} B"}})
    heights = GridField(np.broadcast_to(0.0, shape), (1e-6, 1e-6), periodic=True)
    assert scene_steps.elastic_contact(scene, heights, None, scene.load) == "pressed"


def test_without_proc_the_memory_of_the_machine(tmp_path):
    total = available_memory(tmp_path)
    assert available_memory() < total
    assert total == os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
