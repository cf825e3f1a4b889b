"""The leak rate of a scene's whole seal, from its patches."""

from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

import numpy as np

from fem_seal.digits import per_cent, rounded_up
from fem_seal.errors import present
from fem_seal.leak_rate import FlowState, half_width_of, relative_half_width, relative_width
from fem_seal.patch import Patch
from fem_seal.points import Work
from fem_seal.upscaling.leak_path import EndPressures, LeakPath
from fem_seal.upscaling.network import (
    PatchCount,
    drawn_seals,
    generalised_interval,
    sealed_share,
)
from fem_seal.upscaling.patch_conductivity import PatchFlow
from fem_seal.upscaling.realizations import realizations
from fem_seal.upscaling.scene_profile import profile_of
from fem_seal.upscaling.seal_flow import SealingPart, lifted_off, seal_flow
from fem_seal.upscaling.solved_patches import OF_FLOWS, solved_patches


@dataclass(frozen=True)
class Share:
    """A share, and its confidence interval by Clopper and Pearson."""

    value: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class SealLeak:
    """Leak rate of a seal, and the patches from which it is computed."""

    state: FlowState
    #: leak rate [m³/s], of a gas at reference conditions; 0 if sealed, infinite if lifted off. The
    #: bounds are those of flow and load table, for the patches at hand
    value: float
    lower: float
    upper: float
    #: each realization, with the leak rate of a seal that consists of such patches
    patches: tuple[PatchFlow, ...]
    count: PatchCount  #: patches along the part of the path that seals, and around the seal
    scatter: float  #: standard deviation of the leak rate of such seals over its mean
    #: confidence interval [m³/s] of the leak rate due to the scatter of the patches; None if too
    #: few realizations leak to estimate it
    interval: tuple[float, float] | None
    share_sealed: Share  #: of the realizations
    converged: bool
    reason: str  #: sentence on why it has not converged; empty if it has
    leak_path: float  #: length from inlet to outlet [m]
    #: part of the path that seals, with the median patch; None if lifted off
    sealing: SealingPart | None = None
    #: largest estimated relative error of a patch's conductivity due to the grid of its contact;
    #: None if there is no estimate for one of the leaking patches
    contact_error: float | None = None
    #: smallest critical constriction [m] of a leaking patch at the load that matters most
    critical_gap: float | None = None


def solve_seal(patch: Patch, folder: Path | None = None, work: Work | None = None) -> SealLeak:
    """Leak rate of the seal of a scene with [seal], whose first patch is given.

    With a folder, which has a file for each patch, an interrupted run goes on. Without `work` the
    patches are solved one after the other.
    """
    scene, seal = patch.scene, present(patch.scene.seal, "[seal]")
    profile, path = profile_of(scene)
    ends = EndPressures.of(scene.drive, scene.gauge_pressures)
    size = present(patch.surface, "surface").size
    if profile.highest <= ends.inlet:
        lifted = PatchFlow(None, lifted_off(profile, ends))
        return _together((lifted,) * seal.patches, path, size, seal.rtol)
    solved = solved_patches(realizations(scene), patch, folder, work or Work())
    flows = []
    for one in solved:
        table = one.stored.table
        flow = seal_flow(table, profile, path, ends)
        flows.append(PatchFlow(table, flow, one.converged, one.reason))
    errors = [one.contact_error for one in solved if max(one.stored.upper) > 0]
    known = [error for error in errors if error is not None]
    largest = max(known) if known and len(known) == len(errors) else None
    gaps = [one.critical_gap for one in solved if one.critical_gap]
    together = _together(tuple(flows), path, size, seal.rtol)
    return replace(together, contact_error=largest, critical_gap=min(gaps, default=None))


def median_patch(flows: tuple[PatchFlow, ...]) -> PatchFlow:
    """The patch of the median leak rate; of an even number the one that leaks more."""
    return sorted(flows, key=lambda one: one.flow.value)[len(flows) // 2]


def _together(
    flows: tuple[PatchFlow, ...], path: LeakPath, size: tuple[float, float], rtol: float
) -> SealLeak:
    """Put the patches of a size [m] into the network of the seal."""
    rates = np.array([(one.flow.lower, one.flow.value, one.flow.upper) for one in flows])
    lengths = [
        one.flow.path.sealing_length
        for one in flows
        if one.flow.path and one.flow.state == "leaking"
    ]
    length = float(np.median(lengths)) if lengths else path.length
    count = PatchCount.of(length, path.circumference, size)
    sealed = sum(one.flow.state == "sealed" for one in flows)
    share = Share(sealed / len(flows), *sealed_share(sealed, len(flows)))
    sealing = median_patch(flows).flow.sealing
    if any(one.flow.state == "lifted off" for one in flows):
        return SealLeak(
            "lifted off", inf, inf, inf, flows, count, 0.0, None, share, True, "", path.length,
            sealing,
        )  # fmt: skip
    drawn = drawn_seals(rates, count)
    lower, value, upper = map(float, drawn.mean)
    interval = generalised_interval(rates[:, 1], count.along)
    state: FlowState = "sealed" if upper == 0 else "leaking"
    reason = _missed(flows, lower, upper, rtol)
    return SealLeak(
        state, value, lower, upper, flows, count, drawn.scatter, interval, share, not reason,
        reason, path.length, sealing,
    )  # fmt: skip


def _missed(flows: tuple[PatchFlow, ...], lower: float, upper: float, rtol: float) -> str:
    """Sentence on the tolerance that the bounds of the seal [m³/s] miss, else empty.

    The bounds of a patch that leaks little may be wide if those of the seal are narrow enough.
    """
    ended = [number for number, one in enumerate(flows) if not one.converged]
    if not ended or upper == 0 or relative_width(lower, upper) <= rtol:
        return ""
    widths = [relative_half_width(flows[k].flow.lower, flows[k].flow.upper) for k in ended]
    number = ended[int(np.argmax(widths))]
    reached, asked, worst = map(
        per_cent, (relative_half_width(lower, upper), half_width_of(rtol), max(widths))
    )
    content = ""
    if lower > 0:
        # The flows take the part OF_FLOWS of any tolerance, the loads no more than they do now.
        width = rounded_up(relative_width(lower, upper) / (1 - OF_FLOWS), 2)
        content = f", or be content with seal.rtol = {width}"
    return (
        f"the leak rate of the seal is known to ±{reached}, and seal.rtol = {rtol:g} asks for "
        f"±{asked}: patch {number + 1} of {len(flows)} got to ±{worst}, since "
        f"{flows[number].reason}{content}"
    )
