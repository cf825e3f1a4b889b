# %% [markdown]
# # Which gas leaks more?
#
# Through a gap of a few mean free paths λ a gas slips along the walls. A channel of height g
# carries
#
#     throughput / Δp = W/L (g³ p + B g²)/(12 η),     B = 6 λ p = 6 η √(π R T / 2 M),
#
# with p the mean pressure (ideal gas, first order in λ/g, full accommodation). The first term,
# viscous flow, grows with the pressure; of the gas it contains only the viscosity η. The second one
# does not depend on the pressure; of the gas it contains only the molar mass M.
#
# Where λ/g passes a twentieth, first order is too low. Kinetic theory replaces g³ p + B g² by
# B g² c(g p/B), with the flow between parallel walls from the linearised Boltzmann equation (BGK
# model): c = 1 + t to first order, a minimum (Knudsen's) near λ = g, and the logarithm of λ/g
# beyond, from molecules that fly along the gap.
#
# In a rough gap ∇·((g³ p + B g²)/(12 η) ∇p) = 0, weakly ∫ (g³ p + B g²)/(12 η) ∇p·∇q dA = 0 for all
# q that are 0 at both ends. Two linear problems enclose the leak rate: these are the bounds below.
# `mpirun -n 2 python demos/gas_that_slips.py` shares each flow between two processes.

# %%
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_seal.patch import Patch
from fem_seal.render.plot import new_figure
from fem_seal.scene import Scene

SCENE = Scene.from_file(Path(__file__).parent / "scenes" / "helium.toml")
GASES = {"helium": (19.6e-6, 4.0026e-3), "nitrogen": (17.6e-6, 28.014e-3)}  # η [Pa s], M [kg/mol]


# %% [markdown]
# ## One rough gap
# Steel with a roughness of 0.2 um, cut at a plane so that a fifth of the area touches, as in
# `fem-seal run demos/scenes/helium.toml`, which is a leak test with helium against a vacuum.


# %%
def patch(n: int, gas: str, slip: str | bool, pressure: float, rtol: float) -> Patch:
    """The scene with a gas at a mean pressure [Pa], the inlet's twice the outlet's."""
    viscosity, molar_mass = GASES[gas]
    settings = {
        "surface.shape": [n, n],
        "fluid.viscosity": viscosity,
        "fluid.molar_mass": molar_mass,
        "fluid.slip": slip,
        "flow.inlet_pressure": pressure / 0.75,
        "flow.outlet_pressure": pressure / 1.5,
        "flow.rtol": rtol,
        "limit": None,  # the flow would stop once it is decided
    }
    return Patch(SCENE.with_(settings))


@dataclass(frozen=True)
class Point:
    """Throughput over pressure drop [m³/s] at a mean pressure [Pa], with bounds (kinetic slip)."""

    pressure: float
    lower: float
    upper: float
    first_order: float
    without_slip: float


def conductance(n: int, gas: str, pressure: float, rtol: float) -> Point:
    """Leak rates at a mean pressure by three laws of slip."""
    kinetic, first_order, without = (
        patch(n, gas, slip, pressure, rtol) for slip in ("kinetic", "first-order", False)
    )
    per = kinetic.scene.drive.rates["throughput"] / (pressure / 1.5)
    rates = *kinetic.leak_rate.bounds, first_order.leak_rate.value, without.leak_rate.value
    return Point(pressure, *(rate * per for rate in rates))


# %% [markdown]
# ## From viscous to molecular
# Dotted is first order, dashed what would flow without slip. Bounds are hardly wider than the line.


# %%
def draw(curves: dict[str, list[Point]], path: Path) -> None:
    """Conductance of both gases against the mean pressure."""
    with new_figure((6, 4), path) as figure:
        axes = figure.subplots()
        for (gas, points), colour in zip(curves.items(), ("tab:blue", "tab:red"), strict=True):
            p = [point.pressure for point in points]
            kinetic = [np.sqrt(point.lower * point.upper) for point in points]
            axes.plot(p, kinetic, color=colour, label=gas)
            axes.plot(p, [point.first_order for point in points], ":", color=colour)
            axes.plot(p, [point.without_slip for point in points], "--", color=colour)
        lowest = min(point.lower for points in curves.values() for point in points)
        axes.set(xscale="log", yscale="log", ylim=(lowest / 3, None))
        axes.set(xlabel="mean pressure [Pa]", ylabel="throughput / pressure drop [m³/s]")
        axes.legend(title="kinetic slip\n(dotted: first order, dashed: none)")


# %% [markdown]
# ## What to notice
# * At high pressure helium leaks 17.6/19.6 = 0.90 times as much as nitrogen. At low pressure it is
#   √(28.014/4.0026) = 2.65 times to first order, and a little more by kinetic theory: helium's mean
#   free path is three times as long, so that the logarithm of it is larger.
# * First order is flat at low pressure. Kinetic theory has Knudsen's minimum there and rises again.
# * Where the flow is linear in p or in p², the bounds are as narrow as without slip. In between the
#   slip makes them a few per cent wider.


# %%
def main(
    out: Path = Path("out"), n: int = 64, rtol: float = 0.05, points: int = 8
) -> dict[str, list[Point]]:
    """Compute both curves, draw `gas_that_slips.png` into `out`, check the claims above."""
    pressures = np.geomspace(1e1, 1e8, points)
    curves = {gas: [conductance(n, gas, p, rtol) for p in pressures] for gas in GASES}
    draw(curves, out / "gas_that_slips.png")
    helium, nitrogen = curves.values()
    thinner, root = np.divide(GASES["nitrogen"], GASES["helium"]) ** (1, 0.5)
    for place, least, most in ((0, root, 1.2 * root), (-1, thinner, thinner)):
        low = helium[place].lower / nitrogen[place].upper
        high = helium[place].upper / nitrogen[place].lower
        # At the highest pressure slip is 6 λ/g of the flow: λ = 0.2 nm of helium, g = 0.25 µm.
        assert low / 1.005 <= most
        assert least <= high * 1.005
        print(f"helium leaks {low:.3f} to {high:.3f} times as much at {pressures[place]:.0e} Pa")
    widths = []
    for gas, curve in curves.items():
        lower, upper = ([getattr(point, name) for point in curve] for name in ("lower", "upper"))
        widths += list(np.log(np.divide(upper, lower)))
        # Knudsen's minimum: somewhere in between the leak rate is lower than at both ends.
        least = int(np.argmin(upper))
        assert upper[least] < min(lower[0], lower[-1])
        print(f"{gas} leaks least at about {pressures[least]:.0e} Pa")
        # Kinetic theory lies above first order, to the accuracy of the bounds.
        assert all(point.upper > point.first_order / (1 + rtol) for point in curve)
        # Without slip the flow would vanish with the pressure.
        assert curve[0].without_slip < 1e-3 * curve[0].lower
    # Slip widens the bounds beyond the tolerance: by 0.05, as was seen, or up to twice that.
    assert max(widths) < rtol + 0.1
    print(f"bounds at most ±{50 * max(widths):.1f} % wide")
    return curves


if __name__ == "__main__":
    main()
