# %% [markdown]
# # Where does it break, and does it say so?
#
# A checkerboard of two film conductivities √C and 1/√C, for which the leak rate Q of
#
#     ∇·(K ∇p) = 0
#
# is known at any contrast C: turned by a right angle the board is its own reciprocal, and a medium
# and its reciprocal conduct like K and 1/K (Keller 1964; Dykhne 1971). So one cell at Δp = 1 leaks
# Q = 1. All the flow passes the corners, and they are worse than the critical constriction of any
# contact: the pressure there goes like r^a, a = (4/π) atan(1/√C). No grid resolves this if C is
# large.
#
# Three ways to compute it from the same pixels: finite differences with four link rules, linear
# elements on the pixel mesh with their two bounds, and the adaptive mesh.
# `mpirun -n 2 python demos/where_it_breaks.py` shares the elements between two processes.

# %%
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.film import GridFilm
from fem_seal.finite_difference import by_differences
from fem_seal.flow import Limits, leak_rate
from fem_seal.leak_rate import LeakRate
from fem_seal.render.plot import new_figure
from fem_seal.verification.exact_cases import block_film

SETTING = {"viscosity": 1 / 12, "pressure_drop": 1.0}
LINKS = ("harmonic", "linear-gap", "geometric", "arithmetic")
CONTRASTS = (3.0, 10.0, 30.0, 1e2, 1e3, 1e4, 1e6, 1e8)
EXACT = 1.0


# %%
@dataclass(frozen=True, eq=False)
class Answers:
    """Leak rates of one contrast; by link rule, on the pixel mesh, on the adaptive mesh."""

    contrast: float
    differences: dict[str, float]
    uniform: LeakRate
    adaptive: LeakRate


def checkerboard(contrast: float, n: int) -> GridFilm:
    """Film on n × n pixels: g³ is a checkerboard around one corner, between side walls."""
    high, low = contrast**0.5, contrast**-0.5
    return block_film(np.array([[low, high], [high, low]]), n)


def compute(contrast: float, n: int, unknowns: int) -> Answers:
    """Leak rates of all methods; the adaptive mesh has at most this many unknowns."""
    film = checkerboard(contrast, n)
    return Answers(
        contrast=contrast,
        differences={links: by_differences(film, links=links, **SETTING).value for links in LINKS},
        uniform=leak_rate(film, method="uniform", limits=Limits(unknowns=1), **SETTING),
        # every_dual: a lower bound from every mesh, also if the limit ends the refinement early.
        adaptive=leak_rate(
            film, rtol=0.05, limits=Limits(unknowns=unknowns), every_dual=True, **SETTING
        ),
    )


# %%
def draw(answers: list[Answers], path: Path) -> None:
    """Leak rates against contrast; the truth is the line at 1."""
    with new_figure((7.5, 4.6), path) as figure:
        axes = figure.subplots()
        x = [answer.contrast for answer in answers]
        for name, colour in (("uniform", "tab:blue"), ("adaptive", "tab:red")):
            leaks = [getattr(answer, name) for answer in answers]
            lower, upper = [leak.lower for leak in leaks], [leak.upper for leak in leaks]
            axes.fill_between(x, lower, upper, color=colour, alpha=0.3, label=f"{name}: bounds")
        for links, marker in zip(LINKS, "v^sD", strict=True):
            values = [answer.differences[links] for answer in answers]
            axes.plot(x, values, "k", ls=":", marker=marker, mfc="w", label=f"differences, {links}")
        axes.axhline(EXACT, color="k", lw=0.8)
        axes.set(xscale="log", yscale="log", xlabel="contrast of the film conductivity")
        axes.set(ylabel="leak rate (exactly 1)", title="a checkerboard of ever higher contrast")
        axes.legend(frameon=False, fontsize=8, ncols=2)


# %% [markdown]
# ## What to notice
# * The truth lies inside all bounds at every contrast.
# * Arithmetic and harmonic links are wrong by orders of magnitude, and nothing shows it.
# * The bounds of the pixel mesh are just as far apart, and so show that this mesh cannot do better.
# * The adaptive mesh closes them to 5 % as long as the corner can be resolved; from a contrast of
#   about a hundred on, `converged` is False, `reason` says why, and the bounds are what is known.
# * The geometric mean of the bounds is right to a per cent even then, by the same symmetry.
#
# docs/measurements/limits.md has extremes of other kinds.


# %%
def main(out: Path = Path("out"), n: int = 16, unknowns: int = 3000) -> list[Answers]:
    """Compare, draw `where_it_breaks.png` into `out`, check the claims above."""
    answers = [compute(contrast, n, unknowns) for contrast in CONTRASTS]
    draw(answers, out / "where_it_breaks.png")
    for case in answers:
        rates = ", ".join(f"{links} {value:.3g}" for links, value in case.differences.items())
        both = case.uniform, case.adaptive
        bounds = [f"[{leak.lower:.3g}, {leak.upper:.3g}]" for leak in both]
        print(f"contrast {case.contrast:.0e}: {rates}; pixel mesh {bounds[0]}, ", end="")
        print(f"adaptive {bounds[1]} with {case.adaptive.unknowns} unknowns")
        for leak in both:
            assert all(level.lower <= EXACT <= level.upper for level in leak.levels)
        width = (case.adaptive.upper - case.adaptive.lower) / case.adaptive.value
        assert case.adaptive.converged == (width <= 0.05)
        assert case.adaptive.converged or case.adaptive.reason
    first, last = answers[0], answers[-1]
    assert last.differences["arithmetic"] > 100 > 1.5 > first.differences["arithmetic"]
    assert last.differences["harmonic"] < 0.01 < 0.7 < first.differences["harmonic"]
    assert last.uniform.upper / max(last.uniform.lower, 1e-99) > 1e4
    assert first.adaptive.converged
    assert not last.adaptive.converged
    return answers


if __name__ == "__main__":
    main()
