"""Readable units: the SI prefix that suits the data of one picture."""

import math

PREFIXES = {
    -15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G",
}  # fmt: skip


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
    exponent = exponent if exponent in PREFIXES else 0
    return 10.0**-exponent, PREFIXES[exponent] + unit
