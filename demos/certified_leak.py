# %% [markdown]
# # How many unknowns does a certain leak rate need?
#
# An elastic contact not far from percolation is a few narrow constrictions in a labyrinth. The
# fluid in its gap g has the pressure p and, with Δp = 1, the leak rate Q of
#
#     strong: ∇·(K ∇p) = 0,  K = g³/(12 η),  p = Δp at the inlet, 0 at the outlet,
#     weak: ∫ K ∇p·∇q dA = 0 for all q that are 0 at inlet and outlet,
#     dual: ∫ (1/K) ∇ψ·∇φ dA = 0 for all φ without flux; ψ has unit flux.
#
# Each weak form is that of a least energy: Q Δp = min ∫ K|∇p|² dA (Dirichlet), and 1/Q = min ∫
# |∇ψ|²/K dA over stream functions, constant in contact (Thomson). With exact averages of g³ and
# 1/g³ on every triangle both hold on any mesh: lower ≤ Q ≤ upper is a fact about the gap and not
# an extrapolation. Two ways to spend unknowns are compared: the adaptive mesh, and the pixel mesh
# refined uniformly.
#
# Expected: once all channels are open the half-width falls as 1/unknowns (the energy of linear
# elements errs by h², and adaptive meshes keep that order beside contact). The number of CG
# iterations grows neither with the mesh nor with the contrast of K, since multigrid preconditions
# the system and each mesh starts from the last solution.
# `mpirun -n 2 python demos/certified_leak.py` shares the flow between two processes.

# %%
from pathlib import Path

import numpy as np

from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, Limits, leak_rate
from fem_seal.grid import GridField
from fem_seal.leak_rate import LevelRecord, relative_width
from fem_seal.render.convergence import draw_bounds
from fem_seal.render.plot import new_figure
from fem_seal.surface import Spectrum, self_affine

SIDES = "periodic"
WATER = {"viscosity": 1e-3, "pressure_drop": 1e5}


# %% [markdown]
# ## The gap
# A self-affine surface (H = 0.8, shortest wavelength 4 samples) pressed into a rubber until 40 %
# of it touch. Between the samples the gap is linear on the triangles of the pixel grid.


# %%
def near_percolation(n: int) -> GridField:
    """Elastic gap of 100 µm × 100 µm on n × n samples at A/A0 = 0.4."""
    length = 100e-6
    spectrum = Spectrum(0.8, length / 8, 4 * length / n)
    height = self_affine(spectrum, (n, n), (length, length), rms_slope=0.1, seed=3)
    return press(height, ElasticSolid(10e6), Load("area_fraction", 0.4)).gap


def compare(
    gap: GridField, rtol: float, grids: int
) -> tuple[tuple[LevelRecord, ...], tuple[LevelRecord, ...]]:
    """Levels of the adaptive mesh, refined to `rtol`, and of `grids` uniform ones."""
    film, most = GridFilm(gap, SIDES), 4 ** (grids - 1) * gap.values.size
    adaptive = leak_rate(film, FlowSettings(rtol=rtol, **WATER), every_dual=True)
    uniform = leak_rate(
        film, FlowSettings(method="uniform", rtol=rtol, limits=Limits(unknowns=most), **WATER)
    )
    return adaptive.levels, uniform.levels


def refined_at(contrast: float, n: int) -> tuple[LevelRecord, ...]:
    """Meshes of n², 4 n² and 16 n² squares of a smooth gap whose K = g³ spans a contrast."""
    wave = np.cos(2 * np.pi * np.arange(n) / n)
    gap = GridField(1e-6 * contrast ** (np.outer(wave, wave) / 6), (1e-6, 1e-6), periodic=True)
    limits = Limits(unknowns=17 * n**2)
    settings = FlowSettings(method="uniform", rtol=1e-6, limits=limits, **WATER)
    return leak_rate(GridFilm(gap, SIDES), settings, every_dual=True).levels


def draw(adaptive: tuple[LevelRecord, ...], uniform: tuple[LevelRecord, ...], path: Path) -> None:
    """Left: bounds; right: their half-width. The uniform mesh is dotted."""
    shown = [level for level in uniform if level.lower > 0]
    n, style = [level.unknowns for level in shown], {"markersize": 4}
    with new_figure((11, 4.6), path) as figure:
        draw_bounds(figure, adaptive)
        rates, widths = figure.axes
        for end, marker in (("lower", "^"), ("upper", "v")):
            rates.plot(n, [getattr(level, end) for level in shown], f"k{marker}:", **style)
        widths.plot(n, [level.half_width for level in shown], "ks:", label="uniform", **style)
        widths.legend(frameon=False)


# %% [markdown]
# ## What to notice
# * The brackets of all levels, adaptive and uniform, have a common point: the leak rate.
# * The adaptive half-width falls faster than 1/unknowns (thin line) while channels still open, and
#   like it in the end. At the rate of its last two grids the uniform mesh would need hundreds of
#   times more for the same certainty; most of them lie in wide channels where nothing happens.
# * On a smooth gap CG takes at most seven iterations, and two on finer meshes, whether K spans two
#   decades or twelve.
# * Once the half-width is below 10 %, the geometric mean of the bounds is several times nearer to
#   the leak rate than the certificate says.


# %%
def main(
    out: Path = Path("out"), n: int = 256, rtol: float = 0.02, grids: int = 2, smooth: int = 64
) -> tuple[float, float]:
    """Compare, draw `certified_leak.png`, check the claims; the bracket of the leak rate [m³/s]."""
    adaptive, uniform = compare(near_percolation(n), rtol, grids)
    draw(adaptive, uniform, out / "certified_leak.png")
    lower = max(level.lower for level in adaptive + uniform)
    upper = min(level.upper for level in adaptive + uniform)
    best = adaptive[-1]
    assert lower <= upper
    assert relative_width(best.lower, best.upper) <= rtol
    early = next(level for level in adaptive if 0 < level.half_width < 0.5)
    assert best.half_width * best.unknowns < early.half_width * early.unknowns
    print("level  unknowns  half-width  CG iterations primal/dual")
    for k, level in enumerate(adaptive):
        primal, dual = level.iterations["primal"], level.iterations.get("dual", 0)
        print(f"{k:5}{level.unknowns:10}{100 * level.half_width:10.2f} %{primal:9}/{dual}")
        assert max(primal, dual) <= 10  # energies to 1e-8: a factor of six or more by each
        # Only where the best bracket is narrow enough to show the error of the mean.
        if 1.5 * best.half_width < level.half_width < 0.1:
            error = np.sqrt(level.lower * level.upper / (lower * upper)) - 1
            assert 3 * abs(error) < level.half_width
    # Unknowns of a uniform mesh for the adaptive half-width, extrapolated from the last two grids.
    u, v = uniform[-2:]
    slope = np.log(u.half_width / v.half_width) / np.log(v.unknowns / u.unknowns)
    needed = v.unknowns * (v.half_width / best.half_width) ** (1 / slope)
    assert needed > 100 * best.unknowns  # hundreds, as said above
    print(f"leak rate in [{lower:.4e}, {upper:.4e}] m³/s")
    print(f"adaptive: {best.unknowns} unknowns for ±{100 * best.half_width:.2f} %")
    times = f"{needed:.1e} for the same, {needed / best.unknowns:.0f} times more"
    print(f"uniform:  {v.unknowns} unknowns for ±{100 * v.half_width:.2f} %, about {times}")
    # Energies to 1e-8: each of seven iterations gains a factor of 14, and a start from the last
    # mesh is worth five of them.
    print(f"contrast  CG iterations primal/dual at {smooth}², {2 * smooth}², {4 * smooth}² squares")
    for contrast in (1e2, 1e6, 1e12):
        levels = refined_at(contrast, smooth)
        counts = [(level.iterations["primal"], level.iterations["dual"]) for level in levels]
        print(f"{contrast:8.0e}  " + "  ".join(f"{primal}/{dual}" for primal, dual in counts))
        assert len(counts) == 3
        assert max(counts[0]) <= 7
        assert max(max(finer) for finer in counts[1:]) <= 2
    return lower, upper


if __name__ == "__main__":
    main()
