"""What is computed: points, and chains of points that hand something on."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fem_seal.parallel import Comm
from fem_seal.points.folder import PointFolder
from fem_seal.progress import Report

Point = TypeVar("Point")


@dataclass(frozen=True)
class Task(ABC, Generic[Point]):
    """A point to compute; pickled for the process that does it.

    Attributes
    ----------
    name : str
        Of the point's file, without suffix.
    label : str
        For people.
    """

    name: str
    label: str

    @abstractmethod
    def compute(self, handed_on: Any, report: Report, comm: Comm) -> Point:
        """Compute the point.

        Parameters
        ----------
        handed_on : Any
            What the points of the chain share; see `Chain.begin`.
        report : callable
            Called with the stage and its latest news.
        comm : MPI.Comm or None
            The processes that solve together.

        Raises
        ------
        FemSealError
            If the point fails; the other points are computed all the same.
        """

    def failed(self, reason: str) -> Point | None:
        """Make the point that says why there is no result; None if no such point is kept."""
        return None


def nothing() -> None:
    """Hand nothing on from point to point."""


@dataclass(frozen=True)
class Chain(Generic[Point]):
    """Points computed by one process, one after the other; a worker gets the chain as a whole.

    Attributes
    ----------
    folder : PointFolder
        Where the points go.
    tasks : tuple of Task
    begin : callable
        Makes what the points hand on to each other, such as the contact under the last load.
    """

    folder: PointFolder[Point]
    tasks: tuple[Task[Point], ...]
    begin: Callable[[], Any] = nothing
