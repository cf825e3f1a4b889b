# %% [markdown]
# # When may I forget the fluid's pressure?
#
# A dry contact carries the whole load P₀. In truth the leaking fluid carries part of it, and the
# film opens. With the compliance S of the solid, contact pressure p_c >= 0, fluid pressure p_f and
# heights h of the counter-face,
#
#     g = S (p_c + p_f) - h + const >= 0,   p_c g = 0,   mean(p_c + p_f) = P₀,
#     ∇·(g³/(12 η) ∇p_f) = 0.
#
# Three answers, from cheap to dear, for one scene and rising inlet pressures (docs/lift.md):
#
# * dry: p_f = 0 in the first line;
# * range: the dry contacts under P₀ - p_in and P₀ - p_out, whose leak rates enclose that of any
#   fluid pressure between p_out and p_in;
# * resolved: both lines solved together.

# %%
import argparse
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from fem_seal import Scene
from fem_seal.patch import Patch

SCENE = Path(__file__).parent / "scenes" / "first.toml"
LOAD = 0.15e6  # Pa, of that scene
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
        """By how much the dry contact leaks too little."""
        return self.resolved / self.dry


# %% [markdown]
# ## One point
# The same surface and load under another pressure drop. The leak rate is divided by the drop, so
# that the dry answer is one number.


# %%
def point(share: float, n: int) -> Point:
    """Three leak rates at p_in = share × P₀, on n × n samples."""
    inlet = share * LOAD
    settings = [f"surface.shape=[{n}, {n}]", f"flow.pressure_drop={inlet}"]
    settings.append(f"surface.short_wavelength={4 * 100e-6 / n}")
    settings.append('output.products=["leak_rate"]')
    range_, lifted = (
        Patch(Scene.from_file(SCENE, [*settings, f"flow.lift={lift}"]))
        for lift in ("range", "resolved")
    )
    low, high = range_.lift_range
    assert lifted.lifted.converged, lifted.lifted.reason
    # The theorem is about exact flows: the bounds of the computed ones must not contradict it.
    assert low.lower <= lifted.leak_rate.upper
    assert lifted.leak_rate.lower <= high.upper
    return Point(
        share,
        range_.leak_rate.value / inlet,
        low.lower / inlet,
        high.upper / inlet,
        lifted.leak_rate.value / inlet,
    )


# %% [markdown]
# ## The picture


# %%
def draw(points: list[Point], path: Path) -> None:
    """Leak rate over p_in against p_in/P₀."""
    shares = [p.share for p in points]
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    low, high = [p.low for p in points], [p.high for p in points]
    axes.fill_between(shares, low, high, color="0.85", label="range: any fluid pressure")
    axes.plot(shares, [p.dry for p in points], "k--", label="dry")
    axes.plot(shares, [p.resolved for p in points], "o-", color="C0", label="resolved")
    axes.set(xscale="log", yscale="log", xlabel="p$_{in}$ / P$_0$")
    axes.set_ylabel("Q / p$_{in}$  [m³/(s Pa)]")
    axes.legend()
    figure.savefig(path, dpi=150)
    plt.close(figure)


# %% [markdown]
# ## The answer
# Up to the share at which the range itself is as narrow as the flow's tolerance, nothing more need
# be computed: the fluid's pressure may be forgotten. Above it the resolved leak rate leaves the dry
# one behind without end, since a film near closing conducts exponentially less the more it is
# pressed.


# %%
def main(out: Path = Path("results/when_does_the_fluid_matter"), n: int = 64) -> list[Point]:
    """Compute, assert, print and draw."""
    points = [point(share, n) for share in SHARES]
    out.mkdir(parents=True, exist_ok=True)
    draw(points, out / "lift.png")
    print("p_in/P0   resolved/dry   range/dry")
    for p in points:
        print(f"{p.share:7.3g}   {p.factor:12.4g}   {p.low / p.dry:.3g} to {p.high / p.dry:.3g}")
    # More pressure lifts more, and at a hundredth of the load the dry answer is right to a tenth.
    factors = [p.factor for p in points]
    assert factors == sorted(factors)
    forgettable = [p for p in points if p.share <= 0.01]
    assert all(abs(p.factor - 1) < 0.1 for p in forgettable)
    assert factors[-1] > 5
    return points


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="When may I forget the fluid's pressure?")
    parser.add_argument("-n", type=int, default=64, help="samples along a side")
    parser.add_argument("--out", type=Path, default=Path("results/when_does_the_fluid_matter"))
    arguments = parser.parse_args()
    main(arguments.out, arguments.n)
