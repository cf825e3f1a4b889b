# %% [markdown]
# # Does an ordinary DOLFINx program find the leak rate between the bounds?
#
# fem_seal refines its own mesh and integrates it in batches; a reader of FEniCSx code may wonder
# what it solves. Here the same gap on the same adaptive mesh is solved as any other problem in
# DOLFINx: a mesh with facet tags, a coefficient, a form, Dirichlet conditions, PETSc.
#
# **Strong form.** The pressure p of a fluid of viscosity η in a film of height g solves
#
#     ∇·(K ∇p) = 0,  K = g³/(12 η),
#     p = Δp on the inlet, p = 0 on the outlet, K ∂p/∂n = 0 on walls and along contact (g = 0).
#
# **Weak form.** Find p with these values at inlet and outlet so that, for all q that vanish there,
#
#     reynolds(p, q, K) = ∫ K ∇p·∇q dx = 0.
#
# The leak rate is Q = energy(p, K) / Δp, energy(p, K) = ∫ K |∇p|² dx. Any other p has more energy:
# that of a finite-element p lies above Q Δp, and above fem_seal's guaranteed lower bound.
# `mpirun -n 2 python demos/ordinary_dolfinx.py` shares both solves between two processes.

# %%
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.fenicsx import PETSc, fem, functionspace, ufl
from fem_seal.film import GridFilm
from fem_seal.flow import FlowFunctions, FlowSettings, Tuning, flow_functions, leak_rate
from fem_seal.flow.forms import energy, film_conductivity, reynolds
from fem_seal.flow.linear import preconditioner
from fem_seal.grid import GridField
from fem_seal.leak_rate import FacetTag, FlowField, LeakRate
from fem_seal.render.plot import new_figure
from fem_seal.surface import Spectrum, self_affine

ETA, DROP = 1e-3, 1e5  # water [Pa s], 1 bar [Pa]


# %% [markdown]
# ## The gap and its mesh
# A self-affine surface pressed into a rubber. The samples are the vertices of the first mesh: the
# gap is linear on its triangles, and on all parts of them in refined meshes. The P1 function `gap`
# on the last mesh is therefore the gap itself, and quadrature of K = g³/(12 η) is exact.


# %%
def rough_contact(n: int) -> GridField:
    """Elastic gap of 50 µm × 50 µm on n × n samples with 20 % in contact."""
    size = 50e-6
    spectrum = Spectrum(0.8, size / 2, 8 * size / n)
    height = self_affine(spectrum, (n, n), (size, size), rms_slope=0.1, seed=4)
    return press(height, ElasticSolid(10e6), Load("area_fraction", 0.2)).gap


# %% [markdown]
# ## The ordinary problem
# `flow` holds what a DOLFINx program begins with: mesh, facet tags, gap. Viscosity is a Constant:
# a number in the form would be compiled anew for each value.


# %%
def ordinary_energy(flow: FlowFunctions, degree: int) -> float:
    """∫ K |∇p|² dx [W] of the pressure by Lagrange elements of a degree."""
    V = functionspace(flow.mesh, ("Lagrange", degree))
    p, q = ufl.TrialFunction(V), ufl.TestFunction(V)
    K = film_conductivity(flow.gap, fem.Constant(flow.mesh, ETA))
    a, L = fem.form(reynolds(p, q, K)), fem.form(fem.Constant(flow.mesh, 0.0) * q * ufl.dx)
    conditions = []
    for tag, value in ((FacetTag.INLET, DROP), (FacetTag.OUTLET, 0.0)):
        dofs = fem.locate_dofs_topological(V, 1, flow.facet_tags.find(int(tag)))
        conditions.append(fem.dirichletbc(PETSc.ScalarType(value), dofs, V))
    A = fem.petsc.assemble_matrix(a, bcs=conditions)
    A.assemble()
    b = fem.petsc.assemble_vector(L)
    fem.petsc.apply_lifting(b, [a], [conditions])
    b.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(b, conditions)
    ph = fem.Function(V)
    ph.x.array[: b.local_size] = solved(A, b)
    ph.x.scatter_forward()
    return flow.mesh.comm.allreduce(fem.assemble_scalar(fem.form(energy(ph, K))))


def solved(A: PETSc.Mat, b: PETSc.Vec) -> np.ndarray:
    """Solution of A x = b by conjugate gradients with algebraic multigrid."""
    ksp, x = PETSc.KSP().create(A.comm), A.createVecRight()
    ksp.setOperators(A)
    ksp.setType("cg")
    ksp.getPC().setType(preconditioner())
    ksp.setTolerances(rtol=1e-10)
    ksp.solve(b, x)
    assert ksp.getConvergedReason() > 0, "CG has not converged"
    return x.array_r.copy()


# %% [markdown]
# ## What to notice
# * Linear elements give the energy of fem_seal's own pressure: the same function, found twice.
#   fem_seal's upper bound is lower, since it corrects that pressure on a mesh of half the width.
# * Quadratic elements on the same mesh contain the linear ones: less energy, still above Q Δp. It
#   lies between the bounds.
# * The picture shows the tags: inlet (left), outlet (right), two walls, and contact, which the mesh
#   leaves out. Fluid passes neither walls nor contact, so that the form needs no term for them.


# %%
def draw(field: FlowField, path: Path) -> None:
    """Mesh with the pressure, and the boundary in a colour for each tag."""
    with new_figure((7, 6), path) as figure:
        axes = figure.subplots()
        x, y = 1e6 * field.points.T
        shown = axes.tripcolor(x, y, field.cells, field.pressure / 1e5, shading="gouraud")
        axes.triplot(x, y, field.cells, color="w", lw=0.15)
        ends = field.cells[:, [[1, 2], [2, 0], [0, 1]]]
        for tag, colour in zip(list(FacetTag)[1:5], ("blue", "cyan", "black", "red"), strict=True):
            lines = np.stack([x, y], axis=-1)[ends[field.facet_tags == tag]]
            style = {"colors": colour, "lw": 1.5, "label": tag.name.lower()}
            axes.add_collection(LineCollection(lines, **style))
        axes.set(xlabel="x [µm]", ylabel="y [µm]", aspect="equal")
        figure.colorbar(shown, label="pressure [bar]")
        figure.legend(loc="outside upper center", ncols=4)


def main(out: Path = Path("out"), n: int = 64) -> tuple[LeakRate, dict[int, float]]:
    """Draw `ordinary_dolfinx.png`; return bounds, and leak rates [m³/s] by degree of elements."""
    from_samples = Tuning(coarsest=n)  # begin with the mesh of the samples
    gap = rough_contact(n)
    settings = FlowSettings(viscosity=ETA, pressure_drop=DROP, rtol=0.03, field=True)
    leak = leak_rate(GridFilm(gap), settings, tuning=from_samples)
    draw(leak.field, out / "ordinary_dolfinx.png")
    flow = flow_functions(leak.field)
    ordinary = {degree: ordinary_energy(flow, degree) / DROP for degree in (1, 2)}
    # CG of fem_seal stops at a relative energy error of 1e-8; a flux has the root of that.
    assert np.isclose(ordinary[1], leak.inflow, rtol=1e-4)
    assert leak.upper < ordinary[1]
    assert leak.lower <= ordinary[2] <= leak.upper
    print(f"fem_seal, {leak.unknowns} unknowns: {leak.lower:.5e} to {leak.upper:.5e} m³/s")
    for degree, value in ordinary.items():
        print(f"DOLFINx, elements of degree {degree}: {value:.5e} m³/s")
    return leak, ordinary


if __name__ == "__main__":
    main()
