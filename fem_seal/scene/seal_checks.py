"""Checks of a [seal] across the sections of a scene, for `checks`."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fem_seal.scene.scene import Scene


def seal_product(scene: "Scene") -> Iterator[str]:
    """A seal without its product or the other way round, and products that stand beside it."""
    products, seal = set(scene.output.products), scene.seal
    if seal is None:
        if "seal" in products:
            yield (
                "[seal] is missing: output.products names 'seal', which needs seal.leak_path and "
                "seal.circumference"
            )
        return
    if "seal" not in products:
        yield (
            "[seal] is given, and output.products does not name 'seal'; add it, as in products = "
            "['seal', 'contact']"
        )
    for product in sorted(products - {"seal", "contact", "pictures"}):
        yield (
            f"output.products names {product!r} beside 'seal', whose patches are solved "
            "under many loads; ask for it in a scene without [seal]"
        )


def whole_seal(scene: "Scene") -> Iterator[str]:
    """A seal whose patches cannot be computed, or whose flow is another one."""
    seal, contact = scene.seal, scene.contact
    if seal is None:
        return
    if scene.flow.sides == "wall":
        yield (
            "[seal] puts patches side by side, and walls between them (flow.sides = 'wall') would "
            "make the seal leak less; set flow.sides = 'periodic', or leave it out"
        )
    for name in ("gap", "shape", "accuracy"):
        if getattr(scene, name) is not None:
            yield (
                f"[{name}] does not go with [seal], whose patches are pressed by many loads on the "
                "grid of [surface]; leave one of the two out"
            )
    pressed = contact is not None and (contact.pressure or seal.own_load)
    if contact is not None and not (contact.is_elastic and pressed):
        yield (
            "[seal] needs contact.pressure above 0, the mean pressure that solid and fluid carry "
            "together, for an elastic contact (contact.model = 'gfmd')"
        )
    if "rtol" in scene.flow.model_fields_set:
        yield "flow.rtol is of a single patch; leave it out with [seal], and set seal.rtol"
    if scene.flow.lift not in (None, "none"):
        yield (
            f"flow.lift = {scene.flow.lift!r} is for a single patch; [seal] counts the fluid's "
            "pressure along the leak path itself: leave it out"
        )
    if scene.limit is not None and scene.limit.decide:
        yield "limit.decide stops the flow of a single patch; with [seal] set seal.rtol"


def windows(scene: "Scene") -> Iterator[str]:
    """Windows of a seal, which are parts of a measured map."""
    seal, map_ = scene.seal, scene.measured_map
    if seal is None or seal.window is None:
        return
    if map_ is None:
        yield (
            "seal.window cuts patches out of a measured map; for a random surface leave it "
            "out, and patches are seeds"
        )
    elif map_.twin_seed is not None:
        yield (
            "seal.window makes patches of parts of the map, and surface.twin_seed of its "
            "spectrum; leave one of the two out"
        )
