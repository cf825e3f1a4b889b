"""Numbers with units: "5 um", "2 MPa", "1 mPa s" become SI floats; leak rates keep theirs."""

import re
from dataclasses import dataclass
from functools import cache
from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

# What a message shows as an example of each SI unit.
_EXAMPLES = {"m": "5 um", "Pa": "2 MPa", "Pa s": "1 mPa s", "s": "10 min", "byte": "2 GB"}
_EXAMPLES |= {"K": "20 degC", "kg/mol": "29 g/mol", "rad": "90 deg"}

# What counts a leak rate, and its SI unit.
RATES = {"volume": "m^3/s", "throughput": "Pa m^3/s", "amount": "mol/s", "mass": "kg/s"}
_RATE_WANTED = (
    "should be a volume ('ml/h'), pressure times volume ('mbar l/s'), amount ('mol/s') or mass "
    "('g/h') per time"
)


@cache
def _registry() -> "pint.UnitRegistry":
    """Pint reads its definitions once, and only if some scene writes units."""
    from decimal import Decimal

    import pint

    # Decimals make "5 um" the very float 5e-6, so that both spellings are the same scene.
    return pint.UnitRegistry(non_int_type=Decimal)


def to_si(value: object, unit: str) -> float:
    """Turn a number, or a number with a unit, into SI units.

    Parameters
    ----------
    value : an SI number, or a string of a number and a unit such as "5 um"
    unit : the SI unit wanted, such as "Pa s"

    Returns
    -------
    float, in `unit`; 0.0 and infinities pass, the range is the caller's business.

    Raises
    ------
    ValueError
        If the value is neither, the unit is missing or unknown, or has another dimension.
    """
    wanted = f"should be a number in {unit} or a string with a unit such as {_EXAMPLES[unit]!r}"
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(wanted)
    if not isinstance(value, str):
        return float(value)
    match = _NUMBER_AND_UNIT.fullmatch(value)
    if not match:
        raise ValueError(wanted)
    number, text = match.groups()
    if not text:
        raise ValueError(f"has no unit; {wanted}")
    return _convert(number, text, unit, wanted)


def _convert(number: str, text: str, unit: str, wanted: str) -> float:
    from decimal import Decimal
    from tokenize import TokenError

    import pint

    registry = _registry()
    try:
        # parse_units takes names and powers only; parse_expression would read "5,0 um" as 50 um.
        given = registry.parse_units(text)
        return float(registry.Quantity(Decimal(number), given).m_as(unit.replace(" ", "*")))
    except pint.DimensionalityError:
        raise ValueError(f"is not in a unit of {unit}; {wanted}") from None
    except (pint.PintError, ValueError, TypeError, SyntaxError, TokenError):
        raise ValueError(f"has an unknown unit {text!r}; {wanted}") from None


@dataclass(frozen=True)
class RateUnit:
    """A unit of leak rates.

    name : as it was written; kind : a key of `RATES`; size : one of it, in the SI unit of its kind
    """

    name: str
    kind: str
    size: float

    @classmethod
    def parse(cls, text: object) -> "RateUnit":
        """Read "ml/h", "mbar l/s" or any other unit of a leak rate.

        Raises
        ------
        ValueError
            If it is no unit, or not one of a leak rate.
        """
        from tokenize import TokenError

        import pint

        if not isinstance(text, str) or text.strip()[:1].isdigit():
            raise ValueError(_RATE_WANTED)
        try:
            unit = _registry().parse_units(text)
        except (pint.PintError, ValueError, TypeError, SyntaxError, TokenError):
            raise ValueError(f"has an unknown unit; it {_RATE_WANTED}") from None
        for kind, si in RATES.items():
            si = si.replace(" ", "*")
            if unit.is_compatible_with(si):
                return cls(text.strip(), kind, float(_registry().Quantity(1, unit).m_as(si)))
        raise ValueError(f"does not measure a leak rate; it {_RATE_WANTED}")


@dataclass(frozen=True)
class Rate:
    """A leak rate as a person writes it: "1 ml/h". A plain number is in m³/s."""

    number: float
    unit: RateUnit

    def __str__(self) -> str:
        return f"{self.number!r} {self.unit.name}"

    @property
    def si(self) -> float:
        """Value in the SI unit of its kind."""
        return self.number * self.unit.size

    @classmethod
    def parse(cls, value: object) -> "Rate":
        """Read a leak rate > 0.

        Raises
        ------
        ValueError
            If it is neither a positive number nor one with a unit of a leak rate.
        """
        match = None if isinstance(value, bool) else _NUMBER_AND_UNIT.fullmatch(str(value))
        if not match:
            raise ValueError("should be a leak rate such as '1 ml/h'")
        number, text = match.groups()
        if not text and isinstance(value, str):
            raise ValueError("has no unit; a leak rate is written such as '1 ml/h'")
        if not 0 < float(number) < inf:
            raise ValueError("should be greater than 0 and finite")
        return cls(float(number), RateUnit.parse(text or RATES["volume"]))
