"""Checks across the sections of a scene: each yields sentences, of which the first one counts."""

from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING

from fem_seal.scene.contact import LOADS
from fem_seal.scene.fluid import ambient_is_open
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.seal_checks import seal_product, whole_seal, windows
from fem_seal.scene.section import is_changed
from fem_seal.scene.sections import PRODUCTS
from fem_seal.scene.tolerance_checks import tolerances

if TYPE_CHECKING:
    from fem_seal.scene.scene import Scene

MOST = 1e100  # largest limit [m³/s]; finite in any unit
# The one value of these fields of [flow] that a shape takes, and why.
_ON_SHAPES = {
    "sides": ("wall", "has its own walls"),
    "representation": ("linear", "has a gap linear on its triangles"),
}
_IN_WORDS = {
    "throughput": "a pressure times a volume",
    "amount": "an amount",
    "mass": "a mass",
}


def check(scene: "Scene") -> None:
    """Run all checks, in the order in which a user should see the errors, and raise them."""
    messages: list[str] = []
    for each in CHECKS:
        try:
            messages += islice(each(scene), 1)
        except ContradictionError as error:  # of the pressures
            messages += error.args
    if messages:
        raise ContradictionError(*dict.fromkeys(messages))


def _shape(scene: "Scene") -> Iterator[str]:
    """A shape with what it does not have."""
    shape, flow = scene.shape, scene.flow
    if shape is None:
        return
    for field, (only, reason) in _ON_SHAPES.items():
        if getattr(flow, field) not in (None, only):
            yield (
                f"flow.{field} = {getattr(flow, field)!r} is for a gap on a grid; leave it out "
                f"with [shape], whose mesh {reason}"
            )
    if flow.method == "finite-difference":
        yield "flow.method = 'finite-difference' needs a grid; [shape] takes adaptive or uniform"
    if scene.accuracy is not None:
        yield (
            "[accuracy] refines the grid of the contact, but a [shape] reads its gap at the "
            "vertices of a mesh that stays as it is; set flow.rtol, and compare meshes by mesh_size"
        )
    available = sorted(name for name in PRODUCTS if not PRODUCTS[name].grid)
    for name in scene.output.products:
        if name not in available:
            yield (
                f"output.products names {name!r}, which needs the grid of a contact and "
                f"not a [shape]; choose from {', '.join(available)}"
            )


def _origin(scene: "Scene") -> Iterator[str]:
    """A gap that the scene defines twice, or not at all."""
    for name in ("gap", "surface", "solid", "contact"):
        if scene.own_gap and getattr(scene, name) is not None:
            yield f"[shape] gives the gap and so does [{name}]; give one of the two"
        if scene.gap is not None and name != "gap" and getattr(scene, name) is not None:
            yield f"[gap] stands in place of [{name}]; give one of the two"
    if scene.own_gap or scene.gap is not None:
        return
    if scene.surface is None:
        yield "[surface] is missing; give [surface] and [contact], or [gap]"
    if scene.contact is not None and scene.contact.is_elastic and scene.solid is None:
        yield "[solid] is missing: contact.model = 'gfmd' needs its contact_modulus"


def _load(scene: "Scene") -> Iterator[str]:
    """A contact without a load, or with a second one that [seal] gives."""
    contact, seal = scene.contact, scene.seal
    if contact is None or scene.own_gap or scene.gap is not None:
        return
    loads = [name for name in LOADS if getattr(contact, name) is not None]
    if seal is not None and seal.own_load:
        if loads:
            yield (
                f"seal.{seal.own_load} gives the load, and so does contact.{loads[0]}; leave one "
                "of them out"
            )
    elif not loads:
        yield f"contact: give exactly one of {', '.join(LOADS)}; got none"


def _accuracy(scene: "Scene") -> Iterator[str]:
    """An [accuracy] that contradicts other sections."""
    accuracy = scene.accuracy
    if accuracy is None:
        return
    if scene.surface is None:
        yield (
            "[accuracy] needs [surface] and [contact]: the contact of a given gap cannot be solved "
            "on another grid; set flow.rtol"
        )
    if accuracy.total is None:
        if is_changed(accuracy, "max_refinement"):
            yield "accuracy.max_refinement limits the grids that accuracy.total tries; give both"
        return
    if not scene.needs_leak_rate:
        yield "[accuracy] is about the leak rate, which output.products does not name"
    if not accuracy.contact_grid:
        yield (
            "accuracy.total counts the error of the contact's grid, and accuracy.contact_grid = "
            "false leaves it out; give one of the two"
        )
    if "rtol" in scene.flow.model_fields_set:
        yield "accuracy.total chooses flow.rtol itself; give one of the two"


def _finite_differences(scene: "Scene") -> Iterator[str]:
    """Finite differences, which have neither a mesh nor bounds, for what needs one of these."""
    if scene.flow.method != "finite-difference":
        return
    # A limit of time ends the stages of a lift as well, and one of memory refuses a large contact.
    limits = ["max_unknowns"]
    limits += [] if scene.lift == "resolved" else ["max_seconds"]
    limits += [] if scene.contact is not None else ["max_memory"]
    for name in limits:
        if getattr(scene.flow, name) is not None:
            yield (
                f"flow.{name} ends a refinement, and flow.method = 'finite-difference' does not "
                "refine; leave it out, or choose adaptive or uniform"
            )
    ends = "flow.method = 'finite-difference' has none; choose adaptive or uniform"
    if "mesh" in scene.output.products:
        yield f"output.products names 'mesh', but {ends}"
    if scene.seal is not None:
        yield f"[seal] needs bounds, and {ends}"
    if scene.total_error is not None:
        yield f"accuracy.total needs bounds, and {ends}"
    if scene.limit is not None:
        yield f"[limit] is decided by bounds, and {ends}"
    if scene.tolerances is not None:
        yield f"[tolerances] compares bounds, and {ends}"


def _rates(scene: "Scene") -> Iterator[str]:
    """Pressures, units and limits that do not fit the fluid or the products."""
    unit, limit, flow = scene.output.leak_rate_unit, scene.limit, scene.flow
    if scene.leak_rate_of == "nothing":
        for name, value in (("[limit]", limit), ("output.leak_rate_unit", unit)):
            if value is not None:
                yield f"{name} is about the leak rate, which output.products does not name"
        if not scene.solves_flow:
            return
    if scene.fluid is None:
        yield "[fluid] is missing: a leak rate needs fluid.viscosity"
    drive = scene.drive
    units = {
        "output.leak_rate_unit =": unit,
        "limit.leak_rate in": limit.leak_rate.unit if limit else None,
    }
    for field, given in units.items():
        if given is not None and given.kind not in drive.rates:
            yield (
                f"{field} {given.name!r} is {_IN_WORDS[given.kind]} per time, but a liquid "
                "leaks a volume per time, such as ml/h"
            )
    if limit is None:
        return
    if not 1 / MOST < limit.volume_rate(drive) < MOST:
        yield (
            f"limit.leak_rate = {limit.leak_rate.number:g} {limit.leak_rate.unit.name} cannot be a "
            "leak rate; check its unit"
        )
    if limit.decide and scene.total_error is not None:
        yield "limit.decide and accuracy.total both say when to stop; give one of the two"
    if limit.decide and not (flow.max_unknowns or flow.max_seconds or flow.max_memory):
        yield (
            "limit.decide needs flow.max_unknowns, flow.max_seconds or flow.max_memory, since a "
            "leak rate that equals the limit is never decided"
        )


def _ambient(scene: "Scene") -> Iterator[str]:
    """An ambient pressure that is missing or contradicts the scene."""
    flow, contact = scene.flow, scene.contact
    if scene.fluid is None or not scene.solves_any_flow:
        return
    if flow.ambient_pressure is not None and flow.pressure_drop is not None:
        yield (
            "flow.ambient_pressure goes with flow.inlet_pressure and flow.outlet_pressure; with "
            "flow.pressure_drop the outlet is at ambient pressure: leave it out"
        )
    elastic = contact is not None and contact.is_elastic
    if flow.ambient_pressure is not None and not elastic:
        yield (
            "flow.ambient_pressure acts on the back of an elastic solid, and the scene has none; "
            "leave it out"
        )
    if elastic and ambient_is_open(flow.outlet_pressure, flow.ambient_pressure):
        yield (
            f"flow.ambient_pressure is missing: flow.outlet_pressure = {flow.outlet_pressure:g} Pa "
            "is below 1 bar, and the pressure above that on the back of the solid carries part of "
            "the load; give it, such as '1 bar' or, if all is in a vacuum, the outlet's"
        )


def _lift(scene: "Scene") -> Iterator[str]:
    """A lift that needs what the scene has not, or that has nothing to lift."""
    flow, contact, lift = scene.flow, scene.contact, scene.flow.lift
    setting = f"flow.lift = {lift!r}"
    if scene.leak_rate_of == "nothing":
        if lift == "range":
            yield (
                f"{setting} is of the leak rate, which output.products does not name; choose "
                "'resolved', or leave it out"
            )
        if lift == "resolved" and (scene.fluid is None or not flow.is_driven):
            yield f"{setting} needs [fluid] and the pressures of [flow]; give them, or leave it out"
    if lift in (None, "none") or scene.fluid is None:
        return
    if scene.shape is not None:
        yield f"{setting} needs the grid of a contact, and [shape] has its own mesh; leave one out"
    if contact is None:
        yield f"{setting} has nothing to lift: [gap] is given, and no solid is bent; leave it out"
    elif not contact.is_elastic:
        yield (
            f"{setting} has nothing to lift: contact.model = {contact.model!r} knows no "
            "elasticity; leave it out, or choose gfmd"
        )
    elif lift == "range" and contact.pressure is None:
        name = "area_fraction" if contact.mean_gap is None else "mean_gap"
        yield (
            f"{setting} needs contact.pressure: the two ends of the range are dry contacts under "
            f"the load that the fluid leaves to the solid, and contact.{name} prescribes no load; "
            "choose 'resolved'"
        )
    if lift == "range" and scene.solid is not None and scene.solid.layer_thickness is not None:
        yield (
            f"{setting} holds for a half-space: a layer sinks at one place where it is pressed at "
            "another, so that more fluid pressure need not open the gap everywhere; choose "
            "'resolved', or leave out solid.layer_thickness"
        )


def _tensor(scene: "Scene") -> Iterator[str]:
    """A conductivity tensor for which the scene lacks a fluid or the method."""
    if "conductivity_tensor" not in scene.output.products:
        return
    fluid, flow = scene.fluid, scene.flow
    if fluid is None:
        yield "[fluid] is missing: a conductivity tensor needs fluid.viscosity"
    elif fluid.kind == "gas" and fluid.slip is not False:
        for name in ("inlet_pressure", "outlet_pressure"):
            if getattr(flow, name) is None:
                yield (
                    f"flow.{name} is missing: the conductivity tensor of a gas that slips is "
                    "that at the mean of both pressures; give them, or set fluid.slip = false"
                )
    if flow.sides == "wall":
        yield (
            "output.products names 'conductivity_tensor', which is that of a cell that repeats "
            "along both axes; flow.sides = 'wall' has none: set 'periodic', or leave it out"
        )
    if flow.method != "adaptive":
        yield (
            f"output.products names 'conductivity_tensor', which flow.method = {flow.method!r} "
            "does not compute; choose adaptive"
        )


def _sensitivity(scene: "Scene") -> Iterator[str]:
    """The product "sensitivity" of a film that is no elastic contact under a load."""
    contact = scene.contact
    elastic = contact is not None and contact.is_elastic and contact.area_fraction is None
    if "sensitivity" in scene.output.products and not elastic:
        yield (
            "output.products names 'sensitivity', which is that of an elastic contact under "
            "contact.pressure or contact.mean_gap; leave it out, or give one of these"
        )


CHECKS = (
    _shape, _origin, _load, seal_product, whole_seal, windows, _accuracy, _rates,
    _finite_differences, tolerances, _ambient, _lift, _tensor, _sensitivity,
)  # fmt: skip
