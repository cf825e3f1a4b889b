"""Arrays with names and attributes, as npz, NetCDF and HDF5 hold them, read as a map of samples.

Layouts that are understood besides the package's own (`gap` or `heights`, `spacing`, `periodic`,
`unit`):

* SurfaceTopography 1.18, which ContactMechanics uses: `heights` (x, y), coordinates `x` and `y`
  with the attributes `unit` and `periodic`, and a `mask` of undefined points.
* Tamaas 2.9 (tamaas/dumpers): the fields of a model, its `system_size` as an attribute, and in
  npz all attributes as JSON in an array `attrs`. A model is periodic and has no units. Samples with
  positive `traction` are in contact, although rounding may leave their gap slightly above 0.
* ContactMechanics 1.8 (IO/NetCDF.py): frames of fields on `nx` by `ny` points, no lengths.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.recorded import Pair, Recorded, even_step

# Arrays that are read beside the samples if a file has them.
ABOUT = ("spacing", "periodic", "unit", "x", "y", "mask", "attrs")
# Names in other codes of fields that are positive exactly where the solids touch.
CONTACT_PRESSURES = ("traction", "forces")

FRAMES = "frame"


@dataclass(frozen=True, eq=False)
class Variable:
    """One array of a file."""

    values: np.ndarray  #: numbers or text as stored
    attributes: Mapping[str, object] = field(default_factory=dict)  #: attributes of the array
    dimensions: tuple[str, ...] = ()  #: names of its dimensions, if the format has them


@dataclass(frozen=True, eq=False)
class NamedArrays:
    """The arrays that were read from one file."""

    path: Path  #: the file
    variables: Mapping[str, Variable]  #: arrays by name, as far as their names were asked for
    held: tuple[str, ...]  #: names of all arrays of the file
    attributes: Mapping[str, object]  #: attributes of the whole file
    si: bool = False  #: whether lengths without a unit are metres, as in the package's own npz


def names_to_read(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of all arrays to read from a file whose samples have one of `names`."""
    return (*names, *ABOUT, *CONTACT_PRESSURES)


def interpret(arrays: NamedArrays, names: tuple[str, ...]) -> Recorded:
    """Take the samples, their spacing and their units out of the arrays of a file.

    The samples are the first of `names` that the file has.
    """
    name = next((name for name in names if name in arrays.variables), None)
    if name is None:
        possible = " or ".join(map(repr, names))
        held = ", ".join(sorted(arrays.held)) or "nothing"
        hint = "; array (--array) names another one"
        if "heights" in names and "gap" in arrays.held:
            hint = "; the leak rate of a gap is computed by fem-seal leak, or a scene with [gap]"
        raise InvalidInput(f"{arrays.path} has no array {possible}; it holds {held}{hint}")
    samples = arrays.variables[name]
    attributes = dict(arrays.attributes) | _tamaas_attributes(arrays)
    tamaas = "system_size" in attributes
    values = _map_of(samples, name, arrays.path, normal=tamaas)
    values = _without_masked(values, arrays)
    unit = _unit(arrays, samples)
    spacing, length_unit = _spacing(arrays, values.shape, attributes)
    if arrays.si:
        unit, length_unit = unit or "m", length_unit or unit or "m"
    periodic = True if tamaas else _periodic(arrays)
    return Recorded(values, unit, spacing, length_unit, periodic, _contact(arrays))


def _map_of(samples: Variable, name: str, path: Path, normal: bool = False) -> np.ndarray:
    """Real numbers (nx, ny) of the last frame; of vectors the last component, which is normal."""
    values = _along_x(samples)
    if values.dtype.kind not in "biuf":
        raise InvalidInput(f"{name} in {path} must hold real numbers, not {values.dtype}")
    if values.dtype.kind == "b":
        raise InvalidInput(f"{name} in {path} holds true and false; lengths are wanted")
    if samples.dimensions[:1] == (FRAMES,):
        if len(values) == 0:
            raise InvalidInput(f"{name} in {path} has no frame; the last one is read: write one")
        values = values[-1]
    if normal and values.ndim == 3:
        values = values[..., -1]
    if values.ndim != 2 or 0 in values.shape:
        raise InvalidInput(
            f"{name} in {path} must be two-dimensional, (nx, ny), but has shape {values.shape}"
        )
    return values.astype(float)


def _along_x(array: Variable) -> np.ndarray:
    """Values with x first, also where the names of the dimensions say that y is, as in xarray."""
    values = np.asarray(array.values)
    return values.T if [name.lower() for name in array.dimensions] == ["y", "x"] else values


def _without_masked(values: np.ndarray, arrays: NamedArrays) -> np.ndarray:
    mask = arrays.variables.get("mask")
    if mask is None:
        return values
    masked = _along_x(mask)
    if masked.shape != values.shape:
        raise InvalidInput(
            f"mask in {arrays.path} has shape {masked.shape}; it must have that of the samples, "
            f"{values.shape}"
        )
    if masked.dtype.kind not in "biuf":
        raise InvalidInput(f"mask in {arrays.path} must hold true and false, not {masked.dtype}")
    return np.where(masked.astype(bool), np.nan, values)


def _contact(arrays: NamedArrays) -> np.ndarray | None:
    """Samples (nx, ny) at which another code reports contact."""
    for name in CONTACT_PRESSURES:
        if name in arrays.variables:
            return _map_of(arrays.variables[name], name, arrays.path, normal=True) > 0
    return None


def _tamaas_attributes(arrays: NamedArrays) -> dict[str, object]:
    """Attributes that Tamaas writes as JSON into its npz."""
    if "attrs" not in arrays.variables:
        return {}
    try:
        attributes = json.loads(str(arrays.variables["attrs"].values))
    except ValueError:
        attributes = None
    if not isinstance(attributes, dict):
        raise InvalidInput(f"attrs in {arrays.path} is not the JSON that Tamaas writes")
    return attributes


def _spacing(
    arrays: NamedArrays, shape: tuple[int, ...], attributes: Mapping[str, object]
) -> tuple[Pair | None, str | None]:
    """(dx, dy) and its unit: from `spacing`, coordinates, or an attribute; None without these."""
    if "spacing" in arrays.variables:
        spacing = arrays.variables["spacing"]
        return _pair(spacing.values, f"spacing in {arrays.path}"), _unit(arrays, spacing)
    if {"x", "y"} <= set(arrays.variables):
        x, y = arrays.variables["x"], arrays.variables["y"]
        units = _unit(arrays, x), _unit(arrays, y)
        if units[0] != units[1]:
            raise InvalidInput(f"x and y in {arrays.path} differ in unit: {units[0]}, {units[1]}")
        steps = _step(x, shape[0], "x", arrays.path), _step(y, shape[1], "y", arrays.path)
        return steps, units[0]
    if "spacing" in attributes:
        return _pair(attributes["spacing"], f"spacing in {arrays.path}"), None
    if "system_size" in attributes:
        # Tamaas puts the depth of a volume before the two lengths of its face.
        lengths = np.ravel(np.asarray(attributes["system_size"]))[-2:]
        size = _pair(lengths, f"system_size in {arrays.path}")
        return (size[0] / shape[0], size[1] / shape[1]), None
    return None, None


def _pair(values: object, what: str) -> Pair:
    numbers = np.ravel(np.asarray(values))
    if numbers.dtype.kind not in "iuf" or len(numbers) != 2:
        raise InvalidInput(f"{what} must be two positive lengths, got {values}")
    return float(numbers[0]), float(numbers[1])


def _step(axis: Variable, n: int, name: str, path: Path) -> float:
    """Distance of neighbouring coordinates, which must be the same everywhere."""
    x = np.asarray(axis.values)
    if x.dtype.kind not in "iuf" or x.shape != (n,):
        raise InvalidInput(
            f"{name} in {path} has shape {x.shape}, and must be {n} coordinates, one for each "
            f"sample along {name}; the samples are (nx, ny), unless names of dimensions say (y, x)"
        )
    if n < 2:
        raise InvalidInput(f"{name} in {path} is a single coordinate, and says no step")
    step = even_step(x.astype(float), fewest=2)
    if step is not None and step > 0:
        return step
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.diff(x.astype(float))
    if (steps < 0).all():
        raise InvalidInput(
            f"{name} in {path} falls; reverse it, and the samples along {name} with it"
        )
    raise InvalidInput(
        f"{name} in {path} is not evenly spaced: its steps are from {steps.min():g} to "
        f"{steps.max():g}; resample it onto an even grid"
    )


def _unit(arrays: NamedArrays, variable: Variable) -> str | None:
    """Unit of one variable, or of the whole file; an empty text is none."""
    texts = [variable.attributes.get(name, "") for name in ("unit", "units")]
    if "unit" in arrays.variables:
        texts.append(arrays.variables["unit"].values)
    return next(filter(None, (text_of(text).strip() for text in texts)), None)


def text_of(value: object) -> str:
    """Text of an attribute or an array of one."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _periodic(arrays: NamedArrays) -> bool | None:
    if "periodic" in arrays.variables:
        return _truth(arrays.variables["periodic"].values, arrays.path)
    values = {
        _truth(arrays.variables[name].attributes["periodic"], arrays.path)
        for name in ("x", "y")
        if name in arrays.variables and "periodic" in arrays.variables[name].attributes
    }
    if len(values) > 1:
        raise InvalidInput(
            f"{arrays.path} repeats along one axis only; write periodic = 0 for both axes"
        )
    return values.pop() if values else None


def _truth(value: object, path: Path) -> bool:
    """Read a truth value, 1 or 0; refuse text, since bool("false") is True."""
    number = np.asarray(value)
    if number.size != 1 or number.dtype.kind not in "biuf" or number.item() not in (0, 1):
        raise InvalidInput(f"periodic in {path} must be one true or false, got {value!r}")
    return bool(number.item())
