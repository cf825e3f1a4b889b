"""Numbers with units: "5 um", "2 MPa", "1 mPa s" become SI floats."""

import re
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

# What a message shows as an example of each SI unit.
_EXAMPLES = {"m": "5 um", "Pa": "2 MPa", "Pa s": "1 mPa s", "s": "10 min", "byte": "2 GB"}


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
