"""A gas that slips, by finite differences: the conductivity at the pressure of each node.

With w(p) = c(g_c p/B), g_c the gap of the critical constriction, and φ = ∫ w dp, the mass flux of a
gas that slips is -(M/(R T)) κ ∇φ, κ = B g² c(g p/B)/(12 η w(p)). The pressure at each node gives κ,
and the network with these κ gives the next pressure. A few such steps suffice, because κ depends
little on the pressure where most of the pressure drop is.
"""

from dataclasses import replace

import numpy as np
from scipy.sparse import csc_matrix, csr_array, diags
from scipy.sparse.linalg import spsolve

from fem_seal.errors import NotConverged, present
from fem_seal.film.grid_film import GridFilm
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.fluid import Slip
from fem_seal.grid import GridField

MOST_STEPS = 100
TOLERANCE = 1e-9  # largest change of the pressures in the last step, over the inlet's


def film_without_slip(
    film: GridFilm, slip: Slip, link_rule: str = "linear-gap"
) -> tuple[GridFilm, tuple[float, ...]]:
    """Film of another gap that conducts without slip as the given one does with slip.

    Beside it the largest change of the pressures in each step, over the inlet's.
    """
    critical = present(film.constriction, "constriction").gap
    p_out, p_in = slip.outlet_pressure, slip.inlet_pressure
    at_outlet = slip.potential(p_out, critical)
    drop = slip.potential(p_in, critical) - at_outlet
    # Scale the cubed gaps: without slip the drop of φ is the mean pressure times the difference.
    scale = slip.product * drop / (slip.mean_pressure * (p_in - p_out))
    gap, c = film.samples, slip.coefficient
    pressure = np.full(gap.shape, slip.mean_pressure)
    changes: list[float] = []
    while len(changes) < MOST_STEPS:
        weight = c(critical * pressure / slip.product)
        cubes = scale * gap**2 * c(gap * pressure / slip.product) / weight
        # Inlet and outlet of a periodic film have the same gap, but not the same pressure.
        whole = replace(film, gap=GridField(np.cbrt(cubes), film.gap.spacing))
        part = node_pressure(whole, link_rule)
        before = pressure
        pressure = slip.pressure(at_outlet + drop * np.nan_to_num(part), critical)
        changes.append(float(np.abs(pressure - before).max()) / p_in)
        if changes[-1] <= TOLERANCE:
            return whole, tuple(changes)
    raise NotConverged(
        f"the pressure of the gas by finite differences changed by {changes[-1]:.1e} of the "
        f"inlet's in step {MOST_STEPS} of the iteration for its slip; use finite elements, "
        "flow.method = 'adaptive'"
    )


def node_pressure(film: GridFilm, link_rule: str = "linear-gap") -> np.ndarray:
    """Pressure at the samples of a film, 1 at the inlet and 0 at the outlet, by the stencil.

    NaN where chains of links do not join both ends.
    """
    # The pressure does not depend on the viscosity.
    grid = flow_grid(film, 1.0, link_rule)
    pressure = grid.stencil.pressure(grid.carrying, _solved)
    if film.representation == "constant":
        pressure = pressure[1:-1]  # the ends are nodes of their own
    return film.sites.on_samples(pressure)


def _solved(matrix: csr_array, right_side: np.ndarray) -> np.ndarray:
    diagonal = matrix.diagonal()
    if diagonal.min() >= np.finfo(float).tiny:
        # Divide the rows by their diagonal: conductances differ by many decades.
        pressure = spsolve(csc_matrix(diags(1 / diagonal) @ matrix), right_side / diagonal)
        if np.isfinite(pressure).all():
            return pressure
    raise NotConverged(
        "the pressure by finite differences is beyond double precision at gaps that are almost "
        "contact: set them to 0 if they are"
    )
