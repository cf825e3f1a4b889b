"""Pictures of a seal, drawn off screen, and the report that gathers them (`report.report`).

The names below load what they need when first used: importing this package costs nothing.
"""

from importlib import import_module

_HOME = {
    "bounds_animation": "animation",
    "bounds_plot": "bounds",
    "contact_picture": "contact",
    "flow_picture": "flow",
    "gap_picture": "gap",
    "mesh_picture": "flow",
    "pressure_picture": "flow",
    "require_gl": "offscreen",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
