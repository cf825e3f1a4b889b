"""Units, lengths and periodicity of a map: from its file, from the scene, and combined in SI."""

from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Literal

import numpy as np

from fem_seal.arguments import require_kind, require_positive
from fem_seal.errors import InvalidInput
from fem_seal.units import to_si

Pair = tuple[float, float]

# Relative difference above which lengths contradict each other. Single precision rounds at 6e-8.
SAME_LENGTH = 1e-6
# Distances of points [m] below a hundredth of an atom, and rms slopes out of all proportion: a
# wrong unit.
FINEST, FLATTEST, STEEPEST = 1e-12, 1e-6, 10.0
SIZE = 'size, such as size = ["1 mm", "1 mm"] (number of points times their distance)'
SIZE_OPTION = 'or by --size "1 mm,1 mm"'
TURNS = (0, 90, 180, 270)  # of a map [degrees]
# Largest spacing and value [m], 1 over the smallest spacing, and largest coordinate; squares of
# others may overflow.
LONGEST = 1e100

# Largest distance of coordinates from an even grid, over its step: written numbers are rounded.
OFF_GRID = 0.05
FEWEST = 3  # coordinates of which one can say that they are even

# "A" is the ångström to SurfaceTopography and Gwyddion, and the ampere to a units library.
_SPELT_OTHERWISE = {"A": "angstrom", "Å": "angstrom", "~m": "um"}
_WANTED = {"m": "length such as nm, um, mm or m", "Pa": "pressure such as Pa, MPa or bar"}


def in_si(unit: str, si: str, what: str) -> float:
    """Metres ("m") or pascals ("Pa") in a unit such as "um", "A" (ångström) or "bar".

    A message calls the quantity `what`.
    """
    try:
        return to_si(f"1 {_SPELT_OTHERWISE.get(unit, unit)}", si)
    except ValueError:
        raise InvalidInput(f"{what} are in {unit!r}, which is no unit of {_WANTED[si]}") from None


def even_step(x: np.ndarray, fewest: int = FEWEST) -> float | None:
    """Step of coordinates that rise or fall evenly; None for other numbers."""
    if len(x) < fewest or not np.abs(x).max() < LONGEST:
        return None
    if not (np.diff(x) * (x[1] - x[0]) > 0).all():
        return None
    step = float(x[-1] - x[0]) / (len(x) - 1)
    off = np.abs(x - x[0] - step * np.arange(len(x))).max()
    return step if off < OFF_GRID * abs(step) else None


@dataclass(frozen=True, eq=False)
class FieldMap:
    """Samples of a map in metres; points may be missing, which a `GridField` does not allow."""

    values: np.ndarray  #: (nx, ny), heights or gaps [m], NaN where a point is missing
    spacing: Pair  #: distance of neighbouring samples [m]
    #: whether sample 0 repeats at nx dx and ny dy; None if neither file nor scene states it
    periodic: bool | None

    @property
    def covered(self) -> Pair:
        """Lengths [m] that the samples cover, each counted as one pixel."""
        (nx, ny), (dx, dy) = self.values.shape, self.spacing
        return nx * dx, ny * dy

    @property
    def missing(self) -> int:
        """Number of missing points."""
        return int(np.count_nonzero(np.isnan(self.values)))

    def oriented(self, turn: int = 0, transpose: bool = False) -> "FieldMap":
        """Map turned so that the flow, along the first axis, takes another direction of the file.

        x and y are exchanged if `transpose`, before the map is turned from the x axis towards the y
        axis by 0, 90, 180 or 270 degrees.
        """
        # rot90 turns from the first axis towards the second.
        values = np.rot90(self.values.T if transpose else self.values, turn // 90)
        swapped = transpose != (turn % 180 == 90)
        spacing = self.spacing[::-1] if swapped else self.spacing
        return FieldMap(np.ascontiguousarray(values), spacing, self.periodic)


@dataclass(frozen=True, eq=False)
class Recorded:
    """Samples with the statements of their file; None where the file has no statement."""

    values: np.ndarray  #: (nx, ny), samples in the file's unit, NaN where a point is missing
    unit: str | None = None  #: unit of the values
    spacing: Pair | None = None  #: distance of neighbouring samples in `length_unit`
    length_unit: str | None = None  #: unit of the spacing
    periodic: bool | None = None  #: whether the map repeats
    contact: np.ndarray | None = None  #: (nx, ny), samples where the solids touch
    header: tuple[str, ...] = ()  #: lines before the numbers of a text file
    #: addition to the message that asks for the lengths: the statements of the file about them
    length_hint: str = ""
    #: by an instrument: a map that does not repeat unless its file or the scene says so
    measured: bool = False


@dataclass(frozen=True)
class Stated:
    """Statements of the scene about a file; None: the file decides."""

    array: str | None = None  #: name of the array, or of the channel of an instrument's file
    #: unit of the values, and of the lengths if the file has lengths without a unit
    unit: str | None = None
    #: (nx dx, ny dy), lengths of the map [m]; each sample counts as one pixel, as in instruments
    size: Pair | None = None
    periodic: bool | None = None  #: whether the map repeats
    #: number in the file that marks missing points; "none" if every number is a sample
    missing: float | Literal["none"] | None = None
    #: orientation of the map along the flow, see `FieldMap.oriented`. All other statements are
    #: about the file before it is turned.
    turn: int = 0
    transpose: bool = False
    height_factor: float = 1.0  #: on all values, such as of a calibration

    def __post_init__(self) -> None:
        require_kind((bool, type(None)), periodic=self.periodic)
        require_kind(bool, transpose=self.transpose)
        require_positive(height_factor=self.height_factor)
        if self.turn not in TURNS:
            raise InvalidInput(f"turn = {self.turn!r} must be one of 0, 90, 180 and 270 degrees")


def in_metres(recorded: Recorded, stated: Stated, path: Path) -> FieldMap:
    """Convert samples to metres by the units and lengths of the file or of the scene."""
    if {recorded.unit, stated.unit, recorded.spacing, stated.size} == {None}:
        raise InvalidInput(
            f"the values of {path} have no unit, and it does not say its lengths; say both in the "
            'scene, such as unit = "um" and size = ["1 mm", "1 mm"] (number of points times their '
            f'distance), or by --length-unit um --size "1 mm,1 mm"{recorded.length_hint}'
        )
    scale = metres_in(recorded.unit, stated.unit, f"the values of {path}")
    spacing = _spacing(recorded, stated, path)
    if not all(1 / LONGEST < d < LONGEST for d in spacing):
        raise InvalidInput(
            f"spacing in {path} must be two lengths from {1 / LONGEST:g} m to {LONGEST:g} m, got "
            f"{spacing} m"
        )
    # A single multiplication, so that heights in nm and in m differ by one rounding.
    values = recorded.values * scale if scale != 1 else recorded.values
    if (np.abs(values) > LONGEST).any():
        raise InvalidInput(
            f"a value of {path} is beyond {LONGEST:g} m; if it marks missing points, say so by "
            "missing, or write NaN there"
        )
    if recorded.spacing is not None and recorded.length_unit is None and stated.size is None:
        subject, remedy = f"x and y of {path} have no unit", f"give its {SIZE}, {SIZE_OPTION}"
        refuse_other_unit(values, spacing, str(stated.unit), subject, remedy)
    return FieldMap(values, spacing, _periodic(recorded, stated, path))


def refuse_other_unit(
    heights: np.ndarray, steps: tuple[float, ...], unit: str, subject: str, remedy: str
) -> None:
    """Refuse coordinates that take the unit of the heights [m], if it cannot be theirs.

    There is a step [m] along each of the last axes of the heights.
    """
    along = [np.diff(heights, axis=k - len(steps)) / step for k, step in enumerate(steps)]
    slopes = np.concatenate([slope[np.isfinite(slope)] for slope in along])
    slope = float(np.sqrt(np.mean(slopes**2))) if slopes.size else 0.0
    if min(steps) < FINEST or (slope > 0 and not FLATTEST < slope < STEEPEST):
        raise InvalidInput(
            f"{subject}, and in {unit!r}, the unit of its values, its points are "
            f"{min(steps):.2g} m apart and its rms slope is {slope:.2g}; check the unit, and "
            f"{remedy}"
        )


def metres_in(recorded: str | None, stated: str | None, what: str) -> float:
    """Metres in the unit of a file or, if it has none, of the scene."""
    if recorded is None:
        if stated is None:
            raise InvalidInput(
                f"{what} have no unit; say it in the scene, such as "
                'unit = "um", or by --length-unit um'
            )
        return in_si(stated, "m", what)
    scale = in_si(recorded, "m", what)
    if stated is not None and not isclose(in_si(stated, "m", what), scale, rel_tol=1e-12):
        raise InvalidInput(
            f"{what} are in {recorded}, but unit = {stated!r} was given; leave out the wrong one"
        )
    return scale


def _spacing(recorded: Recorded, stated: Stated, path: Path) -> Pair:
    nx, ny = recorded.values.shape
    if recorded.spacing is None:
        if stated.size is None:
            raise InvalidInput(
                f"{path} does not say its lengths; give its {SIZE}, {SIZE_OPTION}"
                f"{recorded.length_hint}"
            )
        return stated.size[0] / nx, stated.size[1] / ny
    dx, dy = float(recorded.spacing[0]), float(recorded.spacing[1])
    if recorded.length_unit is not None:
        scale = metres_in(recorded.length_unit, None, f"the lengths of {path}")
    elif stated.size is not None and dx > 0:
        scale = stated.size[0] / (nx * dx)
    elif stated.unit is not None:
        scale = in_si(stated.unit, "m", f"the lengths of {path}")
    else:
        raise InvalidInput(f"the lengths of {path} have no unit; give its {SIZE}, {SIZE_OPTION}")
    spacing = dx * scale, dy * scale
    size = nx * spacing[0], ny * spacing[1]
    if stated.size is not None and not all(
        isclose(a, b, rel_tol=SAME_LENGTH) for a, b in zip(size, stated.size, strict=True)
    ):
        raise InvalidInput(
            f"{path} says size = {size[0]:g} m by {size[1]:g} m, but size = {stated.size[0]:g} m "
            f"by {stated.size[1]:g} m was given; leave out the wrong one"
        )
    return spacing


def _periodic(recorded: Recorded, stated: Stated, path: Path) -> bool | None:
    if recorded.periodic is None:
        return False if recorded.measured and stated.periodic is None else stated.periodic
    if stated.periodic in (None, recorded.periodic):
        return recorded.periodic
    raise InvalidInput(
        f"{path} says periodic = {recorded.periodic}, but {stated.periodic} was given; to press a "
        "map that does not repeat, make it periodic (make_periodic)"
    )
