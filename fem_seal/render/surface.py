"""Figure of a surface before it is pressed: heights, and spectrum with the fitted power law."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable, with_error
from fem_seal.grid import GridField
from fem_seal.render.page import Window, frame
from fem_seal.render.plot import label_axis, new_figure
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
        spikes = np.nonzero(prepared.outliers)
        x, y = ((k + 0.5) * d for k, d in zip(spikes, measured.spacing, strict=True))
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
    along_x, along_y = field.covered
    window = Window(0.0, along_x, 0.0, along_y)
    frame(axes, window, along_x=", flow →")
    image = axes.imshow(
        heights.T * scale, origin="lower", extent=window, aspect="auto", interpolation="nearest"
    )
    image.set_clim(low * scale, high * scale)
    figure.colorbar(image, ax=axes, label=f"height [{unit}]", shrink=0.85, extend="both")


def draw_spectrum(axes: "Axes", fit: SpectrumFit) -> None:
    """Draw the ring averages of the spectrum, the fitted power law and its cut-offs."""
    rings = fit.spectrum
    # Omit densities far below the power law, which are rounding errors.
    shown = rings.density > 1e-4 * fit.density.min()
    axes.loglog(rings.wavenumber[shown], rings.density[shown], ".", color=RINGS, label="surface")
    name = f"H = {with_error(fit.hurst, fit.hurst_error)}"
    axes.loglog(fit.wavenumber, fit.density, color=FITTED, label=name)
    for cut_off, style, wavelength in (
        ("long cut-off", "--", fit.long_wavelength),
        ("roll-off", ":", fit.rolloff_wavelength),
        ("short cut-off", "-.", fit.short_wavelength),
    ):
        if wavelength is not None:
            scale, unit = readable(wavelength, "m")
            axes.axvline(
                2 * np.pi / wavelength,
                color=CUT_OFF,
                linestyle=style,
                linewidth=1,
                label=f"{cut_off} {wavelength * scale:.3g} {unit}",
            )
    axes.set(xlabel="wavenumber q [1/m]", ylabel="spectrum C(q) [m⁴]")
    label_axis(axes.xaxis)
    # Lines of cut-offs may stand anywhere in the axes: the key stands below.
    below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14)}
    axes.legend(fontsize=8, ncols=2, frameon=False, **below)
