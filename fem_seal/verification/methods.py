"""Methods to compare: finite differences by link rule, linear elements, adaptive ones."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from time import process_time

from fem_seal.errors import NotConverged
from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.finite_difference.links import LINKS
from fem_seal.flow_settings import NO_LIMITS, FlowSettings
from fem_seal.limits import Limits

# Most samples for the letter's relaxation: it takes 2 to 10 s on 256², half a minute or more on
# 512².
CASCADE_UNKNOWNS = 70_000


@dataclass(frozen=True)
class Answer:
    """One number of one method on one grid."""

    __pydantic_config__ = {"ser_json_inf_nan": "constants"}  # noqa: RUF012 (pydantic reads it)

    method: str  #: name of the method, with "upper" or "lower" for a bound
    value: float  #: leak rate [m^3/s]; nan if the method did not converge
    #: "above", "below" or "", whether the number is an upper bound, a lower bound or neither
    certified: str
    unknowns: int  #: unknowns of the solve
    seconds: float  #: CPU time [s]


def _bounds(
    film: GridFilm, settings: FlowSettings, method: str, name: str, limits: Limits = NO_LIMITS
) -> Iterator[Answer]:
    from fem_seal.flow import leak_rate

    start = process_time()
    leak = leak_rate(film, replace(settings, method=method, limits=limits))
    shared = leak.unknowns, process_time() - start
    lower, upper = leak.bounds
    yield Answer(f"{name} upper", upper, "above", *shared)
    yield Answer(f"{name} lower", lower, "below", *shared)
    yield Answer(f"{name} √(lo·hi)", leak.value, "", *shared)


def _finite_differences(
    film: GridFilm, settings: FlowSettings, links: str, cascade: bool = False
) -> Iterator[Answer]:
    name = "FD cascade" if cascade else f"FD {links}"
    samples = film.gap.values.size
    if cascade and samples > CASCADE_UNKNOWNS:
        return
    start = process_time()
    try:
        leak = by_differences(
            film,
            viscosity=settings.viscosity,
            pressure_drop=settings.pressure_drop,
            links=links,
            cascade=cascade,
        )
    except NotConverged:
        # Near percolation the relaxation may fail; the comparison shows that.
        yield Answer(name, nan, "", samples, process_time() - start)
    else:
        yield Answer(name, leak.value, "", leak.unknowns, process_time() - start)


Method = Callable[[GridFilm, FlowSettings], Iterator[Answer]]
METHODS: dict[str, Method] = {
    **{links: partial(_finite_differences, links=links) for links in LINKS},
    "cascade": partial(_finite_differences, links="linear-gap", cascade=True),
    # A limit of one unknown stops the uniform method on its first mesh, the grid of the gap.
    "uniform": partial(_bounds, method="uniform", name="FE", limits=Limits(unknowns=1)),
    "adaptive": partial(_bounds, method="adaptive", name="adaptive"),
}
