"""The compared methods: finite differences by link rule, linear, quadratic, adaptive elements."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import nan
from time import process_time

from fem_seal.errors import NotConverged, present
from fem_seal.film import GridFilm
from fem_seal.finite_difference import solve
from fem_seal.finite_difference.links import LINKS
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate

QUADRATIC = "P2 upper"
# The letter's relaxation takes 2 to 10 s on 256² samples, half a minute and more on 512².
CASCADE_UNKNOWNS = 70_000


@dataclass(frozen=True)
class Setting:
    """Fluid, drive and reading of the gap for all methods.

    Parameters
    ----------
    viscosity : float
        Viscosity η [Pa s].
    pressure_drop : float
        Pressure drop Δp [Pa].
    sides : "wall" or "periodic"
        Boundary at y = 0 and y = Ly.
    representation : "linear" or "constant"
        How the gap is read between its samples.
    rtol : float
        Largest relative width (upper - lower) / √(lower upper) of the adaptive bracket.
    """

    viscosity: float
    pressure_drop: float
    sides: str
    representation: str
    rtol: float


@dataclass(frozen=True)
class Answer:
    """One number of one method on one grid.

    Attributes
    ----------
    method : str
        Name of the method, with the bound that the number is.
    value : float
        Leak rate [m^3/s]; nan if the method did not converge.
    certified : "above", "below" or ""
        The leak rate is an upper bound, a lower bound or neither.
    unknowns : int
        Unknowns of the solve.
    seconds : float
        CPU time [s].
    """

    method: str
    value: float
    certified: str
    unknowns: int
    seconds: float


def _bounds(gap: GridField, setting: Setting, method: str) -> LeakRate:
    from fem_seal.flow import Limits, leak_rate

    # A limit of one unknown stops the uniform method on its first mesh, the grid of the gap.
    return leak_rate(
        gap,
        viscosity=setting.viscosity,
        pressure_drop=setting.pressure_drop,
        sides=setting.sides,
        representation=setting.representation,
        method=method,
        rtol=setting.rtol,
        limits=Limits(unknowns=1) if method == "uniform" else None,
    )


def _uniform(gap: GridField, setting: Setting) -> Iterator[Answer]:
    start = process_time()
    leak = _bounds(gap, setting, "uniform")
    shared = leak.unknowns, process_time() - start
    lower, upper = leak.bounds
    yield Answer("FE upper", upper, "above", *shared)
    yield Answer("FE lower", lower, "below", *shared)
    yield Answer("FE √(lo·hi)", leak.value, "", *shared)


def _quadratic(gap: GridField, setting: Setting) -> Iterator[Answer]:
    from fem_seal.flow.quadratic import quadratic_upper

    start = process_time()
    leak = quadratic_upper(
        GridFilm(gap, setting.sides, setting.representation),
        viscosity=setting.viscosity,
        pressure_drop=setting.pressure_drop,
    )
    upper = present(leak.upper, "upper bound of quadratic elements")
    yield Answer(QUADRATIC, upper, "above", leak.unknowns, process_time() - start)


def _adaptive(gap: GridField, setting: Setting) -> Iterator[Answer]:
    start = process_time()
    leak = _bounds(gap, setting, "adaptive")
    shared = leak.unknowns, process_time() - start
    lower, upper = leak.bounds
    yield Answer("adaptive upper", upper, "above", *shared)
    yield Answer("adaptive lower", lower, "below", *shared)
    yield Answer("adaptive √(lo·hi)", leak.value, "", *shared)


def _finite_differences(links: str, cascade: bool) -> Callable[..., Iterator[Answer]]:
    name = f"FD {links}{', cascade' if cascade else ''}"

    def answers(gap: GridField, setting: Setting) -> Iterator[Answer]:
        if cascade and gap.values.size > CASCADE_UNKNOWNS:
            return
        start = process_time()
        try:
            leak = solve(
                gap,
                viscosity=setting.viscosity,
                pressure_drop=setting.pressure_drop,
                sides=setting.sides,
                representation=setting.representation,
                links=links,
                cascade=cascade,
            )
        except NotConverged:
            # Near percolation the relaxation may fail: that is a row of the comparison.
            yield Answer(name, nan, "", gap.values.size, process_time() - start)
        else:
            yield Answer(name, leak.value, "", leak.unknowns, process_time() - start)

    return answers


Method = Callable[[GridField, Setting], Iterator[Answer]]
METHODS: dict[str, Method] = {
    **{links: _finite_differences(links, False) for links in LINKS},
    "cascade": _finite_differences("linear-gap", True),
    "uniform": _uniform,
    "quadratic": _quadratic,
    "adaptive": _adaptive,
}
