"""Part of result.json about a whole seal."""

import numpy as np

from fem_seal.digits import with_prefix
from fem_seal.leak_rate import FlowState
from fem_seal.results.rates import Rate
from fem_seal.results.record import Record
from fem_seal.upscaling.conductivity import StoredTable
from fem_seal.upscaling.seal import SealLeak, Share, median_patch
from fem_seal.upscaling.seal_flow import PathFlow, SealingPart

POINTS = 400  # most points of the leak path in the record


class SealPatchRecord(Record):
    """Leak rate [m³/s] of a seal all of whose patches are like this one, and the patch's table."""

    state: FlowState
    value: float | None
    lower: float | None
    upper: float | None
    conductivity: StoredTable | None = None  #: K [m³/(Pa s)] at net loads [Pa]


class PathRecord(Record):
    """Pressures [Pa] and conductivity [m³/(Pa s)] along the leak path; null where it is open."""

    x: tuple[float, ...]
    contact_pressure: tuple[float, ...]
    fluid_pressure: tuple[float, ...]
    conductivity: tuple[float | None, ...]

    @property
    def ends(self) -> tuple[float, float]:
        """Distances of inlet and outlet from the inlet [m]."""
        return self.x[0], self.x[-1]

    @classmethod
    def of(cls, path: PathFlow) -> "PathRecord":
        """Record of a path, at most `POINTS` places of it."""
        every = -(-len(path.x) // POINTS)
        kept = np.unique(np.append(np.arange(0, len(path.x), every), len(path.x) - 1))
        K = path.conductivity[kept].tolist()
        return cls(
            x=tuple(path.x[kept].tolist()),
            contact_pressure=tuple(path.contact_pressure[kept].tolist()),
            fluid_pressure=tuple(path.fluid_pressure[kept].tolist()),
            conductivity=tuple(value if np.isfinite(value) else None for value in K),
        )


class SealRecord(Record):
    """The whole seal; docs/reference/results.md explains each."""

    leak_rate: Rate | None
    patches: tuple[SealPatchRecord, ...]
    share_sealed: Share
    patches_along: int
    patches_around: int
    scatter: float | None
    interval: tuple[float, float] | None = None
    loads: tuple[float, ...]
    sealing: SealingPart | None = None
    path: PathRecord | None = None

    @classmethod
    def of(cls, seal: SealLeak) -> "SealRecord":
        """Record of a seal; it has no leak rates if the seal is lifted off."""
        lifted = seal.state == "lifted off"
        bounds = {"value": seal.value, "lower": seal.lower, "upper": seal.upper}
        tables = [one.table for one in seal.patches if one.table is not None]
        along = median_patch(seal.patches).flow.path
        return cls(
            leak_rate=None if lifted else Rate(**bounds),
            patches=tuple(
                SealPatchRecord(
                    state=one.flow.state,
                    value=None if lifted else one.flow.value,
                    lower=None if lifted else one.flow.lower,
                    upper=None if lifted else one.flow.upper,
                    conductivity=None if one.table is None else StoredTable.of(one.table),
                )
                for one in seal.patches
            ),
            share_sealed=seal.share_sealed,
            patches_along=seal.count.along,
            patches_around=seal.count.across,
            scatter=seal.scatter if len(seal.patches) > 1 and not lifted else None,
            interval=seal.interval,
            loads=tuple(sorted({load for table in tables for load in table.loads.tolist()})),
            sealing=seal.sealing,
            path=None if along is None else PathRecord.of(along),
        )


def lifted_words(seal: SealRecord) -> str:
    """Why a seal is lifted off, with both pressures."""
    if seal.path is None:
        return "lifted off: the contact pressure is nowhere above the fluid's at the inlet"
    P, inlet = max(seal.path.contact_pressure), seal.path.fluid_pressure[0]
    return (
        f"lifted off: the contact pressure, at most {with_prefix(P, 'Pa')}, is nowhere above the "
        f"fluid's at the inlet, {with_prefix(inlet, 'Pa')}; press harder"
    )


def seal_words(seal: SealRecord) -> str:
    """Number of the patches of a seal, net loads, and the part that seals."""
    if seal.leak_rate is None:
        return lifted_words(seal)
    rate = seal.leak_rate
    number = "1 realization" if len(seal.patches) == 1 else f"{len(seal.patches)} realizations"
    sealed = sum(patch.state == "sealed" for patch in seal.patches)
    where = "along the path" if rate.upper == 0 else "along the part of the path that seals"
    made = f"{seal.patches_along} patches {where}, {seal.patches_around} around the seal"
    words = f"{made}, drawn from {number}, {sealed} sealed"
    net = "(contact pressure less fluid pressure)"
    if len(seal.loads) == 1:
        words += f"; solved at a net load {net} of {with_prefix(seal.loads[0], 'Pa')}"
    elif seal.loads:
        ends = f"{with_prefix(seal.loads[0], 'Pa')} to {with_prefix(seal.loads[-1], 'Pa')}"
        words += f"; solved at {len(seal.loads)} net loads {net} from {ends}"
    if seal.sealing is None:
        return words
    start, middle, end = (
        with_prefix(x, "m") for x in (seal.sealing.start, seal.sealing.middle, seal.sealing.end)
    )
    if start == end:
        return f"{words}; seals where the contact pressure is highest, {start} behind the inlet"
    if seal.path is not None and (seal.sealing.start, seal.sealing.end) == seal.path.ends:
        return f"{words}; seals on the whole path, {end}"
    begin = f"from {start}" if seal.sealing.start > 0 else "from the inlet"
    words += f"; seals {begin} to {end} behind the inlet"
    return words if rate.upper == 0 else f"{words}, half of it before {middle}"
