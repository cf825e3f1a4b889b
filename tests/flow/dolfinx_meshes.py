"""DOLFINx meshes with facet tags and a gap, as a user of FEniCSx would make them."""

from collections.abc import Callable

import numpy as np
from project import leak_rate
from sample_gaps import FLUID, rough_gap
from triangulations import ring_parts, scattered_square

from fem_seal.fenicsx import MPI, cell_facets, create_triangle_mesh, fem, functionspace, mesh, ufl
from fem_seal.film import GridFilm
from fem_seal.flow import Limits, film_from_dolfinx, flow_functions
from fem_seal.leak_rate import FacetTag

COARSE = {"method": "uniform", "limits": Limits(unknowns=1), "rtol": 1e-9}


def function(msh, formula: Callable, degree: int = 1, family: str = "Lagrange") -> fem.Function:
    """A function that interpolates a formula of x (3, n)."""
    out = fem.Function(functionspace(msh, (family, degree)))
    out.interpolate(formula)
    return out


def tagged(msh, *parts: tuple[int, Callable]):
    """Tags of the boundary edges at which a condition on x (3, n) holds; the last one wins."""
    tags: dict[int, int] = {}
    cell_facets(msh)
    for number, holds in parts:
        tags |= dict.fromkeys(mesh.locate_entities_boundary(msh, 1, holds).tolist(), number)
    edges = np.array(sorted(tags), dtype=np.int32)
    return mesh.meshtags(msh, 1, edges, np.array([tags[e] for e in sorted(tags)], dtype=np.int32))


def everywhere(x: np.ndarray) -> np.ndarray:
    return np.full(x.shape[1], True)


def ends(length: float, inlet: int = 1, outlet: int = 2, wall: int = 3):
    """Inlet at x = 0, outlet at x = length, all else wall."""
    return (
        (wall, everywhere),
        (inlet, lambda x: np.isclose(x[0], 0)),
        (outlet, lambda x: np.isclose(x[0], length)),
    )


def rectangle(n: tuple[int, int] = (12, 8), comm=MPI.COMM_WORLD):
    """2 × 1, by DOLFINx."""
    msh = mesh.create_rectangle(comm, [[0.0, 0.0], [2.0, 1.0]], list(n))
    return msh, tagged(msh, *ends(2.0))


def unstructured(comm=MPI.COMM_WORLD):
    """Unit square, Delaunay triangles of random points, some of them clockwise."""
    square = scattered_square(80, 4)
    cells = square.cells.copy()
    cells[::3] = cells[::3, ::-1]
    msh = create_triangle_mesh(comm, square.xy, cells)
    return msh, tagged(msh, *ends(1.0))


def ring(comm=MPI.COMM_WORLD):
    """Inlet all of the inner circle; outlet the outer one, but for a wall of a single edge."""
    xy, cells, _ = ring_parts(3, 12, 1.0, 2.0)
    msh = create_triangle_mesh(comm, xy, cells)
    return msh, tagged(
        msh,
        (1, everywhere),
        (2, lambda x: np.hypot(x[0], x[1]) > 1.5),
        (3, lambda x: (np.hypot(x[0], x[1]) > 1.5) & (x[0] > 1.7) & (x[1] > -1e-9)),
    )


MESHES = {"rectangle": rectangle, "unstructured": unstructured, "ring": ring}


def slanted(x: np.ndarray) -> np.ndarray:
    """A gap that is linear in the plane."""
    return 2.5 + 0.4 * x[0] - 0.3 * x[1]


def lengths(functions) -> list[float]:
    """Length of the boundary with each tag, from INLET on."""
    ds = ufl.Measure("ds", functions.mesh, subdomain_data=functions.facet_tags)
    one = fem.Constant(functions.mesh, 1.0)
    parts = [fem.assemble_scalar(fem.form(one * ds(int(tag)))) for tag in list(FacetTag)[1:]]
    return functions.mesh.comm.allreduce(np.array(parts)).tolist()


def summary() -> dict:
    """What must not depend on how many processes share the work."""
    answer: dict[str, object] = {}
    for name, make in MESHES.items():
        msh, tags = make()
        film = film_from_dolfinx(msh, tags, function(msh, slanted))
        arrays = film.mesh.xy, film.mesh.cells, film.mesh.sides, film.mesh.twin
        flow = leak_rate(film, **COARSE, **FLUID)
        answer[name] = {
            "mesh": [array.tolist() for array in arrays],
            "gap": film.values.tolist(),
            "bounds": [flow.lower, flow.upper],
        }
    for sides in ("wall", "periodic"):
        flow = leak_rate(
            GridFilm(rough_gap((16, 12), 0.3, 5), sides=sides), field=True, **COARSE, **FLUID
        )
        answer[sides] = lengths(flow_functions(flow.field))
    return answer
