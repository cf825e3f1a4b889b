"""Leak rates, tensors and DOLFINx meshes that two ranks find as one does."""

import numpy as np
from dolfinx_meshes import summary
from sample_gaps import FLUID, rough_gap

from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, Limits, leak_rate
from fem_seal.flow.cell_tensor import conductivity_tensor
from fem_seal.grid import GridField

# Of the small ones a rank has a single cell, or no unknown.
SHAPES = {"(1, 1)": (1, 1), "(3, 1)": (3, 1)}
CASES = [
    ("uniform", "wall", "linear"),
    ("uniform", "periodic", "constant"),
    ("adaptive", "wall", "constant"),
    ("adaptive", "periodic", "linear"),
]


def found() -> dict[str, dict]:
    """What each gap and case gives, and each mesh, in numbers that JSON keeps."""
    rng, numbers = np.random.default_rng(0), {}
    gaps = {name: rng.uniform(0.5, 1, shape) for name, shape in SHAPES.items()}
    gaps["rough"] = rough_gap((16, 18), 0.25, 3).values
    for name, samples in gaps.items():
        field = GridField(samples, (1.0, 1.0), periodic=True)
        for method, sides, representation in CASES if name == "rough" else CASES[::3]:
            limits = Limits(unknowns=600)
            settings = FlowSettings(method=method, rtol=0.2, limits=limits, field=True, **FLUID)
            flow = leak_rate(GridFilm(field, sides, representation), settings)
            numbers[f"{name} {method} {sides} {representation}"] = {
                "bounds": [flow.lower, flow.upper],
                "flows": [flow.inflow, flow.outflow],
                "unknowns": [level.unknowns for level in flow.levels],
                "field": [len(flow.field.points), len(flow.field.cells)],
            }
        tensor = conductivity_tensor(
            field, viscosity=FLUID["viscosity"], rtol=0.2, limits=Limits(unknowns=600)
        )
        numbers[f"{name} tensor"] = {
            "lower": tensor.lower.tolist(),
            "upper": tensor.upper.tolist(),
        }
    return numbers | {"meshes": summary()}
