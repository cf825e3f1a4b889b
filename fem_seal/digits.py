"""Numbers as text: no more digits than are known, and bounds rounded outwards."""

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context

_MOST = 15  # significant decimal digits that double precision keeps
_PREFIXES = {
    -15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G",
}  # fmt: skip


def bracket_digits(value: float, lower: float, upper: float) -> tuple[str, str, str]:
    """Write an estimate and its bounds with as many digits as the width of the bracket allows.

    The lower bound is rounded down and the upper bound up, so that the rounded bounds still enclose
    the exact value. Rounding moves each by at most a tenth of the half-width. The estimate has one
    digit less. Numbers of either sign, lower <= value <= upper.
    """
    size, half_width = max(abs(lower), abs(upper)), 0.5 * (upper - lower)
    resolved = 3 + math.floor(math.log10(size / half_width)) if half_width > 0 else _MOST
    digits = min(resolved, _MOST)
    low, high = rounded_down(lower, digits), rounded_up(upper, digits)
    shown = _rounded(value, digits - 1, ROUND_HALF_EVEN)
    # An estimate close to a bound may leave the bracket by rounding: give it the full digits.
    if not float(low) <= float(shown) <= float(high):
        shown = _rounded(value, digits, ROUND_HALF_EVEN)
    return shown, low, high


def rounded_down(number: float, digits: int = 4) -> str:
    """Write a lower bound so that the text is not larger than the number."""
    return _rounded(number, digits, ROUND_FLOOR)


def rounded_up(number: float, digits: int = 4) -> str:
    """Write an upper bound so that the text is not smaller than the number."""
    return _rounded(number, digits, ROUND_CEILING)


def _rounded(number: float, digits: int, rounding: str) -> str:
    """Write a number with `digits` significant digits; `rounding` is a constant of `decimal`."""
    # Round the shortest decimal that reads back as the number, so that 0.1 stays 0.1.
    text = repr(float(number)).removesuffix(".0")
    decimal = Context(prec=digits, rounding=rounding).create_decimal(text)
    if -4 <= decimal.adjusted() < max(digits, 6):
        return f"{decimal:f}"
    return f"{decimal:e}"


def in_digits(number: float, digits: int = 4) -> str:
    """Write a number with `digits` significant digits, without zeros at its end: "2.5e-9"."""
    if not math.isfinite(number):
        return str(number)
    mantissa, exponent, power = _rounded(number, digits, ROUND_HALF_EVEN).partition("e")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}{exponent}{power}"


def number_of(count: int, noun: str) -> str:
    """Write a number of things, "1 patch", "4 patches"."""
    return f"{count} {noun}" + ("" if count == 1 else "es" if noun.endswith(("ch", "sh")) else "s")


def per_cent(fraction: float) -> str:
    """Write a fraction in per cent to two digits, "4.1 %"; from 99 % on to whole per cent."""
    number = 100 * fraction
    return f"{number:.2g} %" if abs(number) < 99 else f"{number:.0f} %"


def with_error(number: float, error: float) -> str:
    """Write a number with its standard deviation to two digits, "0.811 ± 0.040"."""
    if not abs(number) * 10.0**-_MOST < error < math.inf:
        return f"{number:.4g} ± {error:.2g}"
    decimals = max(0, 1 - math.floor(math.log10(error)))
    return f"{number:.{decimals}f} ± {error:.{decimals}f}"


def readable(largest: float, unit: str) -> tuple[float, str]:
    """Choose the prefix of an SI unit so that the largest number is between 1 and 1000.

    Returns the factor from the SI unit to that with the prefix, and its symbol, from femto to giga.
    Zero and all other numbers get no prefix.
    """
    finite = 0 < largest < math.inf
    exponent = 3 * math.floor(math.log10(largest) / 3 + 1e-12) if finite else 0
    exponent = exponent if exponent in _PREFIXES else 0
    return 10.0**-exponent, _PREFIXES[exponent] + unit


def with_prefix(number: float, unit: str, digits: int = 4) -> str:
    """Write a number with a readable unit, "53.57 nm"; micro is "u", as in scene files."""
    # Round before choosing the prefix: 999.99 nm to four digits are 1 um.
    scale, symbol = readable(abs(float(f"{number:.{digits}g}")), unit)
    return f"{number * scale:.{digits}g} {symbol.replace('µ', 'u')}"


def length_text(metres: float, digits: int = 4) -> str:
    """Write a length with a readable unit."""
    return with_prefix(metres, "m", digits)
