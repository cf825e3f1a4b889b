"""The leak rate of a rough contact, and how sure we are of it.

Public names are loaded when they are first used, so that `import fem_seal` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from fem_seal.errors import FemSealError, InvalidInput, MissingPackage, NotConverged

if TYPE_CHECKING:
    from fem_seal.exchange import pictures, to_pyvista, to_xarray
    from fem_seal.gap_file import load_gap
    from fem_seal.grid import GridField
    from fem_seal.leak_rate import LeakRate
    from fem_seal.patch import Patch
    from fem_seal.results import Result
    from fem_seal.scene import Scene
    from fem_seal.solved import Solved, run, solve

__version__ = "0.2.0"

__all__ = [
    "FemSealError",
    "GridField",
    "InvalidInput",
    "LeakRate",
    "MissingPackage",
    "NotConverged",
    "Patch",
    "Result",
    "Scene",
    "Solved",
    "load_gap",
    "pictures",
    "run",
    "solve",
    "to_pyvista",
    "to_xarray",
]

_HOMES = {
    "GridField": "fem_seal.grid",
    "LeakRate": "fem_seal.leak_rate",
    "Patch": "fem_seal.patch",
    "Result": "fem_seal.results",
    "Scene": "fem_seal.scene",
    "Solved": "fem_seal.solved",
    "load_gap": "fem_seal.gap_file",
    "pictures": "fem_seal.exchange",
    "run": "fem_seal.solved",
    "solve": "fem_seal.solved",
    "to_pyvista": "fem_seal.exchange",
    "to_xarray": "fem_seal.exchange",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'fem_seal' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
