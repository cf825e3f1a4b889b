"""Errors that users see. A message names the field, its value, the allowed values, the remedy."""

from collections.abc import Sequence
from typing import TypeVar

T = TypeVar("T")

LONGEST_MESSAGE = 2000  # characters; a value that a message quotes may be a whole file


def printable(text: str) -> str:
    """Text for a terminal, with all control characters but line ends escaped.

    A file may come from somebody else: an escape sequence in its name or text could rewrite the
    screen.
    """
    return "".join(
        letter if letter.isprintable() or letter == "\n" else ascii(letter)[1:-1] for letter in text
    )


class FemSealError(Exception):
    """Any failure that fem_seal can explain in one printable line."""

    exit_status = 1  #: that of Python after a traceback: each kind of error has one of its own

    def __str__(self) -> str:
        text = printable(" ".join(super().__str__().splitlines()))
        if len(text) <= LONGEST_MESSAGE:
            return text
        half = LONGEST_MESSAGE // 2
        return f"{text[:half]} … {text[-half:]}"

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines of the message on a terminal."""
        return (str(self),)


# What to do about an output folder that holds something else.
OTHER_FOLDER = "choose another folder (--out)"
OR_OVERWRITE = f"{OTHER_FOLDER}, or replace it: --overwrite (in Python: overwrite=True)"


class InvalidInput(FemSealError):
    """What any function refuses (exit status 2): an invalid scene, file or argument.

    Or one for which memory, disk or permission do not suffice.
    """

    exit_status = 2


class InvalidScene(InvalidInput):
    """A scene has errors, one sentence each; `source` is its file, or empty (exit status 2)."""

    def __init__(self, source: str, errors: Sequence[str]) -> None:
        self.source, self.errors = source, tuple(errors)
        words = errors[0] if len(errors) == 1 else f"{len(errors)} errors: {'; '.join(errors)}"
        super().__init__(": ".join(filter(None, (source, words))))

    def __reduce__(self) -> tuple[type, tuple[str, tuple[str, ...]]]:
        """Pickle the arguments, which are not those of other errors."""
        return type(self), (self.source, self.errors)

    @property
    def lines(self) -> tuple[str, ...]:
        """A line for each error, if there are several."""
        if len(self.errors) == 1:
            return super().lines
        head = f"{self.source or 'the scene'} has {len(self.errors)} errors:"
        return (head, *(f"  {InvalidInput(error)}" for error in self.errors))


class MissingPackage(InvalidInput):
    """A package or a system library that this scene needs is not installed (exit status 2)."""


class NotConverged(FemSealError):
    """An iteration stopped before it reached its tolerance (exit status 3)."""

    exit_status = 3


class Inconsistent(FemSealError):
    """An answer contradicts itself, which is a defect of the solver (exit status 3, no answer)."""

    exit_status = 3


def explained(error: MemoryError | OSError) -> InvalidInput:
    """Say in our words what the system has refused, as a refusal of the input."""
    if isinstance(error, MemoryError):
        size = f" ({error})" if str(error) else ""
        return InvalidInput(f"not enough memory for this size{size}; choose a smaller one")
    place = f": {error.filename}" if error.filename else ""
    reason = error.strerror or str(error)  # some libraries leave the system's words out
    return InvalidInput(f"{reason or type(error).__name__}{place}")


def present(value: T | None, name: str) -> T:
    """Return a value that cannot be None here, so that its type is no longer optional."""
    if value is None:
        raise Inconsistent(f"{name} is missing; this is a defect of fem_seal, please report it")
    return value


def narrowed(value: object, kind: type[T], name: str) -> T:
    """Return a value that can only be of one kind here, so that its type is that."""
    return present(value if isinstance(value, kind) else None, name)
