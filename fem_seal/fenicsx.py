"""One interface to DOLFINx 0.5 to 0.11; no other module of fem_seal asks for the version.

Import this module before anything else that imports dolfinx. DOLFINx 0.5 to 0.7 switch the dynamic
linker to global symbols when imported and do not reset it: the VTK wheel of PyVista would crash
later. This module disables the switch during the import; DOLFINx does not need it.
"""

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from fem_seal.errors import MissingPackage
from fem_seal.files import use_writable_cache


@contextmanager
def _quietly() -> Iterator[None]:
    """Set environment and arguments for the start of DOLFINx, PETSc and MPI, then restore them."""
    set_flags, arguments, environment = sys.setdlopenflags, sys.argv, dict(os.environ)
    sys.setdlopenflags = lambda flags: None
    # DOLFINx looks for options of its own among the arguments, and accepts only UTF-8.
    sys.argv = arguments[:1]
    # PETSc's handlers would turn a closed pipe (fem-seal run ... | head) into a crash report.
    options = os.environ.get("PETSC_OPTIONS", "")
    os.environ["PETSC_OPTIONS"] = f"{options} -no_signal_handler".strip()
    # A single process of Open MPI 4 otherwise starts a server that needs a network interface.
    os.environ.setdefault("OMPI_MCA_ess_singleton_isolated", "1")
    try:
        yield
    finally:
        sys.setdlopenflags, sys.argv = set_flags, arguments
        for name in ("PETSC_OPTIONS", "OMPI_MCA_ess_singleton_isolated"):
            os.environ.pop(name)
            if name in environment:
                os.environ[name] = environment[name]


def _require_real_petsc() -> None:
    """Raise MissingPackage unless DOLFINx was built with PETSc, and PETSc for real numbers."""
    needed = "fem_seal needs a DOLFINx with petsc4py, for real numbers"
    # Before DOLFINx 0.9 there is no such flag: its Python interface always had PETSc.
    if not getattr(dolfinx, "has_petsc4py", True):
        raise MissingPackage(f"this DOLFINx has no PETSc; {needed}")
    if np.dtype(PETSc.ScalarType).kind == "c":
        raise MissingPackage(f"this PETSc computes with complex numbers; {needed}")


use_writable_cache()
with _quietly():
    # MPI comes first: PyPI's third-party wheel of DOLFINx takes it from mpi4py.
    from mpi4py import MPI

    try:
        import dolfinx
        from petsc4py import PETSc
    except ModuleNotFoundError as error:
        if error.name != "petsc4py":
            raise
        raise MissingPackage("this DOLFINx has no PETSc: petsc4py is not installed") from None

_require_real_petsc()

import dolfinx.fem.petsc  # noqa: E402
import ufl  # noqa: E402
from dolfinx import fem, mesh  # noqa: E402

from fem_seal.memory import give_back_freed_memory  # noqa: E402

VERSION = tuple(int(i) for i in dolfinx.__version__.split(".")[:2])

HAS_HYPRE = PETSc.Sys.hasExternalPackage("hypre")

give_back_freed_memory()

if VERSION < (0, 7):
    # Do not print the command lines of the compiler for each form that is compiled.
    logging.root.addFilter(lambda record: record.levelno >= logging.WARNING)

# Another process may be compiling the same form; the default of 10 s is short on a busy machine.
_defaults = getattr(dolfinx.jit, "DOLFINX_DEFAULT_JIT_OPTIONS", None)  # renamed in 0.6
_defaults = _defaults or dolfinx.jit.DOLFINX_DEFAULT_JIT_PARAMETERS
_defaults["timeout"] = (60, "seconds to wait for a form that another process compiles")

MeshTags = getattr(mesh, "MeshTags", None) or mesh.MeshTagsMetaClass  # renamed before 0.7
functionspace = getattr(fem, "functionspace", None) or fem.FunctionSpace  # renamed in 0.7


@contextmanager
def explained_compilation() -> Iterator[None]:
    """Turn a failure to compile a form into a MissingPackage of one sentence; also a decorator.

    DOLFINx compiles each form once and keeps it in a cache: without a compiler it fails at the
    first form that is not in the cache.
    """
    from cffi import VerificationError

    try:
        yield
    except (VerificationError, RuntimeError, TimeoutError) as error:
        if "JIT compilation timed out" in str(error):
            # The message names the file left by a process that was killed while it compiled.
            words = " ".join(str(error).split())
            raise MissingPackage(f"FEniCSx has no form: {words}") from None
        # With several processes DOLFINx raises a RuntimeError that begins with these words.
        together = str(error).startswith("Failed just-in-time compilation")
        if not (together or isinstance(error, VerificationError)):
            raise
        raise MissingPackage(
            f"FEniCSx could not compile a form ({str(error).splitlines()[0]}); it needs a C "
            "compiler and Python's headers (on Debian: apt-get install gcc python3-dev; an "
            "environment variable CC must name a compiler)"
        ) from None


def vector_functionspace(msh: mesh.Mesh, element: tuple[str, int]) -> fem.FunctionSpace:
    """Space of functions with two components, each of an element such as ("DG", 0)."""
    if VERSION >= (0, 7):
        return functionspace(msh, (*element, (2,)))
    return fem.VectorFunctionSpace(msh, element)


def _coordinate_domain() -> ufl.Mesh:
    if VERSION >= (0, 7):
        import basix.ufl

        return ufl.Mesh(basix.ufl.element("Lagrange", "triangle", 1, shape=(2,)))
    return ufl.Mesh(ufl.VectorElement("Lagrange", ufl.Cell("triangle", 2), 1))


def _all_on_one_process(
    comm: MPI.Comm, parts: int, dim: int, graph: Any, ghost_mode: mesh.GhostMode
) -> Any:
    """Assign all cells to one process: a graph partitioner takes a quarter of the mesh time."""
    from dolfinx.cpp.graph import AdjacencyList_int32

    return AdjacencyList_int32(np.zeros((graph.num_nodes, 1), dtype=np.int32))


def create_triangle_mesh(comm: MPI.Comm, points: np.ndarray, cells: np.ndarray) -> mesh.Mesh:
    """DOLFINx mesh, distributed over the processes, of triangles that every process has in full.

    It has no ghost cells, because no form of fem_seal integrates over interior facets. Points are
    (V, 2) [m], cells (C, 3) int.
    """
    share, own = (np.array_split(rows, comm.size)[comm.rank] for rows in (cells, points))
    connectivity = np.ascontiguousarray(share, dtype=np.int64)
    x = np.ascontiguousarray(own, dtype=np.float64)
    domain = _coordinate_domain()
    none = mesh.GhostMode.none
    if VERSION < (0, 7):
        from dolfinx.cpp.graph import AdjacencyList_int64

        graph = AdjacencyList_int64(connectivity)
        if comm.size == 1:
            return mesh.create_mesh(comm, graph, x, domain, none, _all_on_one_process)
        return mesh.create_mesh(comm, graph, x, domain, ghost_mode=none)
    if VERSION < (0, 10):
        partitioner = mesh.create_cell_partitioner(none)
        return mesh.create_mesh(comm, connectivity, x, domain, partitioner)
    partitioner = mesh.create_cell_partitioner(none, 2)
    return mesh.create_mesh(comm, connectivity, domain, x, partitioner)


def _nodes(msh: mesh.Mesh) -> Any:
    """Nodes of each cell: an array, or an adjacency list before DOLFINx 0.7."""
    return msh.geometry.dofmaps[0] if VERSION >= (0, 11) else msh.geometry.dofmap


def geometry_dofs(msh: mesh.Mesh) -> np.ndarray:
    """For each cell of this rank the rows (c, 3) of its vertices in `msh.geometry.x`."""
    nodes = _nodes(msh)
    return nodes if isinstance(nodes, np.ndarray) else nodes.array.reshape(-1, 3)


def input_cells(msh: mesh.Mesh) -> np.ndarray:
    """For each cell of this rank its row in the argument `cells` of `create_triangle_mesh`."""
    return np.asarray(msh.topology.original_cell_index, dtype=np.int64)


def cell_vertices(msh: mesh.Mesh) -> np.ndarray:
    """For each cell of this rank its vertices (c, 3), as rows of the argument `points`."""
    return np.asarray(msh.geometry.input_global_indices, dtype=np.int64)[geometry_dofs(msh)]


def cell_facets(msh: mesh.Mesh) -> np.ndarray:
    """For each cell of this rank, ghosts included, the facets (c, 3) opposite its corners."""
    for dimensions in ((2, 1), (1, 2), (1, 0)):  # later versions create none of their own accord
        msh.topology.create_connectivity(*dimensions)
    return msh.topology.connectivity(2, 1).array.reshape(-1, 3)


def is_linear(function: fem.Function) -> bool:
    """Whether a function is scalar, continuous and linear (P1) on straight triangles.

    All ranks must call this together.
    """
    msh, dofmap = function.function_space.mesh, function.function_space.dofmap
    nodes = _nodes(msh)
    own = nodes.shape[1] if isinstance(nodes, np.ndarray) else np.diff(nodes.offsets).max(initial=0)
    return (
        msh.topology.cell_type == mesh.CellType.triangle
        and msh.comm.allreduce(int(own), MPI.MAX) == 3
        and (dofmap.index_map_bs, dofmap.dof_layout.num_dofs) == (1, 3)
        and dofmap.index_map.size_global == msh.topology.index_map(0).size_global
    )


def cell_dofs(space: fem.FunctionSpace, per_cell: int) -> np.ndarray:
    """(c, per_cell) int, degrees of freedom of each cell of this rank."""
    dofs = space.dofmap.list
    dofs = dofs if isinstance(dofs, np.ndarray) else dofs.array
    return dofs.reshape(-1, per_cell)
