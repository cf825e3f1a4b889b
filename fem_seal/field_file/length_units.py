"""Units of length and pressure as instruments and their software write them."""

from fem_seal.errors import InvalidInput
from fem_seal.units import to_si

# "A" is the ångström to SurfaceTopography and Gwyddion, and the ampere to a units library.
_SPELT_OTHERWISE = {"A": "angstrom", "Å": "angstrom", "~m": "um"}


_WANTED = {"m": "length such as nm, um, mm or m", "Pa": "pressure such as Pa, MPa or bar"}


def length_in_metres(unit: str, what: str) -> float:
    """Metres in a unit of length such as "um", "µm", "nm", "A" (ångström) or "m"; see `in_si`."""
    return in_si(unit, "m", what)


def in_si(unit: str, si: str, what: str) -> float:
    """Metres ("m") or pascals ("Pa") in a unit of the quantity that a message calls `what`."""
    try:
        return to_si(f"1 {_SPELT_OTHERWISE.get(unit, unit)}", si)
    except ValueError:
        raise InvalidInput(f"{what} are in {unit!r}, which is no unit of {_WANTED[si]}") from None
