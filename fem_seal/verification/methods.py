"""Methods to compare: finite differences by link rule, linear elements, adaptive ones."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from time import process_time

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.finite_difference.links import LINKS
from fem_seal.flow_settings import FlowSettings


@dataclass(frozen=True)
class Answer:
    """One number of one method on one grid."""

    method: str  #: name of the method, with "upper" or "lower" for a bound
    value: float  #: leak rate [m^3/s]
    #: "above", "below" or "", whether the number is an upper bound, a lower bound or neither
    certified: str
    unknowns: int  #: unknowns of the solve
    seconds: float  #: CPU time [s]


def _bounds(
    film: GridFilm, settings: FlowSettings, method: str, name: str, unknowns: int | None = None
) -> Iterator[Answer]:
    from fem_seal.flow import leak_rate

    limits = replace(settings.limits, unknowns=unknowns or settings.limits.unknowns)
    start = process_time()
    leak = leak_rate(film, replace(settings, method=method, limits=limits))
    shared = leak.unknowns, process_time() - start
    lower, upper = leak.bounds
    yield Answer(f"{name} upper", upper, "above", *shared)
    yield Answer(f"{name} lower", lower, "below", *shared)
    yield Answer(f"{name} √(lo·hi)", leak.value, "", *shared)


def _finite_differences(film: GridFilm, settings: FlowSettings, links: str) -> Iterator[Answer]:
    start = process_time()
    leak = by_differences(film, replace(settings, links=links))
    yield Answer(f"FD {links}", leak.value, "", leak.unknowns, process_time() - start)


FilmMethod = Callable[[GridFilm, FlowSettings], Iterator[Answer]]
METHODS: dict[str, FilmMethod] = {
    **{links: partial(_finite_differences, links=links) for links in LINKS},
    # A limit of one unknown stops the uniform method on its first mesh, the grid of the gap.
    "uniform": partial(_bounds, method="uniform", name="FE", unknowns=1),
    "adaptive": partial(_bounds, method="adaptive", name="adaptive"),
}
