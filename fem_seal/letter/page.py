"""letter.md: a table of the letter's statements beside the results of this run."""

from fem_seal.errors import present
from fem_seal.letter.campaign import Letter
from fem_seal.letter.seed_thresholds import REFERENCE
from fem_seal.letter.spanning import PAIRS
from fem_seal.letter.surfaces import MODELS
from fem_seal.letter.threshold_rows import DifferenceRow, ThresholdRow
from fem_seal.tables import markdown

# Measures of the flow density that are compared with the letter's, and their names on the page.
MEASURES = {"total": "total", "body": "99.9 % quantile", "peak": "peak"}


def page(result: Letter) -> str:
    """Markdown of a finished run.

    Parameters
    ----------
    result : result of `campaign.letter`
    """
    case, plan = result.plan.case, result.plan
    seeds = "1 seed" if plan.seeds == 1 else f"{plan.seeds} seeds"
    settings = (
        f"n = {case.n}, H = {case.hurst:g}, λ_s = {case.short:g} and λ_l = "
        f"{case.long * case.n:g} samples, {seeds}, rtol = {plan.rtol:g}; finished "
        f"{result.finished:%Y-%m-%d %H:%M} UTC, {result.seconds_in_points / 60:.0f} CPU min in "
        f"the points of thresholds and currents, {result.peak_memory_bytes / 1e9:.2g} GB at most.\n"
    )
    comparison = markdown(("", "the letter (4096²)", "here"), _comparison(result))
    tables = [
        comparison,
        _thresholds(result.thresholds),
        _differences(result.differences),
        _flow(result),
        _theory(result),
    ]
    return "\n".join([settings, *(f"{table}\n" for table in tables)])


def _comparison(result: Letter) -> list[tuple[str, str, str]]:
    """Lines of quantity, value in the letter, value of this run."""
    agreement = result.agreement
    edges = result.plan.search.edges[0]
    bearing, elastic = (_reference(result, model, edges) for model in MODELS)
    return [
        ("A*/A0, bearing", "0.50 ± 0.02", _with_spread(bearing.threshold, bearing.spread)),
        ("A*/A0, elastic", "0.42(5)", _with_spread(elastic.threshold, elastic.spread)),
        *(
            (
                f"bearing less elastic, {row.pair}",
                "0.075 ± 0.015",
                _with_spread(row.difference, row.spread),
            )
            for row in result.differences
            if row.edges == edges
        ),
        (
            "half-width of the transition, contact 8 / open 4, bearing and elastic",
            "0.02",
            ", ".join(
                f"{_row(result, model, 'contact-8', edges).half_width:.3f}" for model in MODELS
            ),
        ),
        (
            "A*/A0, elastic, perimeter-corrected",
            "-",
            _with_spread(present(elastic.corrected, "correction"), elastic.corrected_spread),
        ),
        (
            "Euler characteristic of elastic contact, of open, at A*",
            "negative, positive",
            f"{elastic.euler_contact:.0f}, {elastic.euler_open:.0f}",
        ),
        (
            "local maximum of the flow density at A/A0 = 0.2, bearing over elastic",
            "three decades",
            ", ".join(f"{text} 10^{result.decades[name]:.2f}" for name, text in MEASURES.items()),
        ),
        (
            "Bruggeman, bearing, up to 0.8 A*",
            "very accurate",
            f"within a factor {agreement.bruggeman_bearing:.2f}",
        ),
        (
            "modified Bruggeman, elastic, up to 0.8 A*",
            "very good over several decades",
            f"within a factor {agreement.modified_measured_elastic:.2f} (A* measured), "
            f"{agreement.modified_elastic:.2f} (A* = 0.42)",
        ),
        ("decades of current in Fig. 3", "several", f"{agreement.decades:.1f}"),
        *(
            [
                (
                    "finite differences within both bands",
                    "-",
                    f"{agreement.bands_overlap} of {agreement.compared} points",
                )
            ]
            if agreement.compared
            else []
        ),
        *(
            (
                f"cascade's start, {start.model}, A/A0 = {start.area:g}",
                "3 orders better than mean field",
                f"energy {start.energy_reduction:.3g} times"
                + (f", pressure {start.rms_reduction:.3g} times" if start.rms_reduction else ""),
            )
            for start in result.cascade
        ),
    ]


def _reference(result: Letter, model: str, edges: str) -> ThresholdRow:
    return _row(result, model, REFERENCE, edges)


def _row(result: Letter, model: str, pair: str, edges: str) -> ThresholdRow:
    key = (model, pair, edges)
    return next(row for row in result.thresholds if (row.model, row.pair, row.edges) == key)


def _with_spread(value: float, spread: float | None) -> str:
    return f"{value:.3f}" if spread is None else f"{value:.3f} ± {spread:.3f}"


def _differences(rows: list[DifferenceRow]) -> str:
    """Bearing less elastic thresholds of the same surfaces; ± is the spread of one seed."""
    lines = []
    for edges in dict.fromkeys(row.edges for row in rows):
        by_pair = {row.pair: row for row in rows if row.edges == edges}
        cells = [_with_spread(by_pair[pair].difference, by_pair[pair].spread) for pair in PAIRS]
        lines.append([f"{edges} edges", *cells])
    return markdown(("bearing less elastic A*/A0", *PAIRS), lines)


def _flow(result: Letter) -> str:
    """Fig. 2 as numbers."""
    names = {
        "total": "mean flow density (leak rate over width) [m²/s]",
        "body": "99.9 % quantile of the area that flows [m²/s]",
        "peak": "peak [m²/s]",
        "participation": "participation (∫j²)²/∫j⁴, part of A0",
        "half": "part of A0 through which half of ∫|j| flows",
    }
    lines = [
        [
            text,
            *(f"{getattr(result.flows[model], name):.3g}" for model in MODELS),
            f"{result.decades[name]:.2f}",
        ]
        for name, text in names.items()
    ]
    return markdown(("flow density j at A/A0 = 0.2", *MODELS, "log10 of the ratio"), lines)


def _theory(result: Letter) -> str:
    """Elastic contacts under load beside Persson's theory."""
    lines = [
        [
            row.law,
            str(row.seed),
            *(f"{number:.3g}" for number in (row.load, row.area, row.area_corrected)),
            *(f"{number:.2f}" for number in (row.kappa, row.kappa_corrected)),
            f"{row.theory_area:.3g}",
            *(f"{number:.2f}" for number in (row.at_area, row.at_load)),
        ]
        for row in result.theory
    ]
    head = (
        *("area law", "seed", "p/(E* h'rms)", "A/A0", "corrected", "κ", "κ, corrected"),
        *("theory's A/A0", "Q over certified, same corrected area", "same load"),
    )
    return markdown(head, lines)


def _thresholds(rows: list[ThresholdRow]) -> str:
    """Thresholds by pair of connectivities and edges; ± is the spread of one seed."""
    lines = []
    for model, edges in dict.fromkeys((row.model, row.edges) for row in rows):
        by_pair = {row.pair: row for row in rows if (row.model, row.edges) == (model, edges)}
        cells = [_with_spread(by_pair[pair].threshold, by_pair[pair].spread) for pair in PAIRS]
        lines.append([f"{model}, {edges} edges", *cells])
    return markdown(("A*/A0", *PAIRS), lines)
