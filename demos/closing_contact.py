# %% [markdown]
# # How do gap and flow change as the load rises until the seal is tight?
#
# A patch of a rough contact is pressed by ever larger loads, up to the one that seals it. Through
# its gap g flows
#
#     ∇·(K ∇p) = 0,  K = g³/(12 η),  p = Δp at the inlet, 0 at the outlet,
#     weak: ∫ K ∇p·∇q dA = 0 for all q that are 0 at inlet and outlet,
#
# and the leak rate Q is the flux through any section, enclosed by lower ≤ Q ≤ upper. The loads lie
# ever closer to each other: next to closing Q falls as a power of the distance from the last one.
# The contact is dry: the fluid's pressure does not lift the solid.
#
# Claims: from load to load contact area rises and Q falls beyond its bounds; the last alone seals.
#
# `python demos/closing_contact.py SCENE.toml --loads 12` does the same for another scene
# (without [limit], which would end a flow as soon as it is decided, and without [seal]).
# It runs in one process, since most of its time goes into contacts, which threads share.

# %%
import argparse
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, log10
from pathlib import Path

import numpy as np

from fem_seal import LeakRate, Patch, Scene
from fem_seal.digits import per_cent, with_prefix
from fem_seal.film import GridFilm
from fem_seal.render.colours import CONTACT, NO_FLOW
from fem_seal.render.flow import draw_flow, flow_density, flow_scale
from fem_seal.render.page import add_bar, page, window_of
from fem_seal.render.samples import draw_gap, gap_scale
from fem_seal.threshold import threshold

FIRST_SCENE = Path(__file__).parent / "scenes/first.toml"
FIRST = 0.1  # first load, as part of the one that seals
SHOWN = 3  # loads side by side; more would make the lettering too small for a page
DECADES = 2  # length of the colour bar below the strongest flow of the tightest contact


@dataclass(frozen=True)
class Loaded:
    """A patch under one mean contact pressure [Pa]."""

    pressure: float
    film: GridFilm
    leak: LeakRate


# %%
def loaded(scene: Path, changes: list[str], count: int) -> list[Loaded]:
    """Solve contact and flow under rising loads; the last one seals."""
    dry = Scene.from_file(scene, changes).with_({"flow.lift": "none"})
    closing = threshold(Patch(dry)).pressure_sealed
    steps = []
    for left in np.linspace(1, 0, count):
        pressure = closing * (1 - (1 - FIRST) * left**2)
        patch = Patch(dry.with_({"contact.pressure": pressure, "output.products": ["pictures"]}))
        steps.append(Loaded(pressure, patch.film, patch.leak_rate))
    return steps


# %% [markdown]
# ## What to notice
# * While the contact area grows by a factor of a few, the leak rate falls by decades.
# * The flow passes fewer and fewer channels, at last a single one, whose tightest place is marked.


# %%
def draw(steps: list[Loaded], path: Path) -> None:
    """Draw gaps in the upper row, flows in the lower one, each row on one scale."""
    places = np.linspace(0, len(steps) - 1, min(len(steps), SHOWN)).round().astype(int)
    shown = [steps[k] for k in places]
    flows = [step.leak.field for step in shown if step.leak.field is not None]
    peaks = [float(flow_density(flow).max()) for flow in flows]
    gaps = gap_scale(*(step.film.gap.values for step in shown))
    scale = flow_scale(*flows, decades=DECADES + ceil(log10(max(peaks) / min(peaks))))
    window, shape, key = window_of(shown[0].film), (2, len(shown)), (CONTACT, NO_FLOW)
    with page(window, path, shape=shape, side=2.1, key=key) as axes:
        for step, upper, lower in zip(shown, *axes, strict=True):
            area = per_cent(step.film.contact_area_fraction)
            title = f"{with_prefix(step.pressure, 'Pa', 3)}, {area} in contact"
            draw_gap(upper, step.film, gaps, title=title)
            rate = f"{step.leak.value:.1e} m³/s" if step.leak.value else "sealed"
            draw_flow(lower, step.leak.field, step.film, scale, title=rate)
        # One bar beside each row.
        add_bar(axes[0, -1], gaps)
        add_bar(axes[1, -1], scale)


def main(
    scene: Path = FIRST_SCENE,
    loads: int = 5,
    out: Path = Path("out"),
    changes: tuple[str, ...] = ("surface.shape=[128, 128]",),
) -> list[Loaded]:
    """Close the contact, draw `closing.png`, check the claims above."""
    steps = loaded(scene, list(changes), loads)
    for step in steps:
        print(
            f"{with_prefix(step.pressure, 'Pa', 4):>10}  "
            f"{per_cent(step.film.contact_area_fraction):>6} in contact  {step.leak}"
        )
    draw(steps, out / "closing.png")
    # The last load alone seals, and each gap that is nowhere wider leaks less, beyond the bounds.
    assert [step.film.sealed for step in steps] == [False] * (loads - 1) + [True]
    for light, heavy in pairwise(steps):
        assert heavy.film.contact_area_fraction > light.film.contact_area_fraction
        assert heavy.leak.upper < light.leak.lower
    return steps


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="gap and flow as the load rises until it seals")
    parser.add_argument("scene", type=Path, nargs="?", default=FIRST_SCENE)
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("out"))
    parser.add_argument("--set", dest="changes", action="append", default=[], metavar="KEY=VALUE")
    main(**vars(parser.parse_args()))
