"""Run under mpirun: leak rates of the gaps in a file, both methods, and what comes of meshes made
by DOLFINx, as JSON from rank 0."""

import json
import sys

import numpy as np
from dolfinx_meshes import summary
from sample_gaps import FLUID

from fem_seal.fenicsx import MPI
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, Limits, leak_rate
from fem_seal.flow.cell_tensor import conductivity_tensor
from fem_seal.grid import GridField

CASES = [
    ("uniform", "wall", "linear"),
    ("uniform", "periodic", "constant"),
    ("adaptive", "wall", "constant"),
    ("adaptive", "periodic", "linear"),
]


def solve(gaps: dict[str, np.ndarray]) -> dict[str, dict]:
    """What each gap and case gives, in numbers that JSON keeps."""
    found = {}
    for name, samples in gaps.items():
        for method, sides, representation in CASES:
            flow = leak_rate(
                GridFilm(
                    GridField(samples, (1.0, 1.0), periodic=True),
                    sides=sides,
                    representation=representation,
                ),
                FlowSettings(
                    method=method, rtol=0.2, limits=Limits(unknowns=1500), field=True, **FLUID
                ),
            )
            found[f"{name} {method} {sides} {representation}"] = {
                "bounds": [flow.lower, flow.upper],
                "flows": [flow.inflow, flow.outflow],
                "unknowns": [level.unknowns for level in flow.levels],
                "field": [len(flow.field.points), len(flow.field.cells)],
            }
        tensor = conductivity_tensor(
            GridField(samples, (1.0, 1.0), periodic=True),
            viscosity=FLUID["viscosity"],
            rtol=0.2,
            limits=Limits(unknowns=1500),
        )
        found[f"{name} tensor"] = {
            "lower": tensor.lower.tolist(),
            "upper": tensor.upper.tolist(),
        }
    return found


def main() -> None:
    """Read the gaps, solve them, and see whether every rank found the same."""
    with np.load(sys.argv[1]) as file:
        found = solve(dict(file)) | {"meshes": summary()}
    everyone = MPI.COMM_WORLD.allgather(found)
    if MPI.COMM_WORLD.rank == 0:
        alike = all(other == found for other in everyone)
        print(json.dumps({"size": MPI.COMM_WORLD.size, "alike": alike, "found": found}))


if __name__ == "__main__":
    main()
