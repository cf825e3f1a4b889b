"""The flow handed to DOLFINx: its integrals, from forms written out as in a textbook."""

import numpy as np
import pytest
from sample_gaps import rough_gap

from fem_seal.fenicsx import MPI, fem, ufl, vector_functionspace
from fem_seal.flow import Limits, flow_functions, leak_rate
from fem_seal.grid import GridField

WATER = {"viscosity": 1e-3, "pressure_drop": 1e5}


def integral(form) -> float:
    return MPI.COMM_WORLD.allreduce(fem.assemble_scalar(fem.form(form)))


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("contact", [0.0, 0.3])
def test_integrals_of_the_functions(sides, contact):
    """On pixels a linear gap is a linear function of the mesh, and quadrature of order 3 is exact
    for its cube: Reynolds' dissipation ∫ g³/(12 η) |∇p|² is Q Δp, and the flux carries Q to the
    outlet. CG balances inflow and outflow to 1e-4, and both are within its root of 2e-8."""
    rough = rough_gap((16, 12), contact, 5)
    gap = GridField(rough.values * 1e-6, (2e-6, 1e-6), periodic=True)
    only = {"method": "uniform", "limits": Limits(unknowns=1), "rtol": 1e-9}
    flow = leak_rate(gap, sides=sides, field=True, **only, **WATER)
    found = flow_functions(flow.field)
    dx = ufl.Measure("dx", found.mesh, metadata={"quadrature_degree": 3})
    conductivity = found.gap**3 / (12 * WATER["viscosity"])
    slope = ufl.grad(found.pressure)
    dissipated = integral(conductivity * ufl.inner(slope, slope) * dx)
    power = flow.inflow * WATER["pressure_drop"]
    assert dissipated == pytest.approx(power, rel=3e-4, abs=0)
    assert integral(found.flux[0] * dx) / gap.size[0] == pytest.approx(flow.inflow, rel=3e-4, abs=0)
    # Darcy's law, cell by cell: what is left is rounding.
    defect = found.flux + conductivity * slope
    means = ufl.TestFunction(vector_functionspace(found.mesh, ("DG", 0)))
    left = fem.petsc.assemble_vector(fem.form(ufl.inner(defect, means) * dx))
    total = np.sqrt(integral(ufl.inner(found.flux, found.flux) * dx))
    assert np.abs(left.array).max() < 1e-12 * total
    left.destroy()


def test_pressure_is_parted_along_contact():
    """A line of contact along the flow: two meshes side by side that share no point, each with a
    pressure of its own, and the gap and the pressure as the flow has them at its points."""
    values = np.full((9, 9), 1e-6)
    values[:, 4], values[4, :4] = 0, 5e-7
    flow = leak_rate(GridField(values, (1e-6, 1e-6)), field=True, rtol=0.2, **WATER)
    found = flow_functions(flow.field)
    assert found.pressure.x.array.max() == WATER["pressure_drop"]
    assert found.pressure.x.array.min() == 0
    assert found.gap.x.array.size == len(flow.field.points)
    assert np.sort(found.gap.x.array) == pytest.approx(np.sort(flow.field.gap), rel=0, abs=0)
    area = integral(fem.Constant(found.mesh, 1.0) * ufl.dx)
    assert area == pytest.approx(64e-12, rel=1e-12, abs=0)
