"""The patches of a seal as independent points: a file for each patch, computed by many processes.

A point is a patch under many loads. Its file keeps the conductivity table of the patch, from
which the flow through the seal follows quickly.
"""

from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from fem_seal import parallel
from fem_seal.errors import present
from fem_seal.grid_series import (
    between_pixels,
    change_of,
    error_of_map,
    grid_error,
    on_half,
    unresolved,
)
from fem_seal.leak_rate import Estimate, Factors, middle_of
from fem_seal.parallel import Comm
from fem_seal.patch import Patch
from fem_seal.points import Expected, PointFolder, Task, Work, compute_points
from fem_seal.points.compute import under
from fem_seal.progress import Report
from fem_seal.scene import Scene
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.patch_conductivity import LoadedPatch
from fem_seal.upscaling.path_flow import SealFlow
from fem_seal.upscaling.refined_table import FIRST_MULTIPLE, refined_flow
from fem_seal.upscaling.scene_profile import leak_path_of

OF_FLOWS = 0.5  # tolerance of the flows over seal.rtol; the distance of the loads takes the rest


@dataclass(frozen=True)
class SolvedPatch:
    """Conductivity of a patch at the net loads that the seal needs."""

    table: ConductivityTable
    #: why the bounds of a seal with this patch everywhere are wider than seal.rtol allows; empty if
    #: they are not
    reason: str
    #: on the conductivity at the load that matters most, for what a finer grid of the contact would
    #: change; None if there is no estimate
    of_grid: Factors | None
    critical_gap: float | None  #: gap of the critical constriction at that load [m]; None if sealed


@dataclass(frozen=True)
class PatchTask(Task[SolvedPatch]):
    """A patch to be solved under many loads."""

    scene: Scene  #: scene of the realization, with its [seal]
    load_share: float = 1.0  #: part of its load

    def compute(self, report: Report, comm: Comm) -> SolvedPatch:
        """Conductivity of the patch, refined in load."""
        seal, states = present(self.scene.seal, "[seal]"), [""]
        patch = Patch(self.scene, lambda *stage: under(states[-1], report)(*stage), comm=comm)
        loaded = LoadedPatch(patch, OF_FLOWS * seal.rtol)

        def begin(state: str) -> None:
            """Report a state of the conductivity table, and the stages that follow under it."""
            report(state, "")
            states.append(state)

        flow = refined_flow(
            loaded,
            *leak_path_of(self.scene, self.load_share),
            tolerance=seal.rtol,
            most_loads=seal.max_loads,
            max_seconds=seal.max_seconds,
            progress=begin,
        )
        begin("error of the contact's grid")
        load = load_that_matters(flow, loaded)
        return SolvedPatch(
            present(flow.table, "table of the patch"),
            flow.reason,
            None if load is None else _of_grid(loaded, load),
            None if load is None else loaded.critical_gap(load),
        )


def load_that_matters(flow: SealFlow, loaded: LoadedPatch) -> float | None:
    """Leaking load [Pa] of the table nearest to that which matters most; None if sealed.

    That is the net load of the place that halves the influence on the leak rate. The upper bounds
    do not tell what leaks: a sealed load below one that leaks has that one's bound.
    """
    if flow.state != "leaking":
        return None
    along, table = present(flow.path, "path"), present(flow.table, "table")
    net = along.total_pressure - along.fluid_pressure
    matters = float(net[np.searchsorted(np.cumsum(along.influence), 0.5)])
    by_distance = sorted(table.loads.tolist(), key=lambda load: abs(load - matters))
    return next(load for load in by_distance if loaded.critical_gap(load) is not None)


def _of_grid(loaded: LoadedPatch, load: float) -> Factors | None:
    """Factors for the contact's grid at a load, from half of the samples; None if too few."""
    thinned = on_half(loaded.patch, even=loaded.quartered)
    if thinned is None:
        return None
    # The grids may differ by less than the flows of the table may be off. A flow that is off by
    # less than LOOSER_MULTIPLE times as much moves the estimate by at most 4 % of itself.
    asked = {load: FIRST_MULTIPLE * min(1.0, loaded.patch.scene.flow.rtol / loaded.rtol)}
    fine = _middle(*loaded.bounds(load, loaded.missing(asked).get(load, inf)))
    coarse = _middle(*LoadedPatch(thinned, thinned.flow_settings.rtol).bounds(load))
    change = change_of(coarse, fine)
    pixels = between_pixels(loaded.film(load), loaded.settings(), fine, loaded.patch.comm)
    if loaded.patch.scene.measured_map is not None:
        error = error_of_map(change, pixels)
    else:
        left_out = unresolved(present(loaded.patch.surface, "surface"))
        unresolved_share = left_out / present(loaded.critical_gap(load), "critical gap")
        error = grid_error(change, unresolved_share, pixels=pixels)
    return error.factors


def _middle(lower: float, upper: float) -> Estimate:
    """The middle of two bounds; without a lower bound, a range from 0 up to it."""
    return Estimate(middle_of(lower, upper), None if lower > 0 else 0.0)


def solved_patches(
    scenes: tuple[Scene, ...],
    like: Patch,
    folder: Path | None,
    work: Work,
    load_share: float = 1.0,
    each: Expected | None = None,
) -> tuple[SolvedPatch, ...]:
    """Solve the patches that a folder does not hold yet; without one, this process solves them all.

    They have the report and the processes of the patch `like`, and a part of their load.
    """
    number = len(scenes)
    tasks = [
        PatchTask(scene.fingerprint(load_share), f"patch {k + 1} of {number}", scene, load_share)
        for k, scene in enumerate(scenes)
    ]
    if folder is None:
        return tuple(task.compute(under(task.label, like.report), like.comm) for task in tasks)
    points = PointFolder(folder, SolvedPatch)
    outcome = compute_points(
        points, tasks, work, report=like.report, name="patches", each=each, comm=like.comm
    )
    for error in outcome.failures.values():
        raise error
    return parallel.on_root(
        lambda: tuple(present(points.point(task.name), task.label) for task in tasks), like.comm
    )
