"""Points that a function computes from its arguments, each a chain of its own."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from fem_seal.parallel import Comm
from fem_seal.points.compute import Outcome, compute_points
from fem_seal.points.folder import PointFolder
from fem_seal.points.task import Chain, Task
from fem_seal.points.work import Work
from fem_seal.progress import Report

Point = TypeVar("Point")


@dataclass(frozen=True)
class StudyTask(Task[Point]):
    """A point that a function computes from its arguments."""

    function: Callable[..., Point]  #: a function of a module, so that workers can import it
    arguments: tuple[Any, ...]
    #: keyword arguments of the function
    options: Mapping[str, Any] = field(default_factory=dict)

    def compute(self, handed_on: Any, report: Report, comm: Comm) -> Point:
        """Call the function; nothing is handed on."""
        report("computing", "")
        return self.function(*self.arguments, **self.options)


def compute_study(chains: Sequence[Chain], work: Work | None, report: Report) -> Outcome:
    """Compute the points that the folders lack; one that fails does not stop the others.

    The arguments are those of `compute_points`; without `work` the chains are computed in turn.

    Raises
    ------
    FemSealError
        If points have failed, after the others have been computed.
    """
    outcome = compute_points(chains, work or Work(), report=report)
    if outcome.failures:
        label, error = next(iter(outcome.failures.items()))
        count = len(outcome.failures)
        points = "a point has failed" if count == 1 else f"{count} points have failed, the first of"
        points += "" if count == 1 else " them"
        raise type(error)(f"{points}: {label}: {error}")
    return outcome


def chain_of(folder: PointFolder[Point], task: StudyTask[Point]) -> Chain[Point]:
    """A chain of one point."""
    return Chain(folder, (task,))
