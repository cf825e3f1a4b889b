"""Available memory: the machine's, and limits of control groups as batch systems set them."""

import os
from pathlib import Path

import pytest

from fem_seal.errors import InvalidInput
from fem_seal.memory import available_memory
from fem_seal.patch import Patch
from fem_seal.scene import Scene

MACHINE = 8_000_000 * 1024


def machine(root: Path, groups: str | None, files: dict[str, str]) -> Path:
    """Write a /proc and /sys with 8 GB available and some files below /sys/fs/cgroup."""
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/meminfo").write_text("MemTotal: 9000000 kB\nMemAvailable: 8000000 kB\n")
    if groups is not None:
        (root / "proc/self/cgroup").write_text(groups)
    for name, text in files.items():
        path = root / "sys/fs/cgroup" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
    return root


VERSION_2 = "0::/slurm/job_1/step_0\n"
VERSION_1 = "12:cpuset:/\n5:cpu,memory:/slurm/job_1\n1:name=systemd:/\n"
V1 = "memory/slurm/job_1/memory."


@pytest.mark.parametrize(
    ("groups", "files", "expected"),
    [
        (None, {}, MACHINE),
        ("", {}, MACHINE),
        (VERSION_2, {}, MACHINE),
        (VERSION_2, {"slurm/job_1/step_0/memory.max": "max"}, MACHINE),
        # Its own limit, less its usage, of which unused file pages do not count.
        (
            VERSION_2,
            {
                "slurm/job_1/step_0/memory.max": "5000",
                "slurm/job_1/step_0/memory.current": "3000",
                "slurm/job_1/step_0/memory.stat": "anon 2000\ninactive_file 700",
            },
            2700,
        ),
        # That of a group above it.
        (
            VERSION_2,
            {
                "slurm/job_1/step_0/memory.max": "max",
                "slurm/job_1/step_0/memory.current": "3000",
                "slurm/memory.max": "5000",
                "slurm/memory.current": "4000",
            },
            1000,
        ),
        # Over its limit, while pages are written out.
        ("0::/\n", {"memory.max": "5000", "memory.current": "6000"}, 0),
        # A container that sees its own group as the mount.
        (VERSION_2, {"memory.max": "5000", "memory.current": "1000"}, 4000),
        (
            VERSION_1,
            {
                V1 + "limit_in_bytes": "6000",
                V1 + "usage_in_bytes": "2000",
                V1 + "stat": "inactive_file 1\ntotal_inactive_file 500",
            },
            4500,
        ),
        # Version 1 writes no limit as a number above all memory.
        (
            VERSION_1,
            {V1 + "limit_in_bytes": "9223372036854771712", V1 + "usage_in_bytes": "2000"},
            MACHINE,
        ),
    ],
)
def test_limits_of_control_groups(tmp_path, groups, files, expected):
    assert available_memory(machine(tmp_path, groups, files)) == expected


@pytest.mark.parametrize("most", [1.0, 1e9])
def test_a_contact_that_exceeds_the_limit_is_not_begun(small_scene, most):
    """Its arrays take 106 bytes a sample at least: more than a byte, less than a gigabyte."""
    small_scene["flow"] = {"pressure_drop": "1 bar", "max_memory": f"{most:g} B"}
    patch = Patch(Scene.from_mapping(small_scene))
    if most > 1:
        assert patch.contact is not None
        return
    with pytest.raises(InvalidInput, match=r"contact of .* GB of memory, .* flow\.max_memory"):
        _ = patch.contact


def test_without_proc_the_memory_of_the_machine(tmp_path):
    total = available_memory(tmp_path)
    assert available_memory() < total
    assert total == os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
