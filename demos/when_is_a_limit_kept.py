# %% [markdown]
# # When is a limit kept?
#
# A verdict compares the limit L with an interval, never with the computed leak rate Q alone:
#
#     Π f_lower · Q_lower <= true leak rate <= Π f_upper · Q_upper,
#     Q_lower <= Q <= Q_upper,   Q = ∫ K ∂p/∂n ds over the inlet,   ∇·(K ∇p) = 0,   K = g³/(12 η),
#     weak: ∫ K ∇p·∇q dA = 0 for all q that are 0 at inlet and outlet,
#
# where Q_lower and Q_upper are the guaranteed bounds of the flow through the computed gap g, and
# each factor f is the product of the lower or upper factors of all other entries of the error
# budget that have numbers, such as the lift by the fluid's pressure (docs/guide/verdict.md).
#
# * within limit: the upper end is at most L;
# * above limit: the lower end is above L;
# * undecided: L lies in between, or the interval has no end on its side.
#
# One seal is pressed less and less. The last case is computed as if dry: how far the fluid opens
# the film is then not known, and the leak rate has no upper end.
# It runs in one process, since most of its time goes into contacts, which threads share.

# %%
from dataclasses import dataclass
from pathlib import Path

from fem_seal import Scene, solve
from fem_seal.render.plot import new_figure

SCENE = Scene.from_file(Path(__file__).parent / "scenes" / "verdict.toml")
LIMIT = SCENE.limit.leak_rate.number  # [ml/h]
ML_PER_HOUR = 1e-6 / 3600  # m³/s
COLOURS = {"within limit": "#38761d", "undecided": "#b45f06", "above limit": "#cc0000"}


@dataclass(frozen=True)
class Point:
    """Leak rates [ml/h]: the bounds of the flow, and those that the verdict counts."""

    name: str
    lower: float
    upper: float
    counted_lower: float
    counted_upper: float | None
    decision: str


# %% [markdown]
# ## One verdict


# %%
def point(n: int, pressure: float, lift: str) -> Point:
    """Verdict under a contact pressure [MPa]."""
    settings = {
        "surface.shape": [n, n],
        "contact.pressure": f"{pressure} MPa",
        "flow.lift": lift,
        "limit.decide": False,  # flows that end once they decide have bounds too wide to compare
        "output.products": ["leak_rate"],
    }
    solved = solve(SCENE.with_(settings))
    name = f"{pressure} MPa" + (", dry" if lift == "none" else "")
    leak, head = solved.leak_rate, solved.headline
    assert head.lower is not None, (
        f"{name}: the leak rate has no lower end on {n} x {n} samples, and is not drawn; take more"
    )
    rates = (leak.lower, leak.upper, head.lower, head.upper)
    bounds = (None if rate is None else rate / ML_PER_HOUR for rate in rates)
    return Point(name, *bounds, solved.verdict.decision)


# %% [markdown]
# ## The picture
# Dark: the bounds of the flow. Light: multiplied by the factors f. Arrow: no upper end.


# %%
def draw(points: list[Point], path: Path) -> None:
    """Intervals of all points beside the limit."""
    farthest = 1.04 * max(p.counted_upper or p.upper for p in points)
    with new_figure((7, 0.8 + 0.6 * len(points)), path) as figure:
        axes = figure.subplots()
        for row, p in enumerate(points):
            colour = COLOURS[p.decision]
            most = p.counted_upper or farthest
            axes.barh(row, most - p.counted_lower, 0.5, p.counted_lower, color=colour, alpha=0.3)
            axes.barh(row, p.upper - p.lower, 0.5, p.lower, color=colour)
            if p.counted_upper is None:
                axes.plot(most, row, ">", color=colour, markersize=12, clip_on=False)
        axes.axvline(LIMIT, color="k", lw=1.5)
        axes.text(LIMIT, -0.6, "limit ", ha="right")
        axes.bar(0, 0, color="0.3", label="bounds of the flow")
        axes.bar(0, 0, color="0.3", alpha=0.3, label="with all factors of the budget")
        axes.legend(loc="upper right")
        axes.locator_params(axis="x", nbins=6)
        axes.set(xlabel="leak rate [ml/h]", ylim=(len(points) - 0.5, -0.9))
        axes.set_xlim(0.97 * min(p.counted_lower for p in points), farthest)
        axes.set_yticks(range(len(points)), [f"{p.name}:\n{p.decision}" for p in points])


# %%
def main(out: Path = Path("out"), n: int = 256) -> list[Point]:
    """Compute, assert, print and draw."""
    cases = [(9.0, "resolved"), (8.8, "resolved"), (8.6, "resolved"), (8.6, "none")]
    points = [point(n, *case) for case in cases]
    draw(points, out / "limit.png")
    for p in points:
        end = "or more" if p.counted_upper is None else f"to {p.counted_upper:.6f}"
        print(f"{p.name}: {p.decision}, {p.counted_lower:.6f} {end} ml/h")
    # A limit that is kept or exceeded lies outside the interval, and an undecided one inside.
    for p in points:
        most = p.counted_upper
        inside = p.counted_lower <= LIMIT and (most is None or most > LIMIT)
        assert inside == (p.decision == "undecided")
    # Less pressure leaks more, beyond the bounds of the flow; what a finer grid of the contact
    # would change is common to the three.
    strong, middle, weak, dry = points
    assert strong.upper < middle.lower
    assert middle.upper < weak.lower
    # The contact that the fluid lifts leaks more than the dry one.
    assert dry.lower < weak.upper
    assert dry.counted_upper is None
    return points


if __name__ == "__main__":
    main()
