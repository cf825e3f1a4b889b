"""The steps that prepared a measured surface, for result.json."""

from dataclasses import asdict

from fem_seal.digits import with_prefix
from fem_seal.patch import Patch
from fem_seal.results.record import Record


class StepRecord(Record):
    """A step and the map after it."""

    name: str
    samples: tuple[int, int]
    missing: int
    rms_height: float
    rms_slope: float
    seam: float
    skewness: float | None = None  # None in results of earlier versions

    @classmethod
    def all_of(cls, patch: Patch) -> "tuple[StepRecord, ...] | None":
        """Records of all steps of a patch; None if its surface was not read from a map."""
        if patch.prepared is None:
            return None
        records = []
        for step in patch.prepared.steps:
            numbers = asdict(step.statistics)
            records.append(cls(name=step.name, samples=numbers.pop("shape"), **numbers))
        return tuple(records)


def preparation_words(steps: tuple[StepRecord, ...]) -> str:
    """Rms height, rms slope and seam after each step, and the number of points filled."""
    words = []
    for before, step in zip((None, *steps), steps, strict=False):
        filled = before.missing - step.missing if before and step.name.startswith("fill") else 0
        points = "1 point" if filled == 1 else f"{filled} points"
        name = f"{step.name} ({points})" if filled else step.name
        height = with_prefix(step.rms_height, "m")
        words.append(f"{name}: {height}, {step.rms_slope:.3g}, {step.seam:.3g}")
    return "; ".join(words) + " (rms height, rms slope, seam)"
