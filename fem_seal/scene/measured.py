"""The sections that name a file of heights or of a gap."""

from collections.abc import Iterator
from dataclasses import fields
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator

from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import Stated, in_si
from fem_seal.files import atomic_write, use_writable_cache, user_cache
from fem_seal.grid import GridField
from fem_seal.scene.section import (
    Coordinate,
    Count,
    InputFile,
    Length,
    Number,
    Section,
    Seed,
    Truth,
    is_changed,
    one_or_more,
)
from fem_seal.scene.surface import SurfaceSection
from fem_seal.surface.preparation import Crop, Preparation

WINDOW_END = 1e-5  # part of a window by which its end is shortened, to leave out the last sample


def _length_unit(unit: str) -> str:
    try:
        in_si(unit, "m", "lengths")
    except InvalidInput:
        raise ValueError("is no unit of length such as 'nm', 'um' or 'mm'") from None
    return unit


def _missing(value: object) -> float | str:
    if isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value):
        return value
    if value != "none":
        raise ValueError("must be a number as it stands in the file, or 'none'")
    return "none"


LengthUnit = Annotated[str, AfterValidator(_length_unit)]


class FieldFile(Section):
    """A file of samples, and statements that the file itself lacks."""

    path: InputFile = Field(description="npz, npy, nc, h5, txt or an instrument's file")
    array: str | None = Field(None, description="name of the array or channel")
    unit: LengthUnit | None = Field(None, description="unit of the values, if the file has none")
    size: tuple[Length, Length] | None = Field(
        None, description="lengths [nx dx, ny dy], if the file has none"
    )
    periodic: Truth | None = Field(
        None, description="whether the map repeats, if the file does not record it"
    )
    transpose: Truth = Field(False, description="exchange the axes, before anything else")
    turn: Literal[0, 90, 180, 270] = Field(
        0, description="degrees by which the map is turned from x towards y"
    )

    @property
    def stated(self) -> Stated:
        """Statements of the scene about the file."""
        own = type(self).model_fields
        return Stated(**{f.name: getattr(self, f.name) for f in fields(Stated) if f.name in own})


class FileSurface(FieldFile, SurfaceSection):
    """Heights from a file, and the steps that prepare them; each is off unless it is named."""

    proportional = ("height_factor",)
    seed_field = "twin_seed"
    lacks = ("instrument", "waves that the instrument did not resolve are not in the map")

    kind: Literal["file"] = Field(description="kind of surface")
    missing: Annotated[float | Literal["none"], PlainValidator(_missing)] | None = Field(
        None, description="number in the file that marks missing points; or 'none'"
    )
    crop: tuple[tuple[Coordinate, Coordinate], tuple[Coordinate, Coordinate]] | None = Field(
        None, description="kept rectangle [[x0, x1], [y0, y1]] from the first sample"
    )
    outliers: Literal["missing"] | None = Field(
        None, description="points far from all their neighbours become missing"
    )
    detrend: Literal["mean", "plane", "quadratic"] | None = Field(
        None, description="least-squares trend that is subtracted"
    )
    fill: Literal["harmonic"] | None = Field(None, description="how missing points are filled")
    max_missing: Number = Field(
        0.1, ge=0, lt=1, description="largest fraction of missing points that is filled"
    )
    make_periodic: Literal["cut", "mirror", "hann", "tukey"] | None = Field(
        None, description="how a map that does not repeat becomes a cell that does"
    )
    twin_seed: Seed | None = Field(
        None, description="press a random surface with the same spectrum instead"
    )
    height_factor: Number = Field(1.0, gt=0, description="factor on all heights")

    @property
    def preparation(self) -> Preparation:
        """The steps that prepare the map."""
        return Preparation(**{step.name: getattr(self, step.name) for step in fields(Preparation)})

    def window(self, place: tuple[int, int], lengths: tuple[float, float]) -> Crop:
        """One of the windows [m] into which `crop` is divided, as a rectangle like that.

        Its place is its number along x and along y, from 0.
        """
        corner = [0.0, 0.0] if self.crop is None else [start for start, _ in self.crop]
        x, y = (
            # The sample at the end is the first one of the next window.
            (start + number * length, start + (number + 1 - WINDOW_END) * length)
            for start, number, length in zip(corner, place, lengths, strict=True)
        )
        return x, y

    def _contradictions(self) -> Iterator[str]:
        for name, (start, end) in zip("xy", self.crop or (), strict=False):
            if not start < end:
                yield f"crop in {name} ends at {end:g} m, and must end above its start, {start:g} m"
        if is_changed(self, "max_missing") and not self.fill:
            yield "max_missing is the most that fill may fill; give both, or leave it out"
        if self.make_periodic and self.periodic:
            yield "periodic = true needs no make_periodic; leave one out"


class Heights(FileSurface):
    """Heights in an array; a file in the user's cache keeps them, so that a result can name it.

    Parameters
    ----------
    values
        Heights (nx, ny), in metres if `unit` is left out, NaN or masked where none was measured; or
        a GridField.
    fields
        `size` (nx dx, ny dy) of an array, and any other field of `FileSurface`.
    """

    def __init__(self, values: "np.ndarray | GridField", **fields: Any) -> None:
        if isinstance(values, GridField):
            (nx, ny), (dx, dy) = values.shape, values.spacing
            fields = {"size": (nx * dx, ny * dy), "periodic": values.periodic} | fields
            values = values.values
        elif "size" not in fields:
            raise InvalidInput('Heights of an array need their size, such as ("1 mm", "1 mm")')
        super().__init__(**({"unit": "m", "kind": "file"} | fields | {"path": _kept(values)}))


def _kept(values: object) -> Path:
    """File in the user's cache that holds an array of heights, named by its content."""
    array = np.asanyarray(values)
    if array.ndim != 2 or array.dtype.kind not in "iuf":
        raise InvalidInput(
            f"heights must be a two-dimensional array of numbers, got {array.dtype} of shape "
            f"{array.shape}"
        )
    # A masked point has no height, whatever number stands below the mask.
    array = np.ascontiguousarray(np.ma.filled(np.ma.asarray(array, dtype=float), np.nan))
    digest = sha256(repr(array.shape).encode() + array.tobytes()).hexdigest()[:16]
    use_writable_cache()
    path = user_cache() / "fem_seal" / f"heights-{digest}.npy"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as staged, staged.open("wb") as file:
            np.save(file, array, allow_pickle=False)
    return path


class ProfileSurface(SurfaceSection):
    """A random isotropic surface with the spectrum of measured profiles."""

    proportional = ("height_factor",)
    seed_field = "seed"
    lacks = (
        "isotropic_surface",
        "the surface is random, isotropic and Gaussian with the spectrum of the profiles; lay, "
        "plateaus and pits of the measured one are not in it",
    )

    kind: Literal["profiles"] = Field(description="kind of surface")
    path: Annotated[tuple[InputFile, ...], BeforeValidator(one_or_more)] = Field(
        min_length=1, description="text file of profiles, or a list of them"
    )
    unit: LengthUnit | None = Field(
        None, description="unit of heights and x, if the files have none"
    )
    step: Length | None = Field(None, description="distance of the samples, if the files have no x")
    missing: Number | None = Field(None, description="number in the files for missing samples")
    detrend: Literal["mean", "line", "quadratic"] = Field(
        "line", description="trend that is subtracted from each profile"
    )
    shape: tuple[Count, Count] = Field(description="samples [nx, ny]")
    size: tuple[Length, Length] = Field(description="lengths [Lx, Ly] of the periodic cell")
    seed: Seed = Field(0, description="seed of the random phases")
    height_factor: Number = Field(1.0, gt=0, description="factor on all heights")


class Gap(FieldFile):
    """A gap from a file, in place of surface, solid and contact."""

    contact_below: Length | None = Field(
        None, description="gaps below this are contact; for codes that leave rounding errors there"
    )
