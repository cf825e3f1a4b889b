"""Look up one of several alternatives by the name that a scene or an argument gives."""

from collections.abc import Collection, Mapping
from typing import TypeVar

from fem_seal.errors import InvalidInput

Choice = TypeVar("Choice")


def choose(registry: Mapping[str, Choice], name: str, field: str) -> Choice:
    """Look up the value registered under a name.

    Parameters
    ----------
    registry : the values by name
    name : name of the value
    field : name of the input that makes the choice, for the message

    Returns
    -------
    The value registered under `name`.
    """
    require_known(registry, name, field)
    return registry[name]


def require_known(names: Collection[str], name: str, field: str) -> None:
    """Raise InvalidInput unless `name` is one of `names`; see `choose`."""
    if name not in names:
        raise InvalidInput(f"{field} = {name!r} is unknown; choose from {', '.join(names)}")
