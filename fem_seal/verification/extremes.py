"""The extremes in one table: each is right, clearly refused, or limited from a stated number on."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from inspect import getdoc

from fem_seal.errors import FemSealError
from fem_seal.progress import Report, silent
from fem_seal.tables import as_markdown
from fem_seal.verification import extreme_contacts as contacts
from fem_seal.verification import extreme_flows as flows
from fem_seal.verification import extreme_gaps as gaps
from fem_seal.verification import extreme_inputs as inputs
from fem_seal.verification.finding import Outcome, wrong

Extreme = Callable[[], Outcome]

EXTREMES: dict[str, tuple[Extreme, ...]] = {
    "Flow": (
        flows.gap_sizes,
        flows.viscosities,
        flows.pressure_drops,
        flows.gaps_beyond_double_precision,
        flows.contrast_along,
        flows.contrast_across,
        flows.checkerboard_contrast,
        flows.finite_difference_contrast,
        gaps.no_contact,
        gaps.nearly_all_contact,
        gaps.percolation,
        gaps.one_pixel_channel,
        gaps.one_pixel_wall,
        gaps.corner_contacts,
        gaps.pockets,
        gaps.slender,
        gaps.small_grids,
    ),
    "Contact": (
        contacts.loads,
        contacts.contact_units,
        contacts.flat_surface,
        contacts.one_mode,
        contacts.hurst_exponents,
        contacts.shortest_waves,
        contacts.all_but_one,
        contacts.odd_shapes,
        contacts.iterations_too_few,
        contacts.tolerance_below_rounding,
    ),
    "Input": (
        inputs.array_layouts,
        inputs.not_finite,
        inputs.negative_gap,
        inputs.shapes_and_spacings,
        inputs.flow_numbers,
        inputs.sides_that_do_not_repeat,
        inputs.scene_numbers,
    ),
}


@dataclass(frozen=True)
class Finding:
    """A row of the table.

    extreme : what was asked for
    verdict : "right", "refused" (a clear error, as it should be), "limited" (right up to a number,
        and said so beyond) or "broken"
    found : how we know, or what the program said
    """

    extreme: str
    verdict: str
    found: str


def look_at(extreme: Extreme) -> Finding:
    """Try one extreme; an error that it does not expect, or a warning, means broken."""
    asked = getdoc(extreme).rstrip(".")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            outcome = extreme()
    except (FemSealError, RuntimeWarning, ArithmeticError) as error:
        outcome = wrong(f"{type(error).__name__}: {error}")
    return Finding(asked, outcome.verdict, outcome.told.replace("|", "/"))


def examine(report: Report = silent) -> tuple[Finding, ...]:
    """Try every extreme.

    Parameters
    ----------
    report : called with what is being tried

    Returns
    -------
    Findings in the order of `EXTREMES`.
    """
    findings = []
    for part, extremes in EXTREMES.items():
        for extreme in extremes:
            report(part, getdoc(extreme))
            findings.append(look_at(extreme))
    return tuple(findings)


INTRODUCTION = """# Limits

Written by `fem-seal study extremes --out docs/limits.md`. Each row is an extreme that was tried.
**right**: the answer was compared with a closed form, a scaling law or its own certificate.
**refused**: a clear error, exit status 2 or 3, with this message. **limited**: right up to the
number given; beyond it the program itself says that it has not converged, by wide bounds with
`converged` false or by an error. **broken** would be anything else: wrong, silent, or bounds
that cross.

What no row can show: the bounds hold for the gap as it is represented. What the grid of the
contact has missed they do not know ([price.md](price.md)).
"""


def as_page(findings: Sequence[Finding]) -> str:
    """Write docs/limits.md.

    Parameters
    ----------
    findings : of `examine`

    Returns
    -------
    Markdown, a table for each part.
    """
    by_name = {finding.extreme: finding for finding in findings}
    sections = [INTRODUCTION]
    for part, extremes in EXTREMES.items():
        rows = [by_name[getdoc(extreme).rstrip(".")] for extreme in extremes]
        sections.append(f"## {part}\n\n{as_markdown(rows)}\n")
    return "\n".join(sections)
