"""Scene: what a scene file says, checked, frozen and in SI units."""

from fem_seal.scene.accuracy import Accuracy
from fem_seal.scene.scene import Scene
from fem_seal.scene.sections import (
    Contact,
    FileSurface,
    Flow,
    Fluid,
    Gap,
    Output,
    SelfAffineSurface,
    Solid,
)

__all__ = [
    "Accuracy",
    "Contact",
    "FileSurface",
    "Flow",
    "Fluid",
    "Gap",
    "Output",
    "Scene",
    "SelfAffineSurface",
    "Solid",
]
