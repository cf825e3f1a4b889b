# %% [markdown]
# # How are contact and flow solved together?
#
# The fluid's pressure p_f opens the gap of the contact, which carries the rest of the load P₀,
#
#     g = S (p_c + p_f) - h + const ≥ 0,  p_c ≥ 0,  p_c g = 0,  mean(p_c + p_f) = P₀:  g = G(p_f),
#
# and the gap determines the pressure of the flow,
#
#     ∇·((g³ + ε³)/(12 η) ∇p_f) = 0,  p_f = p_in at the inlet, p_out at the outlet:  p_f = R(g);
#     weak: ∫ (g³ + ε³)/(12 η) ∇p_f·∇q dA = 0 for all q that are 0 at inlet and outlet.
#
# An equilibrium is a zero of F(p_f) = R(G(p_f)) - p_f. Newton's method finds it in a few steps,
# each of which solves (I - R' G') δ = F (docs/theory/lift.md). Here it starts from the outlet's
# pressure everywhere, and from the inlet's. Claim: both starts settle, in one state, to what both
# claim.
#
# It runs in one process: Newton's method runs on the first alone, and the flows are small.

# %%
from math import log
from pathlib import Path

import numpy as np

from fem_seal import Scene
from fem_seal.coupling import LiftedState, lifted_state
from fem_seal.lifting import lifting_problem
from fem_seal.patch import Patch
from fem_seal.progress import silent
from fem_seal.render.plot import new_figure

SCENE = Scene.from_file(Path(__file__).parent / "scenes" / "first.toml")
LOADS = (0.1e6, 0.15e6, 0.2e6)  # Pa; the inlet has 0.1 MPa
TOLERANCE = SCENE.flow.rtol


# %% [markdown]
# ## One load, two starts


# %%
def both(load: float, n: int) -> tuple[LiftedState, LiftedState]:
    """States from the outlet's and from the inlet's pressure, on n × n samples."""
    waves = {"surface.shape": [n, n], "surface.short_wavelength": 4 * SCENE.surface.size[0] / n}
    scene = SCENE.with_(waves | {"contact.pressure": load, "output.products": ["leak_rate"]})
    surface = Patch(scene).surface
    problem = lifting_problem(scene, scene.load, scene.flow_settings, surface, silent)
    ends = problem.outlet, problem.largest_start
    low, high = (lifted_state(problem, start=np.full(surface.shape, pressure)) for pressure in ends)
    return low, high


# %% [markdown]
# ## Comparison


# %%
def main(out: Path = Path("out"), n: int = 128) -> list[tuple[LiftedState, LiftedState]]:
    """Solve from both starts, compare, and draw |F| against the step."""
    pairs = [both(load, n) for load in LOADS]
    for load, (low, high) in zip(LOADS, pairs, strict=True):
        apart = abs(log(low.leak_rate.value / high.leak_rate.value))
        print(
            f"{load / 1e6:g} MPa: {low.leak_rate.value:.4g} m^3/s in {low.steps} and {high.steps} "
            f"steps, apart by {100 * apart:.2g} %"
        )
        assert low.converged
        assert high.converged
        assert apart <= low.error + high.error + TOLERANCE
    with new_figure((7, 4.2), out / "newton.png") as figure:
        axes = figure.subplots()
        for number, (load, (low, high)) in enumerate(zip(LOADS, pairs, strict=True)):
            colour, name = f"C{number}", f"{load / 1e6:g} MPa"
            axes.semilogy(low.residuals, "o-", color=colour, label=f"{name}, outlet pressure")
            hollow = {"fillstyle": "none", "label": f"{name}, inlet pressure"}
            axes.semilogy(high.residuals, "o--", color=colour, **hollow)
        axes.set(xlabel="Newton's step", ylabel="rms of F over the pressure drop")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.set_title("A few steps bring contact and flow together")
        axes.legend(title="load, and fluid pressure at the start")
    return pairs


if __name__ == "__main__":
    main()
