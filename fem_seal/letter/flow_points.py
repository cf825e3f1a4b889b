"""Points of the letter's Fig. 3: a contact and its leak rate by several methods."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import process_time

import numpy as np

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate, relative_half_width
from fem_seal.letter.surfaces import (
    CONTACT_MODULUS,
    CONTACT_TOLERANCE,
    PRESSURE_DROP,
    VISCOSITY,
    PressedSurface,
    RoughCase,
    elastic_at_area,
)
from fem_seal.memory import peak_memory
from fem_seal.parallel import alone, communicator
from fem_seal.theory.bruggeman import effective_conductivity

SIDES = "periodic"
# Link rules in increasing order of the leak rate: every link has harmonic <= linear-gap <=
# arithmetic, and no leak rate falls when a link conducts better (Rayleigh).
LINKS = ("harmonic", "linear-gap", "arithmetic")
# Number of bins of the gap distribution, and the smallest gap over the largest one. Each bin is 7 %
# wide: the leak rate of Bruggeman's medium does not depend on where gaps lie within a bin.
BINS, SMALLEST = 200, 1e-6


@dataclass(frozen=True)
class GapDistribution:
    """Distribution of the gap over the cell.

    Attributes
    ----------
    cubes : tuple[float, ...]
        Mean cubed gap of each bin [m³].
    weights : tuple[float, ...]
        Part of A0 in each bin.
    contact : float
        A/A0.
    """

    cubes: tuple[float, ...]
    weights: tuple[float, ...]
    contact: float

    @classmethod
    def of(cls, gap: GridField) -> "GapDistribution":
        """Sort the open samples into bins of equal ratio."""
        samples = gap.values[gap.values > 0]
        place = np.log(samples / samples.max()) / np.log(SMALLEST)
        bins = np.minimum((place * BINS).astype(int), BINS - 1)
        counts = np.bincount(bins, minlength=BINS)
        sums = np.bincount(bins, samples**3, minlength=BINS)
        filled = counts > 0
        return cls(
            cubes=tuple((sums[filled] / counts[filled]).tolist()),
            weights=tuple((counts[filled] / gap.values.size).tolist()),
            contact=float(np.mean(gap.values == 0)),
        )

    def leak_rate(self, dimension: float) -> float:
        """Bruggeman's leak rate of a square cell in a given dimension [m^3/s]."""
        K = effective_conductivity(
            np.array(self.cubes) / (12 * VISCOSITY),
            dimension=dimension,
            weights=np.array(self.weights),
            contact=self.contact,
            rtol=1e-10,
        )
        return float(K) * PRESSURE_DROP


@dataclass(frozen=True)
class FlowPoint:
    """A contact of one surface and its leak rates [m³/s].

    Attributes
    ----------
    case, model, seed : RoughCase
        Ensemble, contact model and surface.
    wanted : float
        Prescribed A/A0.
    rtol : float
        Tolerance of the bracket.
    area : float
        A/A0, counted in samples.
    area_corrected : float
        A/A0 less the area that pixels add along the perimeter.
    mean_gap : float
        Mean gap [m].
    mean_pressure : float or None
        Mean pressure [Pa]; None for the bearing model.
    state : "leaking" or "sealed"
        State of the contact.
    lower, upper : float
        Certified bounds.
    unknowns : int
        Unknowns of the last mesh.
    converged : bool
        Whether the bracket is as narrow as `rtol`.
    finite_difference : dict[str, float]
        Leak rates by finite differences, by link rule; empty if they were left out.
    gaps : GapDistribution
        Distribution of the gap, for Bruggeman's medium.
    contact_seconds : float
        CPU time of surface and contact [s].
    seconds : float
        CPU time of the point [s].
    peak_memory_bytes : int
        Largest memory of the process.
    """

    case: RoughCase
    model: str
    seed: int
    wanted: float
    rtol: float
    area: float
    area_corrected: float
    mean_gap: float
    mean_pressure: float | None
    state: str
    lower: float
    upper: float
    unknowns: int
    converged: bool
    finite_difference: dict[str, float]
    gaps: GapDistribution
    contact_seconds: float
    seconds: float
    peak_memory_bytes: int

    @property
    def value(self) -> float:
        """√(lower upper), the best estimate of the leak rate [m^3/s]."""
        return float(np.sqrt(self.lower * self.upper))


def flow_point(
    case: RoughCase,
    model: str,
    seed: int,
    wanted: float,
    *,
    rtol: float,
    threads: int = 1,
    differences: bool = True,
    pressed: PressedSurface | None = None,
) -> FlowPoint:
    """Press a surface to a contact area and compute its leak rates.

    Parameters
    ----------
    case, seed : the surface
    model : "bearing" or "elastic"
    wanted : prescribed A/A0; 0 is first contact
    rtol : (upper - lower) / √(lower upper) of the certified leak rate
    threads : threads of an elastic contact
    differences : whether to compute finite differences as well
    pressed : the surface and its last contacts, from which this one starts; new if left out

    Raises
    ------
    InvalidInput
        For an unknown model or an area outside [0, 1).
    NotConverged
        If the contact or the linear solver fails.
    """
    start = process_time()
    pressed = pressed or PressedSurface(case, model, seed, threads)
    state = pressed.at_area(wanted)
    contact_seconds = process_time() - start
    leak = certified(state.gap, rtol)
    lower, upper = leak.bounds
    return FlowPoint(
        case=case,
        model=model,
        seed=seed,
        wanted=wanted,
        rtol=rtol,
        area=state.contact_area_fraction,
        area_corrected=state.contact_area_corrected,
        mean_gap=state.mean_gap,
        mean_pressure=getattr(state, "mean_pressure", None),
        state=leak.state,
        lower=lower,
        upper=upper,
        unknowns=leak.unknowns,
        converged=leak.converged,
        finite_difference={
            links: _finite_difference(state.gap, links) for links in LINKS if differences
        },
        gaps=GapDistribution.of(state.gap),
        contact_seconds=contact_seconds,
        seconds=process_time() - start,
        peak_memory_bytes=peak_memory(),
    )


def certified(gap: GridField, rtol: float, field: bool = False) -> LeakRate:
    """Leak rate with bounds; the sides are periodic, as in the contact."""
    from fem_seal.flow import leak_rate

    return leak_rate(
        GridFilm(gap, sides=SIDES),
        viscosity=VISCOSITY,
        pressure_drop=PRESSURE_DROP,
        rtol=rtol,
        field=field,
        comm=communicator(alone()),
    )


def _finite_difference(gap: GridField, links: str) -> float:
    from fem_seal.finite_difference import solve

    leak = solve(
        GridFilm(gap, sides=SIDES), viscosity=VISCOSITY, pressure_drop=PRESSURE_DROP, links=links
    )
    return leak.value


@dataclass(frozen=True)
class GridPoint:
    """Leak rates under one load on finer and finer contact grids.

    Attributes
    ----------
    case, seed : RoughCase
        Ensemble and surface.
    wanted : float
        Prescribed A/A0 on the coarsest grid.
    rtol : float
        Tolerance of the brackets.
    factors : tuple[int, ...]
        Samples along a side over those of the case.
    pressure : float
        Mean pressure [Pa].
    areas, corrected : tuple[float, ...]
        A/A0 on each grid, counted in samples and corrected for the perimeter.
    lower, upper : tuple[float, ...]
        Certified bounds of the leak rate on each grid [m³/s].
    """

    case: RoughCase
    seed: int
    wanted: float
    rtol: float
    factors: tuple[int, ...]
    pressure: float
    areas: tuple[float, ...]
    corrected: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    @property
    def values(self) -> tuple[float, ...]:
        """√(lower upper) on each grid [m^3/s]."""
        return tuple(np.sqrt(np.multiply(self.lower, self.upper)).tolist())

    @property
    def flow_error(self) -> float:
        """Relative half-width of the bracket on the grid of the case."""
        return relative_half_width(self.lower[0], self.upper[0])

    @property
    def contact_grid_error(self) -> float:
        """|ln| of the ratio of leak rates on the finest and the first grid; inf if one is 0."""
        return _change(self.values[0], self.values[-1])

    @property
    def last_change(self) -> float:
        """|ln| of the ratio on the two finest grids: an estimate of the remaining error."""
        return _change(*self.values[-2:])


def _change(before: float, after: float) -> float:
    return abs(float(np.log(after / before))) if before > 0 and after > 0 else float("inf")


def grid_point(
    case: RoughCase,
    seed: int,
    wanted: float,
    *,
    rtol: float,
    factors: Sequence[int] = (1, 2),
    threads: int = 1,
) -> GridPoint:
    """Leak rates of the same surface under the same pressure on finer contact grids.

    Parameters
    ----------
    case, seed, wanted, rtol, threads : as in `flow_point`, elastic
    factors : refinements of the grid; the first is 1

    Raises
    ------
    NotConverged
        If a contact or the linear solver fails.
    """
    from fem_seal.contact import on_finer_grids

    surface = case.surface(seed)
    pressure = elastic_at_area(surface, wanted, threads).mean_pressure
    states = list(
        on_finer_grids(
            surface,
            CONTACT_MODULUS,
            pressure=pressure,
            factors=factors,
            tolerance=CONTACT_TOLERANCE,
            threads=threads,
        )
    )
    bounds = [certified(state.gap, rtol).bounds for state in states]
    return GridPoint(
        case=case,
        seed=seed,
        wanted=wanted,
        rtol=rtol,
        factors=tuple(factors),
        pressure=pressure,
        areas=tuple(state.contact_area_fraction for state in states),
        corrected=tuple(state.contact_area_corrected for state in states),
        lower=tuple(lower for lower, _ in bounds),
        upper=tuple(upper for _, upper in bounds),
    )
