"""The leak rate of a scene's whole seal, from its patches."""

from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from math import prod
from pathlib import Path
from time import perf_counter
from typing import Protocol, TypeVar

import numpy as np

from fem_seal import parallel
from fem_seal.digits import per_cent, rounded_up
from fem_seal.errors import present
from fem_seal.files import temporary_folder
from fem_seal.fluid import Slip
from fem_seal.leak_rate import (
    Bounded,
    Factors,
    LeakRate,
    half_width_of,
    relative_half_width,
    relative_width,
)
from fem_seal.patch import Patch
from fem_seal.points import Expected, Work
from fem_seal.progress import NOTE
from fem_seal.upscaling.leak_path import EndPressures, LeakPath
from fem_seal.upscaling.mosaic import (
    LEAST_LEAKING,
    SEED,
    PatchCount,
    drawn_seals,
    generalised_interval,
    may_conduct,
    sealed_share,
)
from fem_seal.upscaling.path_flow import SealFlow, lifted_off, seal_flow
from fem_seal.upscaling.realizations import realizations
from fem_seal.upscaling.scene_profile import leak_path_of
from fem_seal.upscaling.solved_patches import OF_FLOWS, solved_patches

# A sealed seal is tried under lower loads, until its patches leak.
LOWER_LOADS = 4  # at most
NEXT_LOAD = 0.8  # net load over the one before
# Pressures at which the slip along the path is compared, and the lowest over the inlet's.
PRESSURES, NEXT_TO_VACUUM = 65, 1e-6
LOOSE = 1.0  # (upper - lower)/√(lower upper) of the leak rate under them


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SealLeak(LeakRate):
    """Leak rate of a seal, and the patches from which it is computed.

    The bounds are estimates. They hold for the patches that were solved, and come from the bounds
    of their flows and of their conductivity between two loads.
    """

    lower: float = field()  # required, other than of a flow by finite differences
    upper: float = field()
    patches: tuple[SealFlow, ...]  #: leak rate of a seal of such patches, for each realization
    count: PatchCount  #: patches along the part of the path that decides, and around the seal
    relative_scatter: float  #: standard deviation of the leak rate of such seals over its mean
    #: confidence interval [m³/s] of the leak rate due to the scatter of the patches, and its
    #: median; None if too few realizations leak to estimate it
    interval: Bounded | None = None
    #: share of the realizations that are sealed, and its interval by Clopper and Pearson
    share_sealed: Bounded
    leak_path: float  #: length from inlet to outlet [m]
    #: widest factors of a leaking patch for the grid of its contact; None if one has no estimate
    of_grid: Factors | None = None
    #: smallest critical constriction [m] of a leaking patch at the load that matters most
    critical_gap: float | None = None
    #: factors on the leak rate for how a gas slips along the path; None for a liquid or if sealed
    slip_along: Factors | None = None
    #: what a sealed seal leaks under less load, which is more; None if that is not known
    lowered: "LoweredSeal | None" = None
    next_load_share: float | None = None  #: part of the load to try next for that

    @property
    def leaking(self) -> int:
        """Number of realizations that leak."""
        return sum(flow.state == "leaking" for flow in self.patches)


@dataclass(frozen=True)
class LoweredSeal:
    """A sealed seal under a part of its load, under which enough patches leak."""

    load_share: float  #: the part of the load
    leaking: int  #: realizations that leak there
    #: what it leaks at most there [m³/s], by the 95 % interval over the patches, the bounds of the
    #: flow, the slip along the path and the contact's grid
    at_most: float
    grid_known: bool  #: whether there is an estimate of what that grid changes; else none counts


def under_less_load(
    patch: Patch,
    seal: SealLeak,
    seconds: float,
    folder: Path | None,
    work: Work | None,
    each: Expected | None = None,
) -> SealLeak:
    """A sealed seal with what it leaks at most, from a load under which its patches leak.

    Where all patches are sealed, nothing is known of those that were not drawn. Under less load
    some leak, and their scatter tells what others leak; under its own load the seal leaks less. At
    most `LOWER_LOADS` loads are tried, each first with as many patches as an interval needs; after
    so many seconds none is begun.
    """
    if not may_conduct(1 - seal.share_sealed.lower, seal.count):
        return seal
    start, (profile, _, ends) = perf_counter(), leak_path_of(patch.scene)
    highest, inlet = profile.highest, ends.inlet
    *shares, last = (
        (inlet + (highest - inlet) * NEXT_LOAD**n) / highest for n in range(1, LOWER_LOADS + 2)
    )
    # An inlet below ambient presses the solids together without any load.
    tried, next_share = [share for share in shares if share > 0], last if last > 0 else None
    if len(seal.patches) < LEAST_LEAKING:
        return replace(seal, next_load_share=next(iter(tried), None))
    with ExitStack() as held:
        if folder is None:  # one folder for all processes
            folder = parallel.on_root(lambda: held.enter_context(temporary_folder()), patch.comm)
        for load_share in tried:
            # Times differ from process to process.
            late = parallel.on_root(lambda: perf_counter() - start > seconds, patch.comm)
            if late:
                return replace(seal, next_load_share=load_share)
            patch.report(
                NOTE,
                "all patches are sealed: what others may leak is sought under "
                f"{per_cent(load_share)} of the load (at most {LOWER_LOADS} loads, in addition to "
                "the time expected)",
            )
            few = solve_seal(
                patch, folder, work, load_share=load_share, patches=LEAST_LEAKING, each=each
            )
            if few.share_sealed.value == 1:
                continue
            lowered = solve_seal(patch, folder, work, load_share=load_share, each=each)
            if lowered.interval is not None:
                known = [one for one in (lowered.slip_along, lowered.of_grid) if one is not None]
                bounds = lowered.upper / lowered.value
                at_most = lowered.interval.upper * bounds * prod(one.upper for one in known)
                found = LoweredSeal(
                    load_share, lowered.leaking, at_most, lowered.of_grid is not None
                )
                return replace(seal, lowered=found)
    return replace(seal, next_load_share=next_share)


def solve_seal(
    patch: Patch,
    folder: Path | None = None,
    work: Work | None = None,
    *,
    load_share: float = 1.0,
    patches: int | None = None,
    each: Expected | None = None,
) -> SealLeak:
    """Leak rate of the seal of a scene with [seal].

    Parameters
    ----------
    patch
        The first patch.
    folder
        It has a file for each patch, with which an interrupted run goes on.
    work
        How the patches are shared among workers; one after the other if left out.
    load_share
        Part of the load. With less than all of it, bounds of a factor of about two are enough.
    patches
        Number of realizations, from the first one on; all if left out.
    each
        What each is expected to take.
    """
    scene, seal = patch.scene, present(patch.scene.seal, "[seal]")
    profile, path, ends = leak_path_of(scene, load_share)
    rtol, size = seal.rtol if load_share == 1 else max(seal.rtol, LOOSE), size_of_patch(patch)
    if profile.highest <= ends.inlet:
        return seal_of_patches(
            (lifted_off(profile, ends),) * seal.patches, path, size, rtol, scene.flow.method
        )
    scenes = realizations(scene.with_({"seal.rtol": rtol}))[:patches]
    solved = solved_patches(scenes, patch, folder, work or Work(), load_share, each)
    flows, slips = [], []
    for of_patch in solved:
        gap, along = of_patch.critical_gap, ends
        if scene.slip is not None and gap:
            along = ends.slipping(scene.slip, gap)
            slips.append(_slip_factors(scene.slip, gap, along))
        flow = seal_flow(of_patch.table, profile, path, along)
        flows.append(replace(flow, reason=of_patch.reason))
    grids = [of_patch.of_grid for of_patch in solved if of_patch.table.upper.any()]
    gaps = [of_patch.critical_gap for of_patch in solved if of_patch.critical_gap]
    together = seal_of_patches(tuple(flows), path, size, rtol, scene.flow.method)
    return replace(
        together,
        of_grid=Factors.widest(grids),
        critical_gap=min(gaps, default=None),
        slip_along=Factors.widest(slips),
    )


def _slip_factors(slip: Slip, gap: float, along: EndPressures) -> Factors:
    """Least and largest ratio of the conductivity of a place to what the path takes it to be.

    The path takes all of K to change with the pressure as 1 + b/p, b that of the critical
    constriction, a gap [m]. A wider gap changes less: where the constriction conducts k(p) times as
    much as at the mean pressure, it conducts between 1 and k(p) times as much.
    """
    lowest, highest = slip.outlet_pressure, slip.inlet_pressure
    pressures = np.geomspace(max(lowest, NEXT_TO_VACUUM * highest), highest, PRESSURES)
    k = slip.change(pressures, gap)
    taken = (1 + along.slip / pressures) / (1 + along.slip / slip.mean_pressure)
    below, above = (np.minimum(k, 1.0) / taken).min(), (np.maximum(k, 1.0) / taken).max()
    return Factors(min(float(below), 1.0), max(float(above), 1.0))


def size_of_patch(patch: Patch) -> tuple[float, float]:
    """Lengths [m] of the part of the seal that a patch stands for.

    The images of a mirrored map are no more of the surface: its K is that of the map alone.
    """
    along, across = present(patch.surface, "surface").size
    map_ = patch.scene.measured_map
    mirrored = map_ is not None and map_.make_periodic == "mirror"
    return (along / 2, across / 2) if mirrored else (along, across)


class _Leaks(Protocol):
    @property
    def value(self) -> float | None: ...


AnyPatch = TypeVar("AnyPatch", bound=_Leaks)


def median_patch(patches: tuple[AnyPatch, ...]) -> AnyPatch:
    """The patch of the median leak rate; of an even number the one that leaks more."""
    return sorted(patches, key=lambda patch: patch.value or 0.0)[len(patches) // 2]


def seal_of_patches(
    flows: tuple[SealFlow, ...],
    path: LeakPath,
    size: tuple[float, float],
    rtol: float,
    method: str,
) -> SealLeak:
    """Put the patches of a size [m] into the mosaic of the seal."""
    lifted_off = flows[0].state == "lifted off"  # as all are, whose pressures are the same
    rates = np.array([(flow.lower, flow.value, flow.upper) for flow in flows])
    lengths = [flow.path.sealing_length for flow in flows if flow.path and flow.state == "leaking"]
    length = float(np.median(lengths)) if lengths else path.length
    count = PatchCount.of(length, path.circumference, size)
    sealed = sum(flow.state == "sealed" for flow in flows)
    mean, scatter, interval = rates[0], 0.0, None
    if not lifted_off:
        mean, scatter = drawn_seals(rates, count, np.random.default_rng(SEED))
        interval = generalised_interval(rates[:, 1], count, np.random.default_rng(SEED))
    lower, value, upper = map(float, mean)
    return SealLeak(
        state="lifted off" if lifted_off else "sealed" if upper == 0 else "leaking",
        method=method,
        value=value,
        lower=lower,
        upper=upper,
        patches=flows,
        count=count,
        relative_scatter=scatter,
        interval=interval,
        share_sealed=sealed_share(sealed, len(flows)),
        reason=_missed_rtol(flows, lower, upper, rtol),
        leak_path=path.length,
    )


def _missed_rtol(patches: tuple[SealFlow, ...], lower: float, upper: float, rtol: float) -> str:
    """Sentence on the tolerance that the bounds of the seal [m³/s] miss, else empty.

    The bounds of a patch that leaks little may be wide if those of the seal are narrow enough.
    """
    ended = [number for number, patch in enumerate(patches) if patch.reason]
    if not ended or relative_width(lower, upper) <= rtol:
        return ""
    widths = [relative_half_width(patches[k].lower, patches[k].upper) for k in ended]
    number = ended[int(np.argmax(widths))]
    reached, asked, worst = map(
        per_cent, (relative_half_width(lower, upper), half_width_of(rtol), max(widths))
    )
    content = ""
    if lower > 0:
        # The flows take the part OF_FLOWS of any tolerance, the loads no more than they do now.
        width = rounded_up(relative_width(lower, upper) / (1 - OF_FLOWS), 2)
        content = f"; seal.rtol = {width} would do"
    return (
        f"the leak rate of the seal is known to ±{reached}, and seal.rtol = {rtol:g} asks for "
        f"±{asked}: patch {number + 1} of {len(patches)} got to ±{worst}, since "
        f"{patches[number].reason}{content}"
    )
