# %% [markdown]
# # At what contact area does a rough contact seal, and how does the leak fall on the way?
#
# Two solids with random roughness touch on a part A/A0 of their nominal area. If the surfaces are
# only cut (the "bearing" model), contact at A/A0 looks like the open part at 1 - A/A0: if the
# surface is turned over, the two swap. So they must percolate at the same area, one half. Elastic
# solids push material out of the way of a contact; that breaks the symmetry, and contact
# percolates earlier. This is the finding of
#
#     W. B. Dapp, A. Lücke, B. N. J. Persson, M. H. Müser, Phys. Rev. Lett. 108, 244301 (2012)
#
# on 4096 x 4096 samples. This demo repeats it on small grids, with a bracket for each leak rate.
# `fem-seal letter` draws all of its figures, and docs/theory/letter.md shows the results.

# %%
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal import fenicsx  # noqa: F401 (DOLFINx has to be loaded before the pictures' VTK)
from fem_seal.letter.bisection import crossings
from fem_seal.letter.flow_points import FlowPoint, flow_point
from fem_seal.letter.spanning import Criterion
from fem_seal.letter.surfaces import MODELS, RoughCase, at_area
from fem_seal.render.letter import contact_figure
from fem_seal.theory.bruggeman import effective_dimension

MODEL_NAMES = ("bearing", "elastic")


@dataclass(frozen=True)
class Answer:
    """Thresholds (model, seed), and leak rates over that at first contact (model, area)."""

    thresholds: dict[str, np.ndarray]
    currents: dict[tuple[str, float], float]


# %% [markdown]
# The load is bisected for the area where contact begins to span and for the area where open ceases
# to span. Their mean is A*. The pixel triangulation is its own dual: exactly one phase bars the
# other.


# %%
def threshold(case: RoughCase, model: str, seed: int) -> float:
    """A*/A0 of one surface, to 0.01 in each of the two areas."""
    events = [Criterion(phase, "triangulation", "open") for phase in ("contact", "open")]
    brackets = crossings(case.surface(seed), MODELS[model], events, 0.01)
    return float(np.mean([0.5 * (b.before.area + b.after.area) for b in brackets]))


# %% [markdown]
# Each leak rate has a bracket. All are divided by the leak rate at first contact.


# %%
def show(point: FlowPoint, first: float, elastic_threshold: float) -> float:
    """Print one line; return the leak rate over that at first contact."""
    elastic = point.model == "elastic"
    dimension = effective_dimension(point.area, elastic_threshold) if elastic else 2.0
    bruggeman = point.gaps.leak_rate(dimension) / first
    print(
        f"{point.model:>8} {point.area:6.3f} [{point.lower / first:9.2e}, "
        f"{point.upper / first:9.2e}] {bruggeman:10.2e}"
    )
    return point.value / first


# %%
def main(
    n: int = 128,
    seeds: int = 6,
    areas: tuple[float, ...] = (0.1, 0.2, 0.3),
    out: Path = Path("out"),
) -> Answer:
    """Compute thresholds and leak rates, draw both contacts, check the claims of the text."""
    case = RoughCase(n, hurst=0.8, short=4)
    thresholds = {
        model: np.array([threshold(case, model, seed) for seed in range(1, seeds + 1)])
        for model in MODEL_NAMES
    }
    for model, values in thresholds.items():
        print(f"{model:>8} percolates at A/A0 = {values.mean():.3f} ± {values.std(ddof=1):.3f}")
    first = flow_point(case, "elastic", 1, 0.0, rtol=0.2).value
    print(f"{'model':>8} {'A/A0':>6} {'leak rate / at first contact':>24} {'Bruggeman':>10}")
    currents = {
        (model, area): show(
            flow_point(case, model, 1, area, rtol=0.2), first, thresholds["elastic"].mean()
        )
        for area in areas
        for model in MODEL_NAMES
    }
    out.mkdir(parents=True, exist_ok=True)
    contact_figure({model: at_area(case.surface(1), model, 0.46).gap for model in MODEL_NAMES}, out)
    # What to notice: cuts percolate at one half, within the standard error; elastic contact seals
    # earlier, and leaks less at every area long before it seals.
    cut, pressed = (thresholds[model] for model in MODEL_NAMES)
    assert abs(cut.mean() - 0.5) < 3 * cut.std(ddof=1) / seeds**0.5 + 0.005
    assert pressed.mean() < cut.mean()
    for area in areas:
        assert currents["elastic", area] < currents["bearing", area] < 1
    return Answer(thresholds, currents)


if __name__ == "__main__":
    main()
