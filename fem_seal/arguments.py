"""Checks of arguments: names of methods, types, and ranges of numbers."""

from collections.abc import Collection, Mapping
from math import isfinite
from numbers import Integral, Real
from typing import TypeVar

from fem_seal.errors import InvalidInput

T = TypeVar("T")


def choose(names: Mapping[str, T], name: str, field: str) -> T:
    """Value under one of several names; a message calls the input `field`."""
    require_known(names, name, field)
    return names[name]


def require_known(names: Collection[str], name: str, field: str) -> None:
    """Raise InvalidInput unless `name` is one of `names`; see `choose`."""
    if name not in names:
        raise InvalidInput(f"{field} = {name!r} is unknown; choose from {', '.join(names)}")


def require_kind(kind: type | tuple[type, ...], /, **values: object) -> None:
    """Raise InvalidInput if one of the named values is not of a class, or of one of several."""
    kinds = kind if isinstance(kind, tuple) else (kind,)
    for name, value in values.items():
        if not isinstance(value, kinds):
            known = " or ".join("None" if one is type(None) else one.__name__ for one in kinds)
            raise InvalidInput(f"{name} must be of type {known}, not {type(value).__name__}")


def require_positive(**values: float) -> None:
    """Raise InvalidInput if one of the named values is not a positive number."""
    for name, value in values.items():
        if not (isinstance(value, Real) and isfinite(value) and value > 0):
            raise InvalidInput(f"{name} = {value!r} must be a positive number, in SI units")


def require_count(least: int = 1, /, **values: object) -> None:
    """Raise InvalidInput if one of the named values is not a whole number of at least `least`."""
    for name, value in values.items():
        if isinstance(value, bool) or not (isinstance(value, Integral) and int(value) >= least):
            raise InvalidInput(f"{name} = {value!r} must be a whole number >= {least}")


def require_not_negative(**values: float) -> None:
    """Raise InvalidInput if one of the named values is not a number of at least 0."""
    for name, value in values.items():
        if not (isinstance(value, Real) and isfinite(value) and value >= 0):
            raise InvalidInput(f"{name} = {value!r} must be a finite number >= 0, in SI units")
