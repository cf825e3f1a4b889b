"""Tasks, each of which computes a point."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fem_seal.parallel import Comm
from fem_seal.progress import Report

T = TypeVar("T")


@dataclass(frozen=True)
class Task(ABC, Generic[T]):
    """A point to compute; pickled for the process that computes it."""

    name: str  #: name of the point's file, without suffix
    label: str  #: name of the point in messages

    @abstractmethod
    def compute(self, report: Report, comm: Comm) -> T:
        """Compute the point; after an error the other points are computed all the same."""


@dataclass(frozen=True)
class StudyTask(Task[T]):
    """A point that a function computes from its arguments."""

    function: Callable[..., T]  #: a function of a module, so that workers can import it
    arguments: tuple[Any, ...]

    def compute(self, report: Report, comm: Comm) -> T:
        """Call the function, which reports no stages.

        `comm` is that of all processes, or of a worker by itself: None stands for it in both.
        """
        report("computing", "")
        return self.function(*self.arguments)
