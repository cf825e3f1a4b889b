"""The leak rate of a rough contact, and how sure we are of it.

    import fem_seal as fs

    scene = fs.Scene.from_file("seal.toml")  # or of the sections below: fs.Scene(surface=…, …)
    solved = fs.solve(scene)  # fs.run(scene, folder) saves the answer as well

Names are loaded when they are first used, so that `import fem_seal` costs nothing.
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from fem_seal.errors import FemSealError, Inconsistent, InvalidInput, MissingPackage, NotConverged

if TYPE_CHECKING:
    from fem_seal.exchange import pictures, to_pyvista, to_xarray
    from fem_seal.gap_file import load_gap
    from fem_seal.grid import GridField
    from fem_seal.leak_rate import LeakRate
    from fem_seal.patch import Patch
    from fem_seal.results import Result
    from fem_seal.scene import (
        Accuracy,
        Contact,
        FileSurface,
        Flow,
        Fluid,
        Gap,
        Heights,
        Limit,
        Output,
        ProfileSurface,
        Scene,
        Seal,
        SelfAffine,
        Solid,
        Tolerances,
    )
    from fem_seal.scene.shape import FaceSeal, MeshFile, PlateWithHoles, Rectangle, Sector, Strip
    from fem_seal.solved import Solved, run, solve

__version__ = "0.3.0.dev0"

# Public names, by the module that they are loaded from.
_NAMES = {
    "fem_seal.scene": (
        "Scene", "SelfAffine", "Heights", "FileSurface", "ProfileSurface", "Solid", "Contact",
        "Gap", "Fluid", "Flow", "Seal", "Accuracy", "Limit", "Output", "Tolerances",
    ),
    "fem_seal.scene.shape": (
        "FaceSeal", "MeshFile", "PlateWithHoles", "Rectangle", "Sector", "Strip",
    ),
    "fem_seal.solved": ("Solved", "run", "solve"),
    "fem_seal.patch": ("Patch",),
    "fem_seal.results": ("Result",),
    "fem_seal.exchange": ("pictures", "to_pyvista", "to_xarray"),
    "fem_seal.gap_file": ("load_gap",),
    "fem_seal.grid": ("GridField",),
    "fem_seal.leak_rate": ("LeakRate",),
}  # fmt: skip
_HOMES = {name: home for home, names in _NAMES.items() for name in names}
_ERRORS = ("FemSealError", "Inconsistent", "InvalidInput", "MissingPackage", "NotConverged")
# The library: contact, film, mesh and flow without a scene, and all other packages.
_PACKAGES = tuple(module.name for module in iter_modules(__path__) if module.ispkg)

__all__ = sorted([*_HOMES, *_ERRORS])


def __getattr__(name: str) -> object:
    if name in _PACKAGES:
        return import_module(f"fem_seal.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module 'fem_seal' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, *_PACKAGES, "__version__"]
