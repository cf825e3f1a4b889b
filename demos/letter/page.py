"""letter.md: the letter's statements beside the results of a run."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from demos.letter.agreement import agreement, total_decades
from demos.letter.cascade import CascadeStart
from demos.letter.contacts import MODELS
from demos.letter.currents import Current
from demos.letter.events import PAIRS, REFERENCE
from demos.letter.flows import FlowMeasures, decades
from demos.letter.thresholds import DIFFERENCE, ThresholdRow
from fem_seal.tables import markdown

Line = tuple[str, str, str]
HEAD = ("", "the letter (4096²)", "here")
MEASURES = {
    "total": "mean flow density (leak rate over width) [m²/s]",
    "body": "99.9 % quantile of the area that flows [m²/s]",
    "peak": "peak [m²/s]",
    "participation": "participation (∫j²)²/∫j⁴, part of A0",
    "half": "part of A0 through which half of ∫|j| flows",
}


@dataclass(frozen=True)
class Findings:
    """Results of a run; parts that it left out are empty."""

    thresholds: Sequence[ThresholdRow] = ()  #: of the first case
    currents: Sequence[Current] = ()  #: over first contact
    flows: dict[str, FlowMeasures] | None = None
    cascade: Sequence[CascadeStart] = ()


def page(title: str, found: Findings) -> str:
    """Markdown of a run."""
    lines = [
        *(_threshold_lines(found.thresholds) if found.thresholds else ()),
        *(_flow_lines(found.flows) if found.flows else ()),
        *(_current_lines(found.currents) if found.currents else ()),
        *(_cascade_line(start) for start in found.cascade),
    ]
    words = (
        "± is the standard error of a mean over seeds; a single seed has none. All thresholds are "
        "in thresholds.csv, and Persson's theory beside the contacts in theory.csv."
    )
    tables = [markdown(HEAD, lines), *([_flow_table(found.flows)] if found.flows else [])]
    return "\n\n".join([title, words, *tables]) + "\n"


def mean_text(mean: float, standard_error: float | None, deviation: float | None) -> str:
    """A mean over seeds with its standard error, and the standard deviation of one seed."""
    if standard_error is None:
        return f"{mean:.3f}"
    return f"{mean:.3f} ± {standard_error:.3f} (one seed deviates by {deviation:.3f})"


def _statistics_text(row: ThresholdRow) -> str:
    return mean_text(row.threshold, row.standard_error, row.deviation)


def _threshold_lines(rows: Sequence[ThresholdRow]) -> Iterable[Line]:
    of = {(row.model, row.pair): row for row in rows}
    bearing, elastic = (of[model, REFERENCE] for model in MODELS)
    yield "A*/A0, bearing", "0.50 ± 0.02", _statistics_text(bearing)
    yield "A*/A0, elastic", "0.42(5)", _statistics_text(elastic)
    for pair in PAIRS:
        text = _statistics_text(of[DIFFERENCE, pair])
        yield f"bearing less elastic, {pair}", "0.075 ± 0.015", text
    error = elastic.corrected_deviation and elastic.corrected_deviation / elastic.seeds**0.5
    text = mean_text(elastic.corrected, error, elastic.corrected_deviation)
    yield "A*/A0, elastic, perimeter-corrected", "-", text
    widths = ", ".join(f"{of[model, 'contact-8'].half_width:.3f}" for model in MODELS)
    yield "half-width of the transition, contact 8 / open 4, bearing, elastic", "0.02", widths
    yield "Euler characteristic of elastic contact at A*", "negative", f"{elastic.euler:.0f}"


def _flow_lines(flows: dict[str, FlowMeasures]) -> Iterable[Line]:
    names = {"total": "total", "body": "99.9 % quantile", "peak": "peak"}
    ratios = ", ".join(f"{text} 10^{decades(flows, name):.2f}" for name, text in names.items())
    yield "maximum of the flow density at A/A0 = 0.2, bearing over elastic", "10^3", ratios


def _current_lines(currents: Sequence[Current]) -> Iterable[Line]:
    for corrected, name in ((False, "counted"), (True, "corrected")):
        logs = total_decades(currents, corrected)
        if logs:
            text = ", ".join(f"10^{log:.2f}" for log in logs)
            yield f"leak rate at A/A0 = 0.2, same {name} area, each seed", "-", text
    found = agreement(currents)
    factor = f"within a factor {found.bruggeman:.2f}"
    yield "Bruggeman, bearing, up to 0.75 A*", "very accurate", factor
    factor = f"within a factor {found.modified:.2f}"
    yield "modified Bruggeman, elastic, up to 0.75 A*", "very good over several decades", factor
    yield "decades of current in Fig. 3", "several", f"{found.decades:.1f}"
    if found.compared:
        text = f"{found.overlap} of {found.compared} points"
        yield "finite differences within both bands", "-", text


def _cascade_line(start: CascadeStart) -> Line:
    text = f"energy {start.energy_gain:.3g} times"
    if start.pressure_gain:
        text += f", pressure {start.pressure_gain:.3g} times"
    name = f"cascade's start, {start.model}, A/A0 = {start.area:g}"
    return name, "3 orders better than mean field", text


def _flow_table(flows: dict[str, FlowMeasures]) -> str:
    """Fig. 2 as numbers."""
    lines = [
        [
            text,
            *(f"{getattr(flows[model], name):.3g}" for model in MODELS),
            f"{decades(flows, name):.2f}",
        ]
        for name, text in MEASURES.items()
    ]
    return markdown(("flow density j at A/A0 = 0.2", *MODELS, "log10 of the ratio"), lines)
