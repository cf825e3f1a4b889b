"""The effective conductivity tensor of a periodic cell, refined until its bounds agree."""

from collections.abc import Callable

import numpy as np

from fem_seal import parallel
from fem_seal.arguments import require_positive
from fem_seal.fenicsx import explained_compilation
from fem_seal.film.law import CUBE, leak_rate_of_square, mean_pressure_law
from fem_seal.film.winding import periodic_sites, widest_both_ways, widest_winding
from fem_seal.flow.adapt import refined
from fem_seal.flow.bounds import TensorBounds, widest
from fem_seal.flow.gap_on_mesh import REPRESENTATIONS
from fem_seal.flow.leak import require_conducting
from fem_seal.flow.marking import Strategy, Tuning, mark
from fem_seal.flow.solution import Start
from fem_seal.flow.stopping import Stopping, Tolerance
from fem_seal.fluid import Slip
from fem_seal.grid import GridField
from fem_seal.limits import USUAL_GROWTH, Limits
from fem_seal.mesh.nested import coarsest_width
from fem_seal.mesh.torus import uniform_torus

# Smallest part of the largest conductivity that can be resolved. The pressure is prescribed
# nowhere, so its rounding errors in open regions hide smaller conductivities.
LEAST_CONDUCTIVITY = 1e-15
TIGHTEST = "the tightest place on the widest way around the cell"


@explained_compilation()
def conductivity_tensor(
    gap: GridField,
    *,
    viscosity: float,
    slip: Slip | None = None,
    representation: str = "linear",
    rtol: float = 0.05,
    limits: Limits | None = None,
    progress: Callable[[int, float], None] | None = None,
    tuning: Tuning | None = None,
    comm: parallel.Comm = None,
) -> TensorBounds:
    """Effective conductivity tensor K* of a gap that is periodic in both directions.

    The mean flux under a mean pressure gradient is -K*·gradient, K* in m³/(Pa s); a smooth channel
    of height h has h³/(12 η). With slip K* is taken at the mean of the two pressures, since the
    pressure changes little across one cell: to first order (h³ + B h²/p)/(12 η). The bounds are
    those of `level`, for the gap as represented: zero matrices if nothing winds around the
    cell.

    Parameters
    ----------
    gap
        Gap in metres, zero in contact, periodic.
    viscosity
        η [Pa s].
    slip
        Of a gas at the walls, at the mean of the two pressures.
    representation
        "linear" or "constant".
    rtol
        Stop when upper - lower <= rtol √(lower upper) in every direction.
    limits
        Limits on unknowns, time and memory; if one is reached, the refinement stops earlier.
    progress
        Called with unknowns and relative width of each mesh.
    tuning
        Parameters that change the cost of the bounds, never their validity.
    comm
        All its ranks must call this together, with the same gap; all of this run if left out.

    Raises
    ------
    InvalidInput
        If the gap is not periodic, or the tightest place on the widest way around the cell is so
        narrow a part of the largest gap that its cube leaves double precision.
    """
    require_positive(viscosity=viscosity, rtol=rtol)
    sites = periodic_sites(gap, representation)
    limits, tuning = limits or Limits(), tuning or Tuning()
    windings = [widest_winding(gap, representation, axis) for axis in (0, 1)]
    windings.append(widest_both_ways(gap, representation))
    if not any(windings):
        return TensorBounds(np.zeros((2, 2)), np.zeros((2, 2)))
    largest_gap = float(sites.max())
    per_pascal = leak_rate_of_square(largest_gap, viscosity, pressure_drop=1.0)
    law = CUBE
    if slip is not None:
        law = mean_pressure_law(slip, largest_gap)
        per_pascal *= slip.gain(largest_gap)
    scaled = GridField(sites / largest_gap, gap.spacing, periodic=True)
    narrowest = min(h for h in windings if h > 0) / largest_gap
    require_conducting(TIGHTEST, narrowest)
    width = coarsest_width((sites.shape[0], sites.shape[1]), tuning.coarsest)
    represented = REPRESENTATIONS[representation](
        scaled, tuning.cut * narrowest, tuning.floor * narrowest, width, law=law
    )
    comm = parallel.communicator(comm)
    stopping = Stopping(Tolerance(rtol), limits, USUAL_GROWTH, narrowest, comm)
    strategy = Strategy(mark, rtol, every_dual=stopping.doubtful, tuning=tuning)
    start = Start.first(represented, uniform_torus(represented.pixels, width))
    for solution in refined(represented, start, strategy, stopping):
        last = solution.level
        del solution  # its mesh is freed before the next one is made
        if progress is not None:
            progress(last.unknowns, last.bounds.width)
    Lx, Ly = scaled.size
    # From fluxes per jump to mean flux per gradient: D A* D/(Lx Ly), D = diag(Lx, Ly).
    scale = per_pascal * np.array([[Lx / Ly, 1.0], [1.0, Ly / Lx]])
    lower, upper, reason = last.bounds.lower * scale, last.bounds.upper * scale, stopping.reason
    if reason:
        reason = f"{reason}; {_widest_direction(lower, upper, rtol)}{_rounding_doubt(narrowest)}"
    return TensorBounds(lower, upper, unknowns=last.unknowns, reason=reason)


def _widest_direction(lower: np.ndarray, upper: np.ndarray, rtol: float) -> str:
    """Message on the distance of the bounds from the tolerance, and the direction."""
    width, (x, y) = widest(lower, upper)
    along = (x, y) @ upper @ (x, y) / np.linalg.eigvalsh(upper)[-1]
    reached = f"known to {width:.2g}" if np.isfinite(width) else "without a lower bound"
    return (
        f"the tensor is {reached} along {np.degrees(np.arctan2(y, x)) % 180:.3g} degrees, where it "
        f"is {along:.2g} of its largest; rtol = {rtol:.2g} was asked for"
    )


def _rounding_doubt(narrowest: float) -> str:
    """Message if the constriction's gap (over the largest) is too small for double precision."""
    if narrowest**3 >= LEAST_CONDUCTIVITY:
        return ""
    return (
        f" ({TIGHTEST} conducts {narrowest**3:.0e} of the largest gap; double precision holds "
        f"{LEAST_CONDUCTIVITY:.0e}: set gaps to 0 where they are contact)"
    )
