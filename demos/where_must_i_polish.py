# %% [markdown]
# # Where must I polish?
#
# A tenth of a rough face may be smoothed. Which tenth changes the leak rate Q most? With contact
# pressure p_c and fluid pressure p_f over heights h, p_c >= 0, g >= 0, p_c g = 0, Q is the flux of
#
#     g = S (p_c + p_f) - h + const,   ∇·(g³/(12 η) ∇p_f) = 0;
#     weak: ∫ g³/(12 η) ∇p_f·∇q dA = 0 for all q that are 0 at inlet and outlet.
#
# The product `sensitivity` knows ∂ ln Q/∂h at every sample by one solve of the adjoint equations
# (`fem_seal/sensitivity.py`). A smoothing changes the heights by δ, and to first order ln Q by
# Σ ∂ ln Q/∂h δ. The tenth with the largest |∂ ln Q/∂h δ| is smoothed, and then tenths at random.
#
# It runs in one process, since its flows are small.

# %%
from dataclasses import dataclass
from math import log
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from fem_seal import Heights, Scene, solve
from fem_seal.render.plot import new_figure

SCENE = Scene.from_file(Path(__file__).parent / "scenes" / "first.toml")
TENTH = 0.1
WIDTH = 1.0  # of the smoothing [samples]


@dataclass(frozen=True)
class Polished:
    """Change of ln Q where the sensitive tenth is smoothed, and where random tenths are."""

    sensitive: float
    random: tuple[float, ...]


# %% [markdown]
# ## One face, and its leak rate after a change of its heights


# %%
def leak_rate(scene: Scene, heights: np.ndarray) -> float:
    """Leak rate [m³/s] of other heights [m] in the same scene."""
    size = scene.surface.size
    return solve(scene.with_({"surface": Heights(heights, size=size)})).leak_rate.value


def polished(heights: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Heights smoothed at some samples (a mask)."""
    return np.where(where, gaussian_filter(heights, WIDTH, mode="wrap"), heights)


# %% [markdown]
# ## What to notice
# The largest derivatives stand at the tightest places of the channels and in the contacts beside
# them: half of the most sensitive hundredth has a gap below that of the critical constriction. A
# smoothing that misses them changes little.


# %%
def main(n: int = 128, tries: int = 4, rtol: float = 0.01, out: Path = Path("out")) -> Polished:
    """Smooth the sensitive tenth and random tenths; draw the change of ln Q."""
    changes = {"surface.shape": [n, n], "flow.lift": "none", "flow.rtol": rtol}
    changes |= {"accuracy.contact_grid": False, "output.products": ["leak_rate"]}
    plain = SCENE.with_(changes)
    before = solve(plain.with_({"output.products": ["leak_rate", "sensitivity"]}))
    heights = before.patch.surface.values
    by_height = before.patch.sensitivity.by_height.values
    first_order = np.abs(by_height * (gaussian_filter(heights, WIDTH, mode="wrap") - heights))
    hundredth = np.argsort(np.abs(by_height), axis=None)[-(heights.size // 100) :]
    tightest, film = np.median(before.patch.film.gap.values.ravel()[hundredth]), before.patch.film
    assert tightest < film.constriction.gap
    count = round(TENTH * heights.size)
    order = np.argsort(first_order, axis=None)

    def change(chosen: np.ndarray) -> float:
        """Change of ln Q where these samples are smoothed."""
        where = np.zeros(heights.size, bool)
        where[chosen] = True
        after = leak_rate(plain, polished(heights, where.reshape(heights.shape)))
        return log(after / before.leak_rate.value)

    rng = np.random.default_rng(1)
    random = tuple(change(rng.choice(heights.size, count, replace=False)) for _ in range(tries))
    result = Polished(change(order[-count:]), random)
    print(f"the sensitive tenth smoothed: ln Q changes by {result.sensitive:+.2f}")
    print("random tenths: " + ", ".join(f"{one:+.2f}" for one in random))
    # Ten times was seen, on 64² samples.
    assert abs(result.sensitive) > 3 * max(map(abs, random)), result
    draw_changes(result, Path(out) / "polished.png")
    return result


def draw_changes(result: Polished, path: Path) -> None:
    """Changes of ln Q as bars."""
    with new_figure((7, 3), path) as figure:
        axes = figure.subplots()
        others = len(result.random)
        names = ["the sensitive tenth"] + [f"a random tenth, {k + 1}" for k in range(others)]
        changes, colours = [result.sensitive, *result.random], ["#b45f06"] + ["0.6"] * others
        axes.barh(names, changes, color=colours)
        axes.axvline(0, color="k", lw=1)
        axes.invert_yaxis()
        axes.set(xlabel="change of ln Q", title="Smoothing a tenth of the face")


if __name__ == "__main__":
    main()
