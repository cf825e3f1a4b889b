"""Numbers for people: no more digits than are known, bounds rounded away from what they enclose."""

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context

_MOST = 15  # what double precision holds
_PREFIXES = {
    -15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G",
}  # fmt: skip


def bracket_digits(value: float, lower: float, upper: float) -> tuple[str, str, str]:
    """Write an estimate and its bounds with as many digits as the bracket is worth.

    The lower bound is rounded down and the upper one up: what is written still encloses. That
    moves each by at most a tenth of the half-width; the estimate has one digit less.

    Parameters
    ----------
    value, lower, upper : lower <= value <= upper, of either sign

    Returns
    -------
    Texts of value, lower and upper.
    """
    size, half_width = max(abs(lower), abs(upper)), 0.5 * (upper - lower)
    wanted = 3 + math.floor(math.log10(size / half_width)) if half_width > 0 else _MOST
    digits = min(wanted, _MOST)
    low, high = rounded_down(lower, digits), rounded_up(upper, digits)
    shown = _rounded(value, digits - 1, ROUND_HALF_EVEN)
    if not float(low) <= float(shown) <= float(high):  # the estimate is nearly a bound
        shown = _rounded(value, digits, ROUND_HALF_EVEN)
    return shown, low, high


def rounded_down(number: float, digits: int = 4) -> str:
    """Write a lower bound: no larger than the number."""
    return _rounded(number, digits, ROUND_FLOOR)


def rounded_up(number: float, digits: int = 4) -> str:
    """Write an upper bound: no smaller than the number."""
    return _rounded(number, digits, ROUND_CEILING)


def _rounded(number: float, digits: int, rounding: str) -> str:
    # From the shortest text that reads back as the number: 0.1 stays 0.1 in either direction.
    text = repr(float(number)).removesuffix(".0")
    decimal = Context(prec=digits, rounding=rounding).create_decimal(text)
    if -4 <= decimal.adjusted() < max(digits, 6):
        return f"{decimal:f}"
    return f"{decimal:e}"


def with_error(number: float, error: float) -> str:
    """Write a measured number with two digits of its standard deviation, "0.811 ± 0.040"."""
    if not 0 < error < math.inf:
        return f"{number:.4g} ± {error:.2g}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{number:.{decimals}f} ± {error:.{decimals}f}"


def readable(largest: float, unit: str) -> tuple[float, str]:
    """Choose a prefix so that the largest number shown lies between 1 and 1000.

    Parameters
    ----------
    largest : the largest magnitude shown, in SI
    unit : symbol of the SI unit, "m" or "Pa"

    Returns
    -------
    scale, symbol : multiply SI numbers by `scale` to have them in `symbol`; numbers beyond the
        prefixes from femto to giga, and zero, keep the plain unit.
    """
    exponent = 3 * math.floor(math.log10(largest) / 3 + 1e-12) if largest > 0 else 0
    exponent = exponent if exponent in _PREFIXES else 0
    return 10.0**-exponent, _PREFIXES[exponent] + unit


def with_prefix(number: float, unit: str, digits: int = 4) -> str:
    """Write a number with its unit and the prefix that suits it, "53.57 nm".

    Micro is "u", as scene files write it.
    """
    # Rounded first: 999.99 nm are 1 um.
    scale, symbol = readable(abs(float(f"{number:.{digits}g}")), unit)
    return f"{number * scale:.{digits}g} {symbol.replace('µ', 'u')}"
