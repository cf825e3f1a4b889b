"""What an examination of an extreme can end in."""

from collections.abc import Callable
from dataclasses import dataclass

from fem_seal.errors import InvalidInput, NotConverged


@dataclass(frozen=True)
class Outcome:
    """verdict : "right", "refused", "limited" or "broken"; told : how we know, or what was said."""

    verdict: str
    told: str


def right(told: str) -> Outcome:
    """Say that the answer is right, and how we know."""
    return Outcome("right", told)


def limited(told: str) -> Outcome:
    """Say where a limit begins that the program itself reports when it is met."""
    return Outcome("limited", told)


def wrong(told: str) -> Outcome:
    """Say what the program has got wrong."""
    return Outcome("broken", told)


def refusal(work: Callable[[], object]) -> str | None:
    """Message of the clear error that `work` ends in, None if it does not."""
    try:
        work()
    except (InvalidInput, NotConverged) as error:
        return str(error)
    return None
