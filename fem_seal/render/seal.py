"""Picture of a seal: pressures and conductivity along the path, and K of every patch."""

from pathlib import Path

import numpy as np

from fem_seal.upscaling.seal import SealLeak


def seal_picture(seal: SealLeak, path: str | Path) -> Path:
    """Draw P(x), p(x) and K(x) of a patch of middling leak rate, and K against the net load.

    Parameters
    ----------
    seal : SealLeak
        Leak rate of a seal.
    path : str or Path
        PNG file to write.

    Returns
    -------
    Path
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    (pressures, loads), (conductivity, _) = axes = figure.subplots(2, 2, width_ratios=(1.2, 1))
    grid = axes[0, 1].get_gridspec()
    loads.remove()
    axes[1, 1].remove()
    loads = figure.add_subplot(grid[:, 1])
    by_rate = sorted(seal.patches, key=lambda one: one.flow.value)
    leaking = [one.flow.path for one in by_rate if one.flow.path is not None]
    if leaking:
        middle = leaking[len(leaking) // 2]
        x = 1e3 * middle.x
        pressures.plot(x, 1e-6 * middle.contact_pressure, "k", label="contact pressure P")
        pressures.plot(x, 1e-6 * middle.fluid_pressure, "tab:blue", label="fluid pressure p")
        pressures.fill_between(
            x,
            1e-6 * middle.fluid_pressure,
            1e-6 * middle.contact_pressure,
            where=middle.contact_pressure > middle.fluid_pressure,
            color="0.9",
            label="carried by the solid",
        )
        closed = np.isfinite(middle.conductivity) & (middle.conductivity > 0)
        K = np.where(closed, middle.conductivity, np.nan)
        conductivity.semilogy(x, K, "tab:red")
        pressures.legend(fontsize=8)
    pressures.set(ylabel="pressure [MPa]", title="along the leak path, from inlet to outlet")
    conductivity.set(xlabel="x [mm]", ylabel="K(P - p) [m³/(Pa s)]")
    for number, one in enumerate(seal.patches):
        if one.table is None:
            continue
        table, colour = one.table, f"C{number % 10}"
        open_ = table.upper > 0
        w = 1e-6 * table.loads
        lower, upper, value = (K[open_] for K in (table.lower, table.upper, table.value))
        loads.fill_between(w[open_], lower, upper, color=colour, alpha=0.3)
        loads.plot(w[open_], value, ".-", color=colour, lw=0.8)
        if not open_.all():
            # Where the patch is known to be sealed.
            loads.axvline(w[np.argmin(open_)], color=colour, ls=":", lw=0.8)
    loads.set(
        yscale="log",
        xlabel="net load P - p [MPa]",
        ylabel="K [m³/(Pa s)]",
        title="every patch; dotted: sealed",
    )
    path = Path(path)
    figure.savefig(path, dpi=120)
    return path
