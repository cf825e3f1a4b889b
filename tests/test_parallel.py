"""Processes of a run share the cores of a machine: a stub of MPI tells which they may use."""

import os
import platform
from types import SimpleNamespace

import pytest

from fem_seal import parallel

OURS = set(range(4))


@pytest.mark.parametrize(
    ("others", "alone_on", "lent"),
    [
        ([("here", {4, 5, 6, 7})], 4, 8),  # bound to the other socket
        ([("elsewhere", OURS)], 4, 4),
        ([("here", OURS)], 2, 4),
        ([("here", OURS), ("elsewhere", OURS), ("here", {3, 4})], 1, 5),
    ],
)
def test_cores_are_shared_with_those_who_may_use_them(others, alone_on, lent, monkeypatch):
    """4 cores over the processes of this machine that share some; all while the others wait."""
    masks = [("here", OURS), *others]
    world = SimpleNamespace(
        size=len(masks),
        rank=0,
        allgather=lambda _: masks,
        Ibarrier=lambda: SimpleNamespace(Test=lambda: True),
        bcast=lambda answer, root: answer,
    )
    bound = [OURS]
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setattr(parallel, "_started", lambda: world)
    monkeypatch.setattr(parallel, "_together", lambda comm: world)
    monkeypatch.setattr(parallel, "_sharing", None)
    monkeypatch.setattr(platform, "node", lambda: "here")
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: bound[-1], raising=False)
    monkeypatch.setattr(os, "sched_setaffinity", lambda _, mask: bound.append(mask), raising=False)
    # Before they have told each other, all processes may share all cores.
    assert parallel.cores() == max(1, 4 // len(masks))
    assert parallel.on_root(parallel.cores) == lent
    assert parallel.cores() == alone_on
