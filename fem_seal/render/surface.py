"""Figure of a surface before it is pressed: heights, and spectrum with the fitted power law."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable, with_error
from fem_seal.grid import GridField
from fem_seal.render.plot import new_figure
from fem_seal.surface import PreparedSurface, SpectrumFit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RINGS, FITTED, CUT_OFF, SPIKE = "0.55", "#b2452b", "#1f4e9e", "#e03010"
CLIPPED = 1e-3  # part of the heights at each end that share the last colour


def surface_figure(prepared: PreparedSurface, fit: SpectrumFit | None, path: str | Path) -> None:
    """Draw heights as they are pressed and, with a fit, their spectrum; the suffix is the format.

    Spikes are circled where they were measured; a mirrored map begins with the measured one.
    """
    panels = 1 if fit is None else 2
    with new_figure((5.0 * panels, 3.9), path) as figure:
        all_axes = np.ravel(figure.subplots(1, panels))
        draw_heights(figure, all_axes[0], prepared.field)
        measured = prepared.measured
        length_scale, _ = readable(max(prepared.field.size), "m")
        x, y = (
            (k + 0.5) * d * length_scale
            for k, d in zip(np.nonzero(prepared.outliers), measured.spacing, strict=True)
        )
        if len(x) and prepared.steps[-1].name != "twin":
            all_axes[0].scatter(x, y, s=40, facecolors="none", edgecolors=SPIKE, label="spikes")
            all_axes[0].legend(loc="lower right", bbox_to_anchor=(1, 1), frameon=False, fontsize=8)
        if fit is not None:
            draw_spectrum(all_axes[1], fit)


def draw_heights(figure: "Figure", axes: "Axes", field: GridField) -> None:
    """Draw the heights above their mean in colours; the flow runs to the right.

    The colours leave out the `CLIPPED` highest and lowest heights, which single spikes may be.
    """
    heights = field.values - field.values.mean()
    low, high = np.quantile(heights, [CLIPPED, 1 - CLIPPED])
    scale, unit = readable(float(max(-low, high)), "m")
    length_scale, length_unit = readable(max(n * d for n, d in _sides(field)), "m")
    along_x, along_y = (n * d * length_scale for n, d in _sides(field))
    extent = 0.0, along_x, 0.0, along_y
    image = axes.imshow(
        heights.T * scale, origin="lower", extent=extent, cmap="viridis", interpolation="nearest"
    )
    image.set_clim(low * scale, high * scale)
    axes.set_title("flow ⟶", loc="left", fontsize="medium")
    axes.set(xlabel=f"x [{length_unit}]", ylabel=f"y [{length_unit}]")
    figure.colorbar(image, ax=axes, label=f"height [{unit}]", shrink=0.85, extend="both")


def draw_spectrum(axes: "Axes", fit: SpectrumFit) -> None:
    """Draw the ring averages of the spectrum, the fitted power law and its cut-offs."""
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator

    rings = fit.spectrum
    # Omit densities far below the power law, which are rounding errors.
    shown = rings.density > 1e-4 * fit.density.min()
    axes.loglog(rings.wavenumber[shown], rings.density[shown], ".", color=RINGS, label="surface")
    name = f"H = {with_error(fit.hurst, fit.hurst_error)}"
    axes.loglog(fit.wavenumber, fit.density, color=FITTED, label=name)
    for cut_off, wavelength in (
        ("long cut-off", fit.long_wavelength),
        ("roll-off", fit.rolloff_wavelength),
        ("short cut-off", fit.short_wavelength),
    ):
        if wavelength is not None:
            scale, unit = readable(wavelength, "m")
            axes.axvline(
                2 * np.pi / wavelength,
                color=CUT_OFF,
                linestyle={"long cut-off": "--", "roll-off": ":", "short cut-off": "-."}[cut_off],
                linewidth=1,
                label=f"{cut_off} {wavelength * scale:.3g} {unit}",
            )
    axes.set(xlabel="wavenumber q [1/m]", ylabel="spectrum C(q) [m⁴]")
    # Wavenumbers often span little more than a decade, and only one power of ten would be labelled.
    axes.xaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    axes.xaxis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(2.5, 2.5)))
    # A spectrum falls, so that its upper right corner is free but for the lines of cut-offs.
    axes.legend(fontsize=8, loc="upper right", framealpha=0.9, edgecolor="none")


def _sides(field: GridField) -> zip:
    """(samples, spacing) along each axis."""
    return zip(field.shape, field.spacing, strict=True)
