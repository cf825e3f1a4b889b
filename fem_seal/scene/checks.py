"""Checks across the sections of a scene. Each raises ContradictionError; `check` runs them all."""

from typing import get_args

from fem_seal.fluid import Drive
from fem_seal.scene.accuracy import Accuracy
from fem_seal.scene.contents import Contents
from fem_seal.scene.fluid import ambient_is_open
from fem_seal.scene.measured import FileSurface
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.sections import LOADS, Product
from fem_seal.units import RateUnit

MOST = 1e100  # largest limit [m³/s]; finite in any unit
# Products that a scene with [shape] does not have.
OF_PERIODIC_CELLS = {"conductivity_tensor", "seal"}
# Why a shape does not take these fields of [flow].
_ON_SHAPES = {"sides": "has its own walls", "representation": "has a gap linear on its triangles"}
_IN_WORDS = {
    "throughput": "a pressure times a volume",
    "amount": "an amount",
    "mass": "a mass",
}
_PRESSURES = "inlet_pressure", "outlet_pressure"


def check(scene: Contents) -> None:
    """Run all checks, in the order in which a user should see the errors.

    Raises
    ------
    ContradictionError
        With a message of each check that fails.
    """
    messages: list[str] = []
    for each in (
        check_origin,
        check_load,
        check_seal,
        check_accuracy,
        check_drive,
        check_tolerances,
        check_lift_and_ambient,
        check_tensor,
        check_mesh,
        check_sensitivity,
    ):
        try:
            each(scene)
        except ContradictionError as error:
            messages += [text for text in error.args if text not in messages]
    if messages:
        raise ContradictionError(*messages)


def check_origin(scene: Contents) -> None:
    """Refuse a gap that the scene defines twice, or not at all."""
    if check_shape(scene):
        check_gap(scene)


def check_drive(scene: Contents) -> None:
    """Refuse pressures, units and limits that do not fit the fluid or the products."""
    if not scene.needs_rates:
        refuse_rates(scene)
    elif scene.fluid is None:
        raise ContradictionError("[fluid] is missing: a leak rate needs fluid.viscosity")
    else:
        check_rates(scene, scene.drive)


def check_lift_and_ambient(scene: Contents) -> None:
    """Refuse a lift, or an ambient pressure, that does not fit the contact."""
    if scene.needs_rates and scene.fluid is not None:
        check_ambient(scene)
        check_lift(scene)


def check_tolerances(scene: Contents) -> None:
    """Refuse tolerances of inputs that the scene does not give, and of 100 % or more."""
    if scene.tolerances is None:
        return
    if not scene.needs_rates:
        raise ContradictionError(
            "[tolerances] is about the leak rate, which output.products does not name"
        )
    given = dict(scene.tolerances.given())
    if not given:
        raise ContradictionError("[tolerances] names no input; leave the section out")
    for name in given:
        section, _, key = name.partition(".")
        known = scene.surface if name == "heights" else getattr(scene, section)
        if known is None or (key and getattr(known, key) is None):
            raise ContradictionError(
                f"tolerances.{name} is of an input that the scene does not give; leave it out"
            )
    for name, part in scene.tolerated.items():
        if part >= 1:
            raise ContradictionError(
                f"tolerances.{name} = {str(given[name])!r} is 100 % of the value or more; it must "
                "be less"
            )


def check_sensitivity(scene: Contents) -> None:
    """Refuse the product "sensitivity" of a film that is no elastic contact under a load."""
    if "sensitivity" not in scene.output.products:
        return
    contact = scene.contact
    elastic = contact is not None and contact.is_elastic and scene.shape is None
    if not elastic or contact is None or contact.area_fraction is not None:
        raise ContradictionError(
            "output.products names 'sensitivity', which is that of an elastic contact on its own "
            "grid under contact.pressure or contact.mean_gap; leave it out, or give one of these"
        )


def check_mesh(scene: Contents) -> None:
    """Refuse the product "mesh" of a method that has none."""
    if "mesh" in scene.output.products and scene.flow.method == "finite-difference":
        raise ContradictionError(
            "output.products names 'mesh', but flow.method = 'finite-difference' has none; "
            "choose adaptive or uniform"
        )


def check_shape(scene: Contents) -> bool:
    """Whether the gap comes from other sections than [shape].

    Raises
    ------
    ContradictionError
        If other sections ask for something that a shape does not have, or also define the gap.
    """
    shape, flow = scene.shape, scene.flow
    if shape is None:
        return True
    for field, only in (("sides", "wall"), ("representation", "linear")):
        if getattr(flow, field) not in (None, only):
            raise ContradictionError(
                f"flow.{field} = {getattr(flow, field)!r} is for a gap on a grid; leave it out "
                f"with [shape], whose mesh {_ON_SHAPES[field]}"
            )
    if flow.method == "finite-difference":
        raise ContradictionError(
            "flow.method = 'finite-difference' needs a grid; [shape] takes adaptive or uniform"
        )
    if scene.accuracy is not None:
        raise ContradictionError(
            "[accuracy] refines the grid of the contact, but a [shape] reads its gap at the "
            "vertices of a mesh that stays as it is; set flow.rtol, and compare meshes by mesh_size"
        )
    unavailable = OF_PERIODIC_CELLS.intersection(scene.output.products)
    if unavailable:
        available = sorted(set(get_args(Product)) - OF_PERIODIC_CELLS)
        raise ContradictionError(
            f"output.products names {min(unavailable)!r}, which is that of a periodic cell; "
            f"a [shape] is none: choose from {', '.join(available)}"
        )
    if shape.own_gap:
        for name in ("gap", "surface", "solid", "contact"):
            if getattr(scene, name) is not None:
                raise ContradictionError(
                    f"[shape] gives the gap and so does [{name}]; give one of the two"
                )
    return not shape.own_gap


def check_gap(scene: Contents) -> None:
    """Refuse a gap that the scene defines twice, or not at all."""
    if scene.gap is not None:
        for name in ("surface", "solid", "contact"):
            if getattr(scene, name) is not None:
                raise ContradictionError(f"[gap] stands in place of [{name}]; give one of the two")
        return
    if scene.surface is None or scene.contact is None:
        name = "surface" if scene.surface is None else "contact"
        raise ContradictionError(f"[{name}] is missing; give [surface] and [contact], or [gap]")
    if scene.contact.is_elastic and scene.solid is None:
        raise ContradictionError(
            "[solid] is missing: contact.model = 'gfmd' needs its contact_modulus"
        )


def check_load(scene: Contents) -> None:
    """Refuse a contact without a load, or with a second one that [seal] gives."""
    contact, seal = scene.contact, scene.seal
    if contact is None:
        return
    loads = [name for name in LOADS if getattr(contact, name) is not None]
    if seal is not None and seal.own_load:
        if loads:
            name = "maximum_pressure" if seal.maximum_pressure is not None else "line_load"
            raise ContradictionError(
                f"seal.{name} gives the contact pressure, and so does contact.{loads[0]}; leave "
                "one of them out"
            )
    elif not loads:
        raise ContradictionError(f"contact: give exactly one of {', '.join(LOADS)}; got none")


def check_seal(scene: Contents) -> None:
    """Refuse a seal whose patches cannot be computed, and products that stand beside it."""
    products = set(scene.output.products)
    if scene.seal is None:
        if "seal" in products:
            raise ContradictionError(
                "[seal] is missing: output.products names 'seal', which needs seal.leak_path and "
                "seal.circumference"
            )
        return
    if "seal" not in products:
        raise ContradictionError(
            "[seal] is given, and output.products does not name 'seal'; add it, as in products = "
            "['seal', 'contact']"
        )
    beside = products - {"seal", "contact", "pictures"}
    if beside:
        raise ContradictionError(
            f"output.products names {sorted(beside)[0]!r} beside 'seal', whose patches are solved "
            "under many loads; ask for it in a scene without [seal]"
        )
    if scene.flow.sides == "wall":
        raise ContradictionError(
            "[seal] puts patches side by side, and walls between them (flow.sides = 'wall') would "
            "make the seal leak less; set flow.sides = 'periodic', or leave it out"
        )
    for name in ("gap", "shape", "accuracy"):
        if getattr(scene, name) is not None:
            raise ContradictionError(
                f"[{name}] does not go with [seal], whose patches are pressed by many loads on the "
                "grid of [surface]; leave one of the two out"
            )
    contact, own = scene.contact, scene.seal.own_load
    if contact is not None and not (contact.is_elastic and (contact.pressure is not None or own)):
        raise ContradictionError(
            "[seal] needs contact.pressure, the mean contact pressure that solid and fluid carry "
            "together, for an elastic contact (contact.model = 'gfmd')"
        )
    if scene.seal.window is not None:
        if not isinstance(scene.surface, FileSurface):
            raise ContradictionError(
                "seal.window cuts patches out of a measured map; for a random surface leave it "
                "out, and patches are seeds"
            )
        if scene.surface.twin_seed is not None:
            raise ContradictionError(
                "seal.window makes patches of parts of the map, and surface.twin_seed of its "
                "spectrum; leave one of the two out"
            )
    if scene.flow.lift not in (None, "none"):
        raise ContradictionError(
            f"flow.lift = {scene.flow.lift!r} is for a single patch; [seal] counts the fluid's "
            "pressure along the leak path itself: leave it out"
        )
    if scene.flow.method == "finite-difference":
        raise ContradictionError(
            "[seal] needs bounds, and flow.method = 'finite-difference' has none; choose adaptive "
            "or uniform"
        )
    if scene.limit is not None and scene.limit.decide:
        raise ContradictionError(
            "limit.decide stops the flow of a single patch; with [seal] set seal.rtol"
        )


def check_accuracy(scene: Contents) -> None:
    """Refuse an [accuracy] that contradicts other sections."""
    if scene.accuracy is None:
        return
    if scene.surface is None:
        raise ContradictionError(
            "[accuracy] needs [surface] and [contact]: the contact of a given gap cannot be solved "
            "on another grid; set flow.rtol"
        )
    if scene.accuracy.total is None:
        if scene.accuracy.max_refinement != Accuracy().max_refinement:
            raise ContradictionError(
                "accuracy.max_refinement limits the grids that accuracy.total tries; give both"
            )
        return
    if not scene.needs_flow:
        raise ContradictionError(
            "[accuracy] is about the leak rate, which output.products does not name"
        )
    if not scene.accuracy.contact_grid:
        raise ContradictionError(
            "accuracy.total counts the error of the contact's grid, and accuracy.contact_grid = "
            "false leaves it out; give one of the two"
        )
    if "rtol" in scene.flow.model_fields_set:
        raise ContradictionError("accuracy.total chooses flow.rtol itself; give one of the two")
    if scene.flow.method == "finite-difference":
        raise ContradictionError(
            "accuracy.total needs bounds, and flow.method = 'finite-difference' has none; choose "
            "adaptive or uniform"
        )


def check_rates(scene: Contents, drive: Drive) -> None:
    """Refuse units and limits that do not fit the fluid."""
    if scene.output.leak_rate_unit is not None:
        _require_kind("output.leak_rate_unit", scene.output.leak_rate_unit, drive)
    limit = scene.limit
    if limit is None:
        return
    _require_kind("limit.leak_rate", limit.leak_rate.unit, drive)
    if not 1 / MOST < limit.volume_rate(drive) < MOST:
        raise ContradictionError(
            f"limit.leak_rate = {limit.leak_rate.number:g} {limit.leak_rate.unit.name} cannot be a "
            "leak rate; check its unit"
        )
    flow = scene.flow
    if flow.method == "finite-difference":
        raise ContradictionError(
            "[limit] is decided by bounds, and flow.method = 'finite-difference' has none; choose "
            "adaptive or uniform"
        )
    if limit.decide and scene.total_error is not None:
        raise ContradictionError(
            "limit.decide and accuracy.total both say when to stop; give one of the two"
        )
    if limit.decide and not (flow.max_unknowns or flow.max_seconds or flow.max_memory):
        raise ContradictionError(
            "limit.decide needs flow.max_unknowns, flow.max_seconds or flow.max_memory, since a "
            "leak rate that equals the limit is never decided"
        )


def refuse_rates(scene: Contents) -> None:
    """Refuse a limit or a unit in a scene without a leak rate."""
    fields = {"[limit]": scene.limit, "output.leak_rate_unit": scene.output.leak_rate_unit}
    for name, value in fields.items():
        if value is not None:
            raise ContradictionError(
                f"{name} is about the leak rate, which output.products does not name"
            )


def _require_kind(field: str, unit: RateUnit, drive: Drive) -> None:
    if unit.kind in drive.rates:
        return
    raise ContradictionError(
        f"{field} in {unit.name!r} is {_IN_WORDS[unit.kind]} per time, but a liquid leaks a volume "
        "per time, such as ml/h"
    )


def check_lift(scene: Contents) -> None:
    """Refuse a lift where the fluid's pressure lifts nothing, or where its range is unknown."""
    lift, contact = scene.flow.lift, scene.contact
    if lift in (None, "none"):
        return
    setting = f"flow.lift = {lift!r}"
    if scene.shape is not None:
        raise ContradictionError(
            f"{setting} needs a contact on its own grid, and [shape] has its own mesh; leave one "
            "out"
        )
    if contact is None:
        raise ContradictionError(
            f"{setting} has nothing to lift: [gap] is given, and no solid is bent; leave it out"
        )
    if not contact.is_elastic:
        raise ContradictionError(
            f"{setting} has nothing to lift: contact.model = {contact.model!r} knows no "
            "elasticity; leave it out, or choose gfmd"
        )
    if lift == "resolved":
        return
    if contact.pressure is None:
        name = "area_fraction" if contact.mean_gap is None else "mean_gap"
        raise ContradictionError(
            f"{setting} needs contact.pressure: the two ends of the range are dry contacts under "
            f"the load that the fluid leaves to the solid, and contact.{name} prescribes no load; "
            "choose 'resolved'"
        )
    if scene.solid is not None and scene.solid.layer_thickness is not None:
        raise ContradictionError(
            f"{setting} holds for a half-space: a layer sinks at one place where it is pressed at "
            "another, so that more fluid pressure need not open the gap everywhere; choose "
            "'resolved', or leave out solid.layer_thickness"
        )


def check_ambient(scene: Contents) -> None:
    """Refuse an ambient pressure that contradicts the scene; require one below 1 bar."""
    flow = scene.flow
    if flow.ambient_pressure is not None and flow.pressure_drop is not None:
        raise ContradictionError(
            "flow.ambient_pressure goes with flow.inlet_pressure and flow.outlet_pressure; with "
            "flow.pressure_drop the outlet is at ambient pressure: leave it out"
        )
    elastic = scene.contact is not None and scene.contact.is_elastic
    if elastic and ambient_is_open(flow.outlet_pressure, flow.ambient_pressure):
        raise ContradictionError(
            f"flow.ambient_pressure is missing: flow.outlet_pressure = {flow.outlet_pressure:g} Pa "
            "is below 1 bar, and the pressure above that on the back of the solid carries part of "
            "the load; give it, such as '1 bar' or, if all is in a vacuum, the outlet's"
        )


def check_tensor(scene: Contents) -> None:
    """Refuse a conductivity tensor for which the scene lacks a fluid or the method."""
    if "conductivity_tensor" not in scene.output.products:
        return
    if scene.fluid is None:
        raise ContradictionError("[fluid] is missing: a conductivity tensor needs fluid.viscosity")
    if scene.fluid.kind == "gas" and scene.fluid.slip is not False:
        missing = [name for name in _PRESSURES if getattr(scene.flow, name) is None]
        if missing:
            raise ContradictionError(
                f"flow.{missing[0]} is missing: the conductivity tensor of a gas that slips is "
                "that at the mean of both pressures; give them, or set fluid.slip = false"
            )
    if scene.flow.method != "adaptive":
        raise ContradictionError(
            f"output.products names 'conductivity_tensor', which flow.method = "
            f"{scene.flow.method!r} does not compute; choose adaptive"
        )
