"""Pictures of a seal, drawn off screen, and the report that contains them (`report.report`).

Each function below, with PyVista or matplotlib, is imported when its name is first used.
"""

from importlib import import_module

_MODULE_OF = {
    "bounds_plot": "convergence",
    "contact_picture": "samples",
    "contact_pressure_picture": "samples",
    "flow_picture": "flow",
    "gap_picture": "samples",
    "lift_picture": "samples",
    "mesh_picture": "flow",
    "pressure_picture": "flow",
    "relief_picture": "relief",
    "require_gl": "offscreen",
    "seal_picture": "seal",
    "sensitivity_picture": "samples",
}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
