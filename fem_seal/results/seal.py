"""What result.json says of a whole seal."""

from fem_seal.digits import with_prefix
from fem_seal.leak_rate import rate_text
from fem_seal.results.rates import RateRecord
from fem_seal.results.record import Record
from fem_seal.upscaling.seal import SealLeak, loads_of


class SealPatchRecord(Record):
    """Leak rate of the seal if all its patches were like one of them [m³/s]."""

    state: str
    value: float | None
    lower: float | None
    upper: float | None


class ShareRecord(Record):
    """Share of sealed patches, and its confidence interval."""

    value: float
    lower: float
    upper: float


class SealRecord(Record):
    """The whole seal; docs/results.md explains each."""

    leak_rate: RateRecord | None
    patches: tuple[SealPatchRecord, ...]
    share_sealed: ShareRecord
    patches_along: int
    patches_around: int
    scatter: float
    loads: tuple[float, ...]

    @classmethod
    def of(cls, seal: SealLeak) -> "SealRecord":
        """Numbers of a seal; none where it is lifted off."""
        lifted = seal.state == "lifted off"
        share, low, high = seal.share_sealed
        bounds = {"value": seal.value, "lower": seal.lower, "upper": seal.upper}
        return cls(
            leak_rate=None if lifted else RateRecord(**bounds, unit="m^3/s"),
            patches=tuple(
                SealPatchRecord(
                    state=one.flow.state,
                    value=None if lifted else one.flow.value,
                    lower=None if lifted else one.flow.lower,
                    upper=None if lifted else one.flow.upper,
                )
                for one in seal.patches
            ),
            share_sealed=ShareRecord(value=share, lower=low, upper=high),
            patches_along=seal.count.along,
            patches_around=seal.count.across,
            scatter=seal.scatter,
            loads=loads_of(seal),
        )


def seal_words(seal: SealRecord) -> str:
    """Leak rate of the seal, and of how many patches it is made."""
    if seal.leak_rate is None:
        return "lifted off: the fluid's pressure is nowhere below the contact pressure"
    rate = seal.leak_rate
    text = rate_text(rate.value, rate.lower, rate.upper, rate.unit)
    number = "1 realization" if len(seal.patches) == 1 else f"{len(seal.patches)} realizations"
    sealed = sum(patch.state == "sealed" for patch in seal.patches)
    made = f"{seal.patches_along} x {seal.patches_around} patches (along the path x around it)"
    words = f"{text}; {made}, from {number}, {sealed} sealed"
    if not seal.loads:
        return words
    ends = f"{with_prefix(seal.loads[0], 'Pa')} to {with_prefix(seal.loads[-1], 'Pa')}"
    return f"{words}; {len(seal.loads)} net loads from {ends}"
