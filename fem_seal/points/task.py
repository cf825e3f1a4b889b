"""Tasks, each of which computes a point, and chains of tasks that share objects."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fem_seal.parallel import Comm
from fem_seal.points.folder import PointFolder
from fem_seal.progress import Report

T = TypeVar("T")


@dataclass(frozen=True)
class Task(ABC, Generic[T]):
    """A point to compute; pickled for the process that computes it."""

    name: str  #: name of the point's file, without suffix
    label: str  #: name of the point in messages

    @abstractmethod
    def compute(self, handed_on: Any, report: Report, comm: Comm) -> T:
        """Compute the point.

        `handed_on` is the object that the points of the chain share; see `Chain.begin`. After an
        error the other points are computed all the same.
        """


def nothing() -> None:
    """Do nothing; as `Chain.begin`, hand nothing on from point to point."""


@dataclass(frozen=True)
class Chain(Generic[T]):
    """Points computed by one process, one after the other; a worker gets the chain as a whole."""

    folder: PointFolder[T]  #: folder of the finished points
    tasks: tuple[Task[T], ...]
    #: makes the object that the points hand on to each other, such as the last contact
    begin: Callable[[], Any] = nothing


@dataclass(frozen=True)
class StudyTask(Task[T]):
    """A point that a function computes from its arguments."""

    function: Callable[..., T]  #: a function of a module, so that workers can import it
    arguments: tuple[Any, ...]

    def compute(self, handed_on: Any, report: Report, comm: Comm) -> T:
        """Call the function, which reports no stages; nothing is handed on.

        `comm` is that of all processes, or of a worker by itself: None stands for it in both.
        """
        report("computing", "")
        return self.function(*self.arguments)
