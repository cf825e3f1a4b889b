"""Units of length as instruments and their software write them."""

from fem_seal.errors import InvalidInput
from fem_seal.units import to_si

# "A" is the ångström to SurfaceTopography and Gwyddion, and the ampere to a units library.
_SPELT_OTHERWISE = {"A": "angstrom", "Å": "angstrom", "~m": "um"}


def length_in_metres(unit: str, what: str) -> float:
    """Metres in a unit of length such as "um", "µm", "nm", "A" (ångström) or "m".

    Parameters
    ----------
    unit : name of the unit
    what : name of the quantity in this unit, for the message

    Raises
    ------
    InvalidInput
        If it is no unit of length.
    """
    try:
        return to_si(f"1 {_SPELT_OTHERWISE.get(unit, unit)}", "m")
    except ValueError:
        raise InvalidInput(
            f"{what} are in {unit!r}, which is no unit of length such as nm, um, mm or m"
        ) from None
