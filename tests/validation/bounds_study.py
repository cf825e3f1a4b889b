"""The bounds against their true errors: several surfaces, loads up to closing, many tolerances.

    python tests/validation/bounds_study.py [SAMPLES]

The *effectivity* of a bracket is its half-width over the true error of √(lower·upper). A theorem
makes it at least 1; how much more says what the certificate costs. The truth is the bracket of a
run to a tolerance many times smaller.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from validation_rows import (
    FLOW_PYTHON,
    UNIT,
    Number,
    flow,
    linear_samples,
    of_bounds,
    patch,
    roughness,
)

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.leak_rate import relative_half_width
from fem_seal.render.plot import new_figure
from fem_seal.tables import markdown
from fem_seal.threshold import threshold
from fem_seal.verification.cross_validation import StudiedGap, compare

TOLERANCES = (0.8, 0.4, 0.2, 0.1, 0.05, 0.025)
SHARES = (0.5, 0.8, 0.95, 0.99)  # loads over that which seals
SEEDS = (1, 2, 3, 4)


@dataclass(frozen=True)
class Bracket:
    """The end of a run: its unknowns, relative half-width and true error of √(lower·upper)."""

    unknowns: int
    half_width: float
    error: float
    doubt: float  #: half-width of what is taken for the truth, relative

    @property
    def effectivity(self) -> float:
        """Half-width over true error, at least; the truth may lie nearer or further by `doubt`."""
        return self.half_width / (self.error + self.doubt)


def brackets(film: GridFilm, truth: Number) -> list[Bracket]:
    """Runs to several tolerances, as far as the truth can tell their errors."""
    doubt, runs = truth.half / truth.value, []
    for rtol in TOLERANCES:
        leak = leak_rate(film, FlowSettings(rtol=rtol, **UNIT))
        half_width = relative_half_width(*leak.bounds)
        if half_width > 4 * doubt:
            error = abs(leak.value / truth.value - 1)
            runs.append(Bracket(leak.unknowns, half_width, error, doubt))
    return runs


@dataclass(frozen=True)
class Case:
    """A dry contact under a share of the load that seals it."""

    seed: int
    share: float
    area: float
    meshes: list[Bracket]
    others: dict[str, float]  #: relative errors of other methods' numbers


def rough_case(seed: int, share: float, samples: int) -> Case:
    """One surface under one load, unit pressure drop."""
    waves = {"long_wavelength": 2.5e-5, "short_wavelength": 8e-4 / samples}
    elastic = patch(surface=roughness(samples, seed, **waves))
    sealing = threshold(elastic).pressure_leaking
    contact = press(elastic.surface, ElasticSolid(1e7), Load("pressure", share * sealing))
    film = GridFilm(contact.gap, "periodic")
    truth = of_bounds(leak_rate(film, FlowSettings(rtol=0.004, **UNIT)))
    rows, _ = compare(
        [StudiedGap.of_film(film, FlowSettings(**UNIT, rtol=0.1))], ("linear-gap", "adaptive")
    )[0]
    network = [row for row in rows if row.method == "FD linear-gap"][-1].value
    others = {"finite differences, 4n": network / truth.value - 1}
    if FLOW_PYTHON.exists():
        unit = film.gap.values / film.gap.values.max()
        theirs = flow(linear_samples(unit, 4))["value"] * film.gap.values.max() ** 3
        others["reynoldsflow, 4n"] = theirs / truth.value - 1
    return Case(seed, share, contact.contact_area_fraction, brackets(film, truth), others)


def table(cases: Sequence[Case]) -> str:
    """A line for each surface and load, at the narrowest bracket whose error can be told."""
    names = list(cases[0].others)
    header = ("seed", "load / sealing load", "A/A₀", "unknowns", "half-width", "true error")
    lines = []
    for case in cases:
        narrow = case.meshes[-1]
        lines.append(
            [
                *(str(case.seed), f"{case.share:g}", f"{case.area:.3f}", str(narrow.unknowns)),
                f"±{100 * narrow.half_width:.1f} %",
                f"{100 * narrow.error:.2f} % (± {100 * narrow.doubt:.2f} %)",
                f"above {narrow.effectivity:.1f}",
                *(f"{100 * case.others[name]:+.1f} %" for name in names),
            ]
        )
    return markdown((*header, "effectivity", *names), lines)


def figure(cases: Sequence[Case], samples: int, path: Path) -> None:
    """Effectivity against unknowns."""
    with new_figure((7.5, 4.2), path) as drawn:
        axes = drawn.subplots()
        colours = {share: f"C{k}" for k, share in enumerate(SHARES)}
        for case in cases:
            label = f"{case.share:g} of the sealing load" if case.seed == cases[0].seed else None
            line = [(mesh.unknowns, mesh.effectivity) for mesh in case.meshes]
            axes.plot(*zip(*line, strict=True), "o-", ms=3, color=colours[case.share], label=label)
        axes.axhline(1, color="0.6", lw=0.8)
        axes.set(xscale="log", yscale="log", xlabel="unknowns")
        axes.set_ylabel("half-width of the bounds / true error, at least")
        axes.set_title(f"dry contacts on {samples}², not lifted by the fluid", fontsize=10)
        axes.legend(frameon=False, fontsize=8)


def study(samples: int, picture: Path) -> str:
    """Compute, draw, and return the table."""
    cases = [rough_case(seed, share, samples) for seed in SEEDS for share in SHARES]
    figure(cases, samples, picture)
    return table(cases)


if __name__ == "__main__":
    print(study(int(sys.argv[1]) if len(sys.argv) > 1 else 64, Path("bounds_study.png")))
