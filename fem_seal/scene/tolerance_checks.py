"""Checks of [tolerances] across the sections of a scene, for `checks`."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from fem_seal.scene.tolerances import InputTolerance

if TYPE_CHECKING:
    from fem_seal.scene.scene import Scene


def tolerances(scene: "Scene") -> Iterator[str]:
    """Tolerances without a leak rate or an input; each rule needs those before it."""
    if scene.tolerances is None:
        return
    if scene.leak_rate_of == "nothing":
        yield "[tolerances] is about the leak rate, which output.products does not name"
    given = dict(scene.tolerances.given())
    if not given:
        yield "[tolerances] names no input; leave the section out"
    for name, tolerance in given.items():
        yield from _without_value(scene, name, tolerance)
    yield from _unordered(scene, given)
    yield from _too_large(scene, given)


def _without_value(scene: "Scene", name: str, tolerance: InputTolerance) -> Iterator[str]:
    """A tolerance of an input that the scene does not use, or an amount of a value of 0."""
    section, _, key = name.partition(".")
    known = scene.surface if name == "heights" else getattr(scene, section)
    rigid = scene.contact is not None and not scene.contact.is_elastic
    if known is None or (key and getattr(known, key) is None) or (section == "solid" and rigid):
        compared = ""
        if name == "contact.pressure" and scene.seal is not None and scene.seal.table:
            compared = ", and compare seals with other tables of seal.pressure_profile"
        yield (
            f"tolerances.{name} is of an input that the scene does not use; leave it out{compared}"
        )
    if not tolerance.is_part and scene.value_of(name) == 0:
        yield (
            f"tolerances.{name} = {str(tolerance)!r} is an amount beside a value of 0, of "
            "which no part is known; leave it out, and compare scenes with other values of it"
        )


def _unordered(scene: "Scene", given: Mapping[str, InputTolerance]) -> Iterator[str]:
    """Tolerances of which no end is known to open the film."""
    if "heights" in given and scene.contact is not None and scene.contact.mean_gap is not None:
        yield (
            "tolerances.heights needs contact.pressure or contact.area_fraction: at a given "
            "contact.mean_gap higher heights may open or close the film; leave it out"
        )
    if scene.lift == "range":
        yield (
            "[tolerances] moves both ends of flow.lift = 'range', by other factors than the dry "
            "contact; choose 'resolved', or leave [tolerances] out"
        )
    if scene.lift == "resolved":
        pressed = scene.contact is not None and scene.contact.pressure is not None
        of_solid = () if pressed else ("solid.youngs_modulus", "solid.contact_modulus")
        unclear = "flow.outlet_pressure", *of_solid
        for name in (name for name in given if name in unclear):
            without = "" if pressed else " without contact.pressure"
            yield (
                f"tolerances.{name} may open or close a film that the fluid lifts{without}; leave "
                "it out, and compare scenes with other values of it"
            )


def _too_large(scene: "Scene", given: Mapping[str, InputTolerance]) -> Iterator[str]:
    """Tolerances of 100 % or more, and those with which the pressures change places."""
    for name, part in scene.tolerated.items():
        if part >= 1:
            yield (
                f"tolerances.{name} = {str(given[name])!r} is 100 % of the value or more; it must "
                "be less"
            )
    inlet, outlet = scene.flow.inlet_pressure, scene.flow.outlet_pressure
    if inlet is not None and outlet is not None:
        least = inlet * (1 - scene.tolerated.get("flow.inlet_pressure", 0.0))
        most = outlet * (1 + scene.tolerated.get("flow.outlet_pressure", 0.0))
        if least <= most:
            yield (
                f"[tolerances] let flow.inlet_pressure fall to {least:g} Pa, which is not above "
                f"the {most:g} Pa of flow.outlet_pressure; give smaller ones"
            )
