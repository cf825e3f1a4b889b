# %% [markdown]
# # When may I forget the fluid's pressure?
#
# A dry contact carries the whole load P₀. In truth the leaking fluid carries part of it, and the
# film opens. With the compliance S of the solid, contact pressure p_c >= 0, fluid pressure p_f and
# heights h of the counter-face,
#
#     g = S (p_c + p_f) - h + const >= 0,   p_c g = 0,   mean(p_c + p_f) = P₀,
#     ∇·(g³/(12 η) ∇p_f) = 0;  weak: ∫ g³/(12 η) ∇p_f·∇q dA = 0 for all q that are 0 at both ends.
#
# Three answers, the cheapest first, for one scene and rising inlet pressures (docs/theory/lift.md):
#
# * dry: p_f = 0 in the first line;
# * range: the dry contacts under P₀ - p_in and P₀ - p_out, whose leak rates enclose that of any
#   fluid pressure between p_out and p_in;
# * resolved: both lines solved together.
# It runs in one process, since most of its time goes into contacts, which threads share.

# %%
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal import Scene
from fem_seal.patch import Patch
from fem_seal.quantities.lift import lift_range
from fem_seal.render.plot import new_figure

SCENE = Scene.from_file(Path(__file__).parent / "scenes" / "first.toml")
LOAD = SCENE.contact.pressure  # Pa
TOLERANCE = SCENE.flow.rtol
SHARES = (0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 0.9)


@dataclass(frozen=True)
class Point:
    """Leak rates over p_in [m³/s/Pa]: dry, both ends of the range, resolved."""

    share: float
    dry: float
    low: float
    high: float
    resolved: float

    @property
    def factor(self) -> float:
        """Resolved leak rate over that of the dry contact."""
        return self.resolved / self.dry


# %% [markdown]
# ## One point
# The same surface and load under another pressure drop. The leak rate is divided by the drop: the
# dry answer is then the same number for all.


# %%
def point(share: float, n: int) -> Point:
    """Three leak rates at p_in = share × P₀, on n × n samples."""
    inlet = share * LOAD
    waves = {"surface.shape": [n, n], "surface.short_wavelength": 4 * SCENE.surface.size[0] / n}
    scene = SCENE.with_(waves | {"flow.pressure_drop": inlet, "output.products": ["leak_rate"]})
    range_, lifted = (Patch(scene.with_({"flow.lift": lift})) for lift in ("range", "resolved"))
    low, high = lift_range(range_)
    assert lifted.lifted.converged, lifted.lifted.reason
    # The theorem is about exact flows: the bounds of the computed ones must not contradict it.
    assert low.lower <= lifted.leak_rate.upper
    assert lifted.leak_rate.lower <= high.upper
    rates = range_.leak_rate.value, low.lower, high.upper, lifted.leak_rate.value
    return Point(share, *(rate / inlet for rate in rates))


# %% [markdown]
# ## The picture
# Leak rates over the dry one; the dry answer is the line at 1. Green: the fluid's pressure changes
# the leak rate by less than the flow's tolerance, 5 %.


# %%
def forgettable_share(points: list[Point]) -> float:
    """p_in/P₀ at which the resolved leak rate differs from the dry one by the tolerance."""
    factors, shares = (np.log([getattr(p, name) for p in points]) for name in ("factor", "share"))
    return float(np.exp(np.interp(np.log(1 + TOLERANCE), factors, shares)))


def draw(points: list[Point], path: Path) -> None:
    """Leak rate over the dry one against p_in/P₀."""
    shares = np.array([p.share for p in points])
    low, high = (np.array([getattr(p, end) / p.dry for p in points]) for end in ("low", "high"))
    factors = [p.factor for p in points]
    share = forgettable_share(points)
    with new_figure((7, 4.6), path) as figure:
        axes = figure.subplots()
        axes.axvspan(shares[0] / 1.3, share, color="#d9ecd0", lw=0)
        axes.axvline(1, color="C3", lw=2)
        axes.fill_between(shares, low, high, color="0.8")
        axes.axhline(1, color="k", ls="--", lw=1.2)
        axes.plot(shares, factors, "o-", color="C0")
        axes.set(xscale="log", yscale="log", xlim=(shares[0] / 1.3, 1.3), ylim=(0.7, 2 * high[-1]))
        axes.set(xlabel="inlet pressure / load,  p$_{in}$ / P$_0$", ylabel="leak rate / dry one")
        axes.set_title(f"Up to p$_{{in}}$ = {share:.2g} P$_0$ the fluid may be forgotten")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_major_formatter("{x:g}")
        style = {"textcoords": "offset points", "ha": "right", "color": "C0"}
        for p in points[3:]:
            axes.annotate(f"{p.factor:.2g}", (p.share, p.factor), (-6, 0), **style)
        middle = np.sqrt(shares[0] / 1.3 * share)
        axes.text(middle, 3.5, "less than\n5 % more", ha="center", color="#38761d")
        axes.text(0.0165, 0.77, "dry")
        line = {"arrowstyle": "-", "color": "0.3", "shrinkA": 0, "shrinkB": 0}
        axes.annotate("resolved", (0.25, 2.7), (0.2, 9), arrowprops=line, ha="right", color="C0")
        enclosed = "range: any fluid pressure\nbetween those of the ends"
        axes.annotate(enclosed, (0.6, 35), (0.3, 60), arrowprops=line, ha="right", color="0.3")
        axes.text(0.94, 0.77, "p$_{in}$ = P$_0$: may lift off", color="C3", ha="right")


# %% [markdown]
# ## The answer
# As long as the range is as narrow as the flow's tolerance, nothing more need be computed: the
# fluid's pressure may be forgotten. At larger shares the ratio of resolved to dry leak rate grows
# without limit, since the conductivity of a film next to closing falls exponentially with the load.


# %%
def main(out: Path = Path("out"), n: int = 64, shares: tuple[float, ...] = SHARES) -> list[Point]:
    """Compute, assert, print and draw."""
    points = [point(share, n) for share in shares]
    draw(points, out / "lift.png")
    print("p_in/P0   resolved/dry   range/dry")
    for p in points:
        print(f"{p.share:7.3g}   {p.factor:12.4g}   {p.low / p.dry:.3g} to {p.high / p.dry:.3g}")
    print(f"may be forgotten up to p_in = {forgettable_share(points):.2g} P0")
    # A higher pressure lifts more; a hundredth of the load lifts by less than both flows may err.
    factors = [p.factor for p in points]
    assert factors == sorted(factors)
    forgettable = [p for p in points if p.share <= 0.01]
    assert all(abs(p.factor - 1) < 2 * TOLERANCE for p in forgettable)
    # At p_in = 0.9 P₀ it is 430 on 32² samples.
    assert factors[-1] > 5
    return points


if __name__ == "__main__":
    main()
