"""From a measured map to heights that can be pressed, by steps that are off unless named."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from fem_seal.arguments import require_known
from fem_seal.errors import InvalidInput
from fem_seal.field_file import HEIGHT_NAMES, FieldMap, Stated, read_map
from fem_seal.grid import GridField
from fem_seal.surface.cell import cropped, periodic_cell
from fem_seal.surface.detrending import detrended
from fem_seal.surface.missing import fill
from fem_seal.surface.spikes import outliers, without_outliers
from fem_seal.surface.statistics import Lay, MapStatistics
from fem_seal.surface.synthesis import twin

# Largest seam of a map that counts as periodic. The seam of a rough surface that repeats is about
# 1; that of a single wave whose steepest place is at the seam is √2.
LARGEST_SEAM = 2.0
HIGHEST = 1e100  # largest height [m]; sums of the squares of larger ones may overflow

Crop = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Preparation:
    """Steps of the preparation of a height map, in the order in which they are taken."""

    crop: Crop | None = None  #: ((x0, x1), (y0, y1)) to keep [m]
    outliers: str | None = None  #: "missing": points far from all their neighbours become so
    #: "mean", "plane" or "quadratic", fitted to the points that are not missing and subtracted
    detrend: str | None = None
    fill: str | None = None  #: "harmonic", see `fill`
    max_missing: float = 0.1  #: largest part of the points that may be filled
    make_periodic: str | None = None  #: "cut", "mirror", "hann" or "tukey", see `periodic_cell`
    #: seed of the random phases of a `twin` of the map after all other steps
    twin_seed: int | None = None


@dataclass(frozen=True, eq=False)
class PreparedSurface:
    """Heights to be pressed, with the steps of their preparation."""

    field: GridField  #: heights after all steps [m]
    #: heights [m] before the map was made periodic or replaced by its twin; the spectrum is fitted
    #: to them
    measured: GridField
    steps: tuple[MapStatistics, ...]  #: the map as it was read, and after each step

    @cached_property
    def outliers(self) -> np.ndarray:
        """Points of the map, before it was made periodic, that are spikes."""
        return outliers(self.measured)

    @cached_property
    def lay(self) -> Lay:
        """Slopes and lay of the same map without its spikes."""
        values = np.where(self.outliers, np.nan, self.measured.values)
        return Lay.of(FieldMap(values, self.measured.spacing, self.measured.periodic))

    def require_cell(self, what: str) -> None:
        """Refuse heights, called `what`, that do not repeat: an elastic contact repeats them."""
        if self.field.periodic:
            return
        seam = self.steps[-1].seam
        raise InvalidInput(
            f"{what}: an elastic contact repeats the map, which does not repeat itself (the "
            f"heights jump {seam:.2g} times as much across its border as between neighbours, rms): "
            "set periodic = true if the surface does repeat, detrend = 'plane' if the jump is a "
            "tilt, or make_periodic = 'mirror' (or 'tukey', 'hann', 'cut') to make it a cell"
        )


def measured_surface(
    path: str | Path, stated: Stated | None = None, preparation: Preparation | None = None
) -> PreparedSurface:
    """Read heights [m] and prepare them; docs/guide/surfaces.md names the formats.

    Unit, size and other statements that the file lacks are `stated`. If neither file nor scene
    states whether the map repeats, its seam decides.
    """
    field = read_map(path, HEIGHT_NAMES, stated, heights=True)
    highest = np.abs(field.values[~np.isnan(field.values)]).max(initial=0.0)
    if highest > HIGHEST:
        raise InvalidInput(
            f"heights in {path} reach {highest:.1e} m, whose squares are beyond double precision; "
            "check their unit, or cut out what is not a height"
        )
    try:
        return prepare(field, preparation or Preparation())
    except InvalidInput as error:
        raise InvalidInput(f"heights in {path}: {error}") from None


def prepare(field_map: FieldMap, preparation: Preparation) -> PreparedSurface:
    """Take the steps that are named; the heights are NaN where a point is missing.

    If neither file nor scene states whether the map repeats, it counts as periodic if its seam is
    at most `LARGEST_SEAM`.
    """
    steps = [MapStatistics.of(field_map, "read")]
    for name, prepared in _on_maps(field_map, preparation):
        field_map = prepared
        steps.append(MapStatistics.of(field_map, name))
    if field_map.missing:
        raise InvalidInput(
            f"{field_map.missing} of {field_map.values.size} points are missing; say how to fill "
            "them (fill = 'harmonic'), or crop to where there are none"
        )
    if field_map.periodic and preparation.make_periodic is not None:
        raise InvalidInput("the map repeats already; leave make_periodic out")
    repeats = field_map.periodic
    if repeats is None:
        repeats = steps[-1].seam <= LARGEST_SEAM
    repeats = repeats and preparation.make_periodic is None
    field = measured = GridField(field_map.values, field_map.spacing, repeats)
    for name, cell in _on_fields(field, preparation):
        field = cell
        steps.append(MapStatistics.of(field, name))
    return PreparedSurface(field, measured, tuple(steps))


def _on_maps(heights: FieldMap, plan: Preparation) -> Iterator[tuple[str, FieldMap]]:
    """Name and outcome of each step that is taken while points may be missing."""
    if plan.crop is not None:
        heights = cropped(heights, plan.crop)
        yield "crop", heights
    if plan.outliers is not None:
        require_known(("missing",), plan.outliers, "outliers")
        heights = without_outliers(heights)
        yield f"outliers {plan.outliers}", heights
    # Filled points are no measurements: the trend is that of the others, and holes at a tilted
    # border are filled without the tilt.
    if plan.detrend is not None:
        heights = detrended(heights, plan.detrend)
        yield f"detrend {plan.detrend}", heights
    if plan.fill is not None:
        require_known(("harmonic",), plan.fill, "fill")
        heights = fill(heights, plan.max_missing)
        yield f"fill {plan.fill}", heights


def _on_fields(heights: GridField, plan: Preparation) -> Iterator[tuple[str, GridField]]:
    """Name and outcome of each step that needs all points."""
    cell = heights
    if plan.make_periodic is not None:
        cell = periodic_cell(heights, plan.make_periodic)
        yield plan.make_periodic, cell
    if plan.twin_seed is not None:
        cell = twin(cell, plan.twin_seed)
        if plan.make_periodic == "mirror":
            # As the map: a piece that does not repeat, and its images.
            nx, ny = heights.shape
            cell = periodic_cell(GridField(cell.values[:nx, :ny], cell.spacing), "mirror")
        yield "twin", cell
