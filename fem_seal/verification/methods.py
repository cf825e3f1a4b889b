"""Methods to compare: finite differences by link rule, linear elements, adaptive ones."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from time import process_time

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.finite_difference.links import LINKS
from fem_seal.flow_settings import FlowSettings


@dataclass(frozen=True)
class Answer:
    """Leak rate by one method on one grid."""

    method: str  #: name of the method in tables
    value: float  #: leak rate [m^3/s]
    lower: float | None  #: bounds [m^3/s]; None for finite differences
    upper: float | None
    unknowns: int  #: unknowns of the solve
    seconds: float  #: CPU time [s]
    reason: str = ""  #: sentence on why the value is no leak rate; empty if it is


def _elements(
    film: GridFilm, settings: FlowSettings, method: str, name: str, unknowns: int | None = None
) -> Answer:
    from fem_seal.flow import leak_rate

    limits = replace(settings.limits, unknowns=unknowns or settings.limits.unknowns)
    start = process_time()
    leak = leak_rate(film, replace(settings, method=method, limits=limits))
    return Answer(name, leak.value, *leak.bounds, leak.unknowns, process_time() - start)


def _differences(film: GridFilm, settings: FlowSettings, link_rule: str) -> Answer:
    start = process_time()
    fluid = settings.viscosity, settings.pressure_drop, settings.slip
    leak = by_differences(film, *fluid, link_rule)
    spent = process_time() - start
    return Answer(f"FD {link_rule}", leak.value, None, None, leak.unknowns, spent, leak.reason)


METHODS: dict[str, Callable[[GridFilm, FlowSettings], Answer]] = {
    **{rule: partial(_differences, link_rule=rule) for rule in LINKS},
    # A limit of one unknown stops the uniform method on its first mesh, the grid of the gap.
    "uniform": partial(_elements, method="uniform", name="FE", unknowns=1),
    "adaptive": partial(_elements, method="adaptive", name="adaptive"),
}
