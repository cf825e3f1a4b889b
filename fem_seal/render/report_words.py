"""Words of a report about its scene and its pictures."""

from collections.abc import Mapping
from typing import Any

from fem_seal.results import Result
from fem_seal.scene import Scene
from fem_seal.scene.readable import rows_of_mapping

CAPTIONS = {
    "flow": "Where it leaks: flow density on a logarithmic scale.",
    "gap": "The gap; contact is grey.",
    "lift": "What the fluid's pressure does: gap without and with it, and what carries the load. "
    "Under contact and in pockets nothing determines the fluid's pressure: it is continued "
    "smoothly from the fluid around them.",
    "contact_pressure": "Pressure between the solids; white where they do not touch.",
    "contact": "Contact and open domains; the largest connected one of each is coloured.",
    "seal": "Left: contact pressure P, fluid pressure p and conductivity K along the leak path, of "
    "the patch of median leak rate; the shaded part decides the leak rate. Right: K of every patch "
    "against its net load P - p. A cross marks the load from which on a patch is sealed; it "
    "leaks in the seal all the same if that is above the highest P less the inlet's pressure.",
    "shape": "Mesh of the film before refinement, with its inlet, outlet and walls.",
    "pressure": "Pressure in the part of the gap that carries flow.",
    "relief": "The gap as a landscape, its depth exaggerated, with the flow on it.",
    "mesh": "Mesh of the last solve, and its surroundings of strongest flow.",
    "bounds": "How sure: bounds of the leak rate and half-width of their bracket against unknowns.",
}
ALL_SEALED = (
    "Left: contact pressure P along the leak path, and the fluid pressure p outside the sealed "
    "part; inside no fluid moves, and nothing determines p. Right: K of the patches that leak "
    "somewhere, or the net load P - p from which on each patch is sealed."
)
# The patch of a seal has these pictures; the seal itself has seal.png.
OF_A_PATCH = ("contact", "contact_pressure", "gap")

# Fields of a scene that say what was computed, with their names for people.
DESCRIBED = {
    "Whole seal": {
        "seal.leak_path": "leak path",
        "seal.circumference": "circumference",
        "seal.inlet_radius": "inlet radius",
        "seal.outlet_radius": "outlet radius",
    },
    "Shape": {"shape.kind": "", "shape.mesh": ""},
    "Gap": {"gap.path": ""},
    "Surface": {"surface.path": "", "surface.size": "size", "surface.rms_slope": "rms slope"},
    "Solid": {
        "solid.youngs_modulus": "Young's modulus",
        "solid.poisson_ratio": "Poisson ratio",
        "solid.contact_modulus": "contact modulus",
        "solid.layer_thickness": "layer of",
    },
    "Load": {
        "contact.pressure": "contact pressure",
        "contact.area_fraction": "contact area fraction",
        "contact.mean_gap": "mean gap",
        "seal.maximum_pressure": "highest contact pressure",
        "seal.line_load": "line load",
        "seal.pressure_profile": "profile",
    },
    "Fluid": {
        "fluid.kind": "",
        "fluid.viscosity": "viscosity",
        "flow.pressure_drop": "pressure drop",
        "flow.inlet_pressure": "inlet pressure",
        "flow.outlet_pressure": "outlet pressure",
    },
}


def described(scene: Mapping[str, Any]) -> str:
    """One line on a scene: seal or patch, solid, load and fluid, with units.

    Parameters
    ----------
    scene : section: {field: value}, in SI units, as `Scene.to_mapping` returns
    """
    texts = dict(rows_of_mapping(scene, Scene))
    parts = ["Patch"] if "surface" in scene and "seal" not in scene else []
    for head, fields in DESCRIBED.items():
        words = [
            f"{label} {texts[name]}".strip() for name, label in fields.items() if name in texts
        ]
        if words:
            parts.append(f"{head}: {', '.join(words)}")
    return ". ".join(parts) + "."


def caption(name: str, result: Result) -> str:
    """Caption of a picture, by its name without suffix; other pictures have their name."""
    text = CAPTIONS.get(name, name)
    if name == "seal" and result.state == "lifted off":
        return (
            "Contact pressure along the leak path, and the fluid's pressure at the inlet above it."
        )
    if name == "seal" and result.state == "sealed":
        return ALL_SEALED
    if result.seal is not None and name in OF_A_PATCH:
        text = f"The first patch, dry and under the whole load, not the seal. {text}"
    if name == "lift" and result.state == "sealed":
        text += (
            " Of a patch that is sealed only the pressures next to inlet and outlet are known, and "
            "that no pressure up to the inlet's opens it."
        )
    return text
