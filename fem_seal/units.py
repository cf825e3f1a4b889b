"""Numbers with units: "5 um", "2 MPa", "1 mPa s" become SI floats; leak rates keep their unit."""

import re
from dataclasses import dataclass
from functools import cache
from math import inf
from numbers import Real
from tokenize import TokenError
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

LEAST_NUMBER = 1e-300  # least number of a scene but 0, in SI units
TOO_LARGE = "is larger than any number that is computed with; check it"

NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

# Volumes per time at standard conditions, "slm", "sccm", "Nl/min". Pint's "slm" is a pressure times
# volume, right for a gas of 0 degC only.
_STANDARD_VOLUME = re.compile(
    r"\b(s(lp?|cc|cf)[hms]|standard_liter_per_minute|std|N(ml|l|L|cm|m\W?[3³]))(?![^\W\d_])"
)
# Pint's "px" is the 1/96 inch of web pages, and its "point" the 1/72 inch of printers.
_PIXEL = re.compile(r"\b(px|pixels?|points?)\b")
# Errors of pint for texts such as "-", "m/0" and "um um".
_NO_UNIT = ValueError, TypeError, SyntaxError, AssertionError, ArithmeticError, TokenError
_WORD = re.compile(r"[^\W\d_]+")
# Example of a quantity of each SI unit, for messages.
_EXAMPLES = {
    "m": "5 um",
    "Pa": "2 MPa",
    "Pa s": "1 mPa s",
    "s": "10 min",
    "byte": "2 GB",
    "K": "20 degC",
    "kg/mol": "29 g/mol",
    "rad": "90 deg",
    "N/m": "2 kN/m",
}

# Kinds of leak rate, by volume, pressure × volume, amount or mass per time, with their SI units.
RATES = {"volume": "m^3/s", "throughput": "Pa m^3/s", "amount": "mol/s", "mass": "kg/s"}
_RATE_EXPECTED = (
    "must be a volume ('ml/h'), pressure times volume ('mbar l/s'), amount ('mol/s') or mass "
    "('g/h') per time"
)


@cache
def _registry() -> "pint.UnitRegistry":
    """Pint's registry of units, created when a unit is read for the first time."""
    from decimal import Decimal

    import pint

    # With decimals "5 um" becomes exactly the float 5e-6, so that both give the same scene.
    return pint.UnitRegistry(non_int_type=Decimal)


def to_si(value: object, unit: str) -> float:
    """Convert a number, or a number with a unit such as "5 um", to an SI unit such as "Pa s".

    Any number is accepted here, also 0 and infinity. ValueError if the value is neither a number
    nor such a text, or its unit is missing, unknown or of another dimension.
    """
    expected = f"must be a number in {unit} or a string with a unit such as {_EXAMPLES[unit]!r}"
    if not isinstance(value, str):
        return plain_number(value, expected)
    match = NUMBER_AND_UNIT.fullmatch(value)
    if not match:
        raise ValueError(expected)
    number, text = match.groups()
    if not text:
        raise ValueError(f"has no unit; {expected}")
    if _PIXEL.search(text):
        raise ValueError(
            f"is in pixels or points, which are of no fixed length; {expected}: their number times "
            "the distance of the samples"
        )
    converted = _converted(number, text, unit, expected)
    if converted is None:
        raise ValueError(f"is not in a unit of {unit}; {expected}")
    return _of_size(converted)


def plain_number(value: object, expected: str) -> float:
    """A number, also one of NumPy, as a float; ValueError for anything else."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise ValueError(expected)
    try:
        return _of_size(float(value))
    except OverflowError:
        raise ValueError(TOO_LARGE) from None


def _of_size(number: float) -> float:
    """Return a number; ValueError if it is so small that its products would be 0."""
    if 0 < abs(number) < LEAST_NUMBER:
        raise ValueError(f"is closer to 0 than {LEAST_NUMBER:g}; give 0 or check its unit")
    return number


def _parsed(text: str) -> "pint.Unit":
    """A unit by pint, which would read "MPas" as the plural of MPa: ValueError for such a word."""
    registry = _registry()
    if "%" in text and text != "%":  # pint's is a hundredth: "% ml/h" would be 0.01 ml/h
        raise ValueError(text)
    unit = registry.parse_units(text)
    for word in _WORD.findall(text):
        for _, name, _ in registry.parse_unit_name(word) if word.endswith("s") else ():
            symbol = registry.get_symbol(name)
            if symbol != name and len(word) > 1 and word[:-1].endswith(symbol):
                raise ValueError(word)
    return unit


def _converted(number: str, text: str, unit: str, expected: str) -> float | None:
    """Convert a number with the unit `text` to an SI unit; None if they measure different things.

    ValueError for an unknown unit, with a message that ends with `expected`.
    """
    from decimal import Decimal, Overflow

    import pint

    registry, si = _registry(), unit.replace(" ", "*")
    try:
        # parse_units accepts names and powers only; parse_expression reads "5,0 um" as 50 um.
        quantity = registry.Quantity(Decimal(number), _parsed(text))
        # Bytes, angles and parts have no dimension to pint, but roots of their own.
        _, root = registry.get_root_units(quantity.units)
        same = root == registry.get_root_units(si)[1]
        return float(quantity.m_as(si)) if same else None
    except Overflow:
        raise ValueError(TOO_LARGE) from None
    except (pint.PintError, *_NO_UNIT):
        if text.startswith(","):  # the rest of "0,5 um"
            raise ValueError("has a comma; write 0.5 for a half and 1000 for a thousand") from None
        raise ValueError(f"has an unknown unit {text!r}; {expected}") from None


@dataclass(frozen=True)
class RateUnit:
    """A unit of leak rates."""

    name: str  #: the unit as it was written
    kind: str  #: a key of `RATES`
    size: float  #: size of the unit in the SI unit of its kind

    def __str__(self) -> str:
        return self.name

    @classmethod
    def parse(cls, text: object) -> "RateUnit":
        """Read "ml/h", "mbar l/s" or any other unit of a leak rate; ValueError for other text."""
        if not isinstance(text, str) or text.strip()[:1].isdigit():
            raise ValueError(_RATE_EXPECTED)
        if _STANDARD_VOLUME.search(text):
            raise ValueError(
                "is a volume at standard conditions, on which users do not agree; write 'cm^3/min' "
                "or 'l/min': the volume of a gas is that at fluid.reference_temperature and "
                "fluid.reference_pressure (0 degC and 1 atm, if the scene names no others)"
            )
        for kind, si in RATES.items():
            size = _converted("1", text, si, f"it {_RATE_EXPECTED}")
            if size is not None:
                return cls(text.strip(), kind, size)
        raise ValueError(f"does not measure a leak rate; it {_RATE_EXPECTED}")


@dataclass(frozen=True)
class StatedRate:
    """A leak rate with its unit, "1 ml/h"."""

    number: float
    unit: RateUnit

    def __str__(self) -> str:
        return f"{self.number!r}".removesuffix(".0") + f" {self.unit.name}"

    @property
    def si(self) -> float:
        """Value in the SI unit of its kind."""
        return self.number * self.unit.size

    @classmethod
    def parse(cls, value: object) -> "StatedRate":
        """Read a leak rate > 0, a number with a unit; ValueError for anything else."""
        match = None if isinstance(value, bool) else NUMBER_AND_UNIT.fullmatch(str(value))
        if not match:
            raise ValueError("must be a leak rate such as '1 ml/h'")
        number, text = match.groups()
        if not text:
            raise ValueError("has no unit; a leak rate is written such as '1 ml/h' or '1 m^3/s'")
        if not 0 < float(number) < inf:
            raise ValueError("must be greater than 0 and finite")
        return cls(float(number), RateUnit.parse(text))
