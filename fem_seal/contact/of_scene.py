"""The solid of a scene as the contact knows it."""

from typing import TYPE_CHECKING

from fem_seal.contact.halfspace import Layer

if TYPE_CHECKING:
    from fem_seal.scene import Solid


def layer_of(solid: "Solid") -> Layer | None:
    """Layer of a scene's solid; None for a half-space."""
    if solid.layer_thickness is None:
        return None
    return Layer(solid.layer_thickness, solid.layer_base, solid.layer_poisson_ratio)
