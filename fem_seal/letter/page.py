"""letter.md: a table of the letter's statements beside the results of this run."""

from fem_seal.errors import present
from fem_seal.letter.campaign import Letter
from fem_seal.letter.seed_thresholds import REFERENCE
from fem_seal.letter.spanning import PAIRS
from fem_seal.letter.surfaces import MODELS
from fem_seal.letter.threshold_rows import ThresholdRow
from fem_seal.tables import markdown


def page(result: Letter) -> str:
    """Markdown of a finished run.

    Parameters
    ----------
    result : of `campaign.letter`
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
    return "\n".join([settings, comparison, "", _thresholds(result.thresholds), ""])


def _comparison(result: Letter) -> list[tuple[str, str, str]]:
    """Lines of quantity, value in the letter, value of this run."""
    agreement = result.agreement
    edges = result.plan.search.edges[0]
    bearing, elastic = (_reference(result, model, edges) for model in MODELS)
    return [
        ("A*/A0, bearing", "0.50 ± 0.02", _with_spread(bearing.threshold, bearing.spread)),
        ("A*/A0, elastic", "0.42(5)", _with_spread(elastic.threshold, elastic.spread)),
        ("difference", "0.075 ± 0.015", f"{bearing.threshold - elastic.threshold:.3f}"),
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
            "peak flow density at A/A0 = 0.2, bearing over elastic",
            "three decades",
            f"10^{result.peak_decades:.2f} (99.9 % quantile: 10^{result.body_decades:.2f})",
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
        (
            "finite differences within both bands",
            "-",
            f"{agreement.bands_overlap} of {agreement.compared} points",
        ),
        *(
            (
                f"cascade's start, {start.model}, A/A0 = {start.area:g}",
                "3 orders better than mean field",
                f"energy {start.energy_reduction:.3g} times, "
                f"pressure {start.rms_reduction:.3g} times",
            )
            for start in result.cascade
        ),
    ]


def _reference(result: Letter, model: str, edges: str) -> ThresholdRow:
    key = (model, REFERENCE, edges)
    return next(row for row in result.thresholds if (row.model, row.pair, row.edges) == key)


def _with_spread(value: float, spread: float | None) -> str:
    return f"{value:.3f}" if spread is None else f"{value:.3f} ± {spread:.3f}"


def _thresholds(rows: list[ThresholdRow]) -> str:
    """Thresholds by pair of connectivities and edges; ± is the spread of one seed."""
    lines = []
    for model, edges in dict.fromkeys((row.model, row.edges) for row in rows):
        by_pair = {row.pair: row for row in rows if (row.model, row.edges) == (model, edges)}
        cells = [_with_spread(by_pair[pair].threshold, by_pair[pair].spread) for pair in PAIRS]
        lines.append([f"{model}, {edges} edges", *cells])
    return markdown(("A*/A0", *PAIRS), lines)
