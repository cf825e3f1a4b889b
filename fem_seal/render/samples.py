"""Pictures of fields on the samples of a film: contact, gap, pressures of solid and fluid.

`contact_picture` is like Fig. 1 of the letter (PRL 108, 244301, 2012), `lift_picture` shows the dry
contact and the lifted one, `sensitivity_picture` where a nanometre of height matters.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import in_digits, readable, with_prefix
from fem_seal.errors import InvalidInput
from fem_seal.film.clusters import label, largest
from fem_seal.film.grid_film import GridFilm
from fem_seal.film.lattice import DUAL_CONNECTIVITY, Lattice
from fem_seal.grid import GridField
from fem_seal.render.colours import CONTACT, OPEN, Swatch
from fem_seal.render.page import (
    ISOLINES,
    Window,
    add_bar,
    draw_samples,
    frame_film,
    page,
    window_of,
)
from fem_seal.render.scale import Scale, logarithmic_scale, pressure_scale, step_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Contact is grey, open is blue or green; the largest spot and channel are darker than the others.
CONTACT_KEY = (
    Swatch("other contact", CONTACT.colour),
    Swatch("largest contact spot", (70, 72, 76)),
    Swatch("other open", OPEN.colour),
    Swatch("largest open channel", (110, 180, 150)),
)
GAP_COLOURS, CONTACT_PRESSURE_COLOURS = "gap", "contact pressure"
# Lengths of the bars.
GAP_DECADES = SENSITIVITY_DECADES = 3
POCKET = Swatch("pocket: its fluid pressure is assumed", (246, 222, 150))
# Part of the contact whose pressure lies within the colour bar; single peaks lie above it.
SHOWN = 0.999
# Contact is coloured where its own pressure is drawn, and grey where gap and fluid are.
LIFT_KEY = (
    Swatch("contact (gap and fluid pressure)", CONTACT.colour),
    Swatch("open (contact pressure)", OPEN.colour),
    POCKET,
)
SENSITIVITY = "|change of ln Q| for 1 nm of height on 1 µm²"
NANOMETRE, SQUARE_MICROMETRE = 1e-9, 1e-12  # in m and m²
LIFT_SIDE = 3.0  # longer side of each of the four drawings of a lift [inch]


def contact_classes(sites: Lattice) -> np.ndarray:
    """Index in CONTACT_KEY of every site, uint8 of the shape of sites.gap.

    The connectivities of contact and open sites are dual: at most one of the two largest clusters
    spans.
    """
    classes = np.where(sites.open, np.uint8(2), np.uint8(0))
    phases = (
        (~sites.open, DUAL_CONNECTIVITY[sites.connectivity]),
        (sites.open, sites.connectivity),
    )
    for mask, connectivity in phases:
        classes[largest(*label(mask, connectivity, sites.periodic))] += 1
    return classes


def draw_contact(
    axes: "Axes", film: GridFilm, *, window: Window | None = None, title: str = ""
) -> None:
    """Draw contact and open domains, whole or in part; see `contact_picture`."""
    frame_film(axes, film, window, title)
    palette = np.array([(*swatch.colour, 255) for swatch in CONTACT_KEY], dtype=np.uint8)
    draw_samples(axes, film, palette[film.sites.on_samples(contact_classes(film.sites))])


def contact_picture(film: GridFilm, path: str | Path) -> None:
    """Picture of contact (gap exactly 0) and open domains, the largest cluster of each in colour.

    Clusters are connected across the periodic sides of the film; `path` ends in .png, .pdf or .svg.
    """
    with page(window_of(film), path, key=CONTACT_KEY) as axes:
        draw_contact(axes[0, 0], film)


def gap_scale(*gaps: np.ndarray) -> Scale:
    """One logarithmic scale for all gaps [m]; no gap lies above its end."""
    values = np.concatenate([gap.ravel() for gap in gaps])
    values = values[values > 0]
    if not values.size:
        raise InvalidInput("the gap is zero everywhere: there is no open place to draw")
    factor, unit = readable(float(values.max()), "m")
    return logarithmic_scale(f"gap [{unit}]", values, GAP_DECADES, GAP_COLOURS, factor)


def draw_gap(axes: "Axes", film: GridFilm, scale: Scale | None, *, title: str = "") -> None:
    """Draw the gap on a scale from `gap_scale`; a gap that is 0 everywhere has none."""
    frame_film(axes, film, title=title, marked=True)
    gap = film.sites.on_samples(film.sites.gap)
    scale = scale or Scale("", 0.0, 1.0)
    draw_samples(axes, film, scale.paint(gap, gap > 0, CONTACT.colour))


def gap_picture(film: GridFilm, path: str | Path) -> None:
    """Picture of the gap on a logarithmic scale, contact in grey, the critical constriction marked.

    `path` ends in .png, .pdf or .svg.
    """
    scale = gap_scale(film.gap.values) if film.largest_gap > 0 else None
    with page(window_of(film), path, key=(CONTACT,)) as axes:
        draw_gap(axes[0, 0], film, scale)
        add_bar(axes[0, 0], scale)


def contact_pressure_scale(pressure: np.ndarray) -> Scale | None:
    """Linear scale from 0 in a readable unit; None if nothing touches."""
    carried = pressure[pressure > 0]
    if not carried.size:
        return None
    highest = step_above(float(np.quantile(carried, SHOWN)))
    factor, unit = readable(highest, "Pa")
    name, beyond = f"contact pressure [{unit}]", "neither"
    if carried.max() > highest:
        name, beyond = f"{name}, peaks to {in_digits(factor * carried.max(), 2)}", "max"
    return Scale(
        name, 0.0, highest * factor, False, CONTACT_PRESSURE_COLOURS, beyond, per_si=factor
    )


def draw_contact_pressure(
    axes: "Axes", film: GridFilm, pressure: GridField, title: str = ""
) -> None:
    """Draw the contact pressure with a bar of its own; see `contact_pressure_picture`."""
    frame_film(axes, film, None, title)
    values, scale = film.sampled(pressure), contact_pressure_scale(pressure.values)
    shown = (scale or Scale("", 0.0, 1.0)).paint(values, values > 0, OPEN.colour)
    draw_samples(axes, film, shown)
    add_bar(axes, scale)


def contact_pressure_picture(film: GridFilm, pressure: GridField, path: str | Path) -> None:
    """Picture of the pressure [Pa] between the solids, pale blue where they do not touch.

    In a lifted contact it is the excess over the fluid's pressure. `path` ends in .png, .pdf or
    .svg.
    """
    with page(window_of(film), path, key=(OPEN,)) as axes:
        draw_contact_pressure(axes[0, 0], film, pressure)


def draw_fluid_pressure(axes: "Axes", film: GridFilm, pressure: GridField, title: str = "") -> None:
    """Draw the fluid's pressure above ambient [Pa], continued to contact, with isobars and a bar.

    Pockets have a colour of their own: no fluid moves there, and nothing determines its pressure.
    """
    samples = film.sampled(pressure).copy()
    if len(samples) > len(pressure.values):
        # The last row repeats the samples at the inlet, but the outlet has the lowest pressure.
        samples[-1] = samples.min()
    scale = pressure_scale("fluid pressure above ambient", samples)
    frame_film(axes, film, None, title, marked=True)
    wet = (film.sites.on_samples(film.sites.gap) > 0) & ~film.pockets
    colours = scale.paint(samples, wet, CONTACT.colour)
    colours[film.pockets] = (*POCKET.colour, 255)
    draw_samples(axes, film, colours)
    add_bar(axes, scale)
    shown = np.where(wet, scale.per_si * samples, np.nan)
    lines = [level for level in scale.lines if (shown < level).any() and (shown > level).any()]
    if lines and min(shown.shape) > 1:
        (x0, y0), (dx, dy), (nx, ny) = film.sites.origin, film.sites.spacing, shown.shape
        x, y = x0 + dx * np.arange(nx), y0 + dy * np.arange(ny)
        axes.contour(x, y, shown.T, levels=lines, **ISOLINES)


def lift_picture(
    lifted: GridFilm,
    dry: GridFilm,
    contact_pressure: GridField,
    fluid_pressure: GridField,
    path: str | Path,
) -> None:
    """Four pictures of a lift: gap, dry and lifted, and the pressures [Pa] of solid and fluid.

    Of a sealed film the fluid's part of the load is an assumption: its pressure is known up to the
    place where it is sealed and behind it; a film of next to no height gives that in between.
    """
    gaps = [film.gap.values for film in (dry, lifted)]
    scale = gap_scale(*gaps) if any(gap.any() for gap in gaps) else None
    key = LIFT_KEY if lifted.pockets.any() else LIFT_KEY[:2]
    with page(window_of(lifted), path, shape=(2, 2), side=LIFT_SIDE, key=key) as axes:
        for place, film, name in zip(axes[0], (dry, lifted), ("dry", "lifted"), strict=True):
            area = f"{100 * film.contact_area_fraction:.3g} % in contact"
            draw_gap(place, film, scale, title=f"{name}: {area}")
            add_bar(place, scale)
        means = (field.values.mean() for field in (contact_pressure, fluid_pressure))
        solid, fluid = (f"{with_prefix(mean, 'Pa', 3)} on average" for mean in means)
        draw_contact_pressure(axes[1, 0], lifted, contact_pressure, f"the solid carries {solid}")
        assumed = ", by assumption" * lifted.sealed
        title = f"the fluid carries {fluid}{assumed}"
        draw_fluid_pressure(axes[1, 1], lifted, fluid_pressure, title)


def sensitivity_picture(film: GridFilm, by_height: GridField, path: str | Path) -> None:
    """Picture of |∂ ln Q/∂h| [1/m] per area, logarithmic; the tightest place is marked."""
    dx, dy = by_height.spacing
    size = NANOMETRE * SQUARE_MICROMETRE / (dx * dy) * np.abs(film.sampled(by_height))
    scale = logarithmic_scale(SENSITIVITY, size, SENSITIVITY_DECADES, "flow")
    with page(window_of(film), path) as axes:
        frame_film(axes[0, 0], film, None, "Where a nanometre matters", marked=True)
        draw_samples(axes[0, 0], film, scale.paint(size, size > 0, CONTACT.colour))
        add_bar(axes[0, 0], scale)
