"""Maps as text: a matrix, one line for each row, or a list of x, y and height.

x is the first axis of a map. In a matrix without a header that names x and y (or width and height)
each line is a row of constant x; where the header names them, x runs along the lines, as in the
files of instruments.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.length_units import length_in_metres
from fem_seal.field_file.markers import without_marked
from fem_seal.field_file.own_layouts import read_own_layout, zygo_resolution
from fem_seal.field_file.recorded import Recorded
from fem_seal.field_file.text_header import Statements, statements
from fem_seal.field_file.text_table import TextTable, read_table

# Largest distance of coordinates from an even grid, over its step: written numbers are rounded.
OFF_GRID = 0.05
FARTHEST = 1e100  # largest coordinate; sums of a few are finite
UNCALIBRATED = "; its header says that the camera's resolution is 0: it was not calibrated"
FEWEST_OF_GRID = 0.25  # least part of the points of a grid that a list must have


def read_text(path: Path) -> Recorded:
    """Read a map, and unit, steps and mark of missing points if the header has them.

    Raises
    ------
    InvalidInput
        If the file is missing, cannot be read (`read_table`), contradicts its header, or is a
        profile or a list of points that are on no even grid.
    """
    in_own_layout = read_own_layout(path)
    if in_own_layout is not None:
        return in_own_layout
    table = read_table(path)
    header = statements(table.header)
    if (table.values.shape[1] == 2 or header.titled_as_profiles) and len(table.values) > 3:
        raise InvalidInput(
            f"{path} has columns of x and height of a profile: this is a line scan; a map is "
            "wanted (or surface.kind = 'profiles')"
        )
    as_list = table.values.shape[1] == 3 and len(table.values) > 3
    recorded = _from_points(table, header, path) if as_list else _from_matrix(table, header, path)
    values = recorded.values
    for mark in header.missing:
        values = without_marked(values, mark)
    return replace(recorded, values=values, header=table.header)


def _from_matrix(table: TextTable, header: Statements, path: Path) -> Recorded:
    """Map of a matrix; x runs along its lines if the header names x and y."""
    values = table.values
    lines, columns = values.shape
    counts, lengths = dict(header.counts), dict(header.lengths)
    for axis, (number, unit) in header.lengths.items():
        # "Width 512" is a number of points if there are so many.
        if axis and unit is None and number in (lines, columns):
            counts.setdefault(axis, int(number))
            del lengths[axis]
    expected = counts.get("y", lines), counts.get("x", columns)
    across = expected != (lines, columns) and expected[::-1] == (lines, columns)
    if expected != (lines, columns) and not across and {"x", "y"} <= counts.keys():
        raise InvalidInput(
            f"{path} holds {lines} lines of {columns} numbers, and its header announces "
            f"{expected[0]} of {expected[1]}; it may be cut off"
        )
    named = header.steps.keys() | lengths.keys() | counts.keys()
    along_x = bool({"x", "y"} <= named) and not across
    values = np.ascontiguousarray(values.T) if along_x else values
    steps: dict[str, float] = {}
    if lines != columns:
        lengths.pop("", None)  # a length without an axis: its side is not known
    for axis, count in zip("xy", values.shape, strict=True):
        if (step := header.metres(header.steps, axis)) is not None:
            steps[axis] = step
        elif (length := header.metres(lengths, axis)) is not None:
            steps[axis] = length / count
    spacing = (steps["x"], steps["y"]) if len(steps) == 2 else None
    if spacing is None:
        return Recorded(values, header.unit_of_values, length_hint=header.length_hint)
    return Recorded(values, header.unit_of_values, spacing, "m")


def _from_points(table: TextTable, header: Statements, path: Path) -> Recorded:
    """Map of a list of x, y and height on an even grid; points that are not listed are missing."""
    nowhere = ~(np.abs(table.values[:, :2]) < FARTHEST).all(axis=1)
    if nowhere.any():
        raise InvalidInput(
            f"line {table.line[np.argmax(nowhere)]} of {path} has no x or no y; give all three of "
            "x, y and height"
        )
    axes = [_axis(table, k, path) for k in (0, 1)]
    (i, dx), (j, dy) = axes
    shape = int(i.max()) + 1, int(j.max()) + 1
    if len(i) < FEWEST_OF_GRID * shape[0] * shape[1]:
        raise InvalidInput(
            f"{path} has three columns, x, y and height, but its {len(i)} points are few of the "
            f"{shape[0]} x {shape[1]} of an even grid; resample them onto a grid"
        )
    site = i * shape[1] + j
    _, first = np.unique(site, return_index=True)
    if len(first) < len(site):
        twice = np.setdiff1d(np.arange(len(site)), first)[0]
        raise InvalidInput(
            f"line {table.line[twice]} of {path} has the same x and y as a line before it"
        )
    values = np.full(shape, np.nan)
    values.flat[site] = table.values[:, 2]
    pixel = zygo_resolution(table.header, path)
    if pixel is not None:
        step = (dx * pixel, dy * pixel) if pixel else None
        return Recorded(values, "um", step, "m", length_hint=UNCALIBRATED)
    units, unit = (header.unit_along("x"), header.unit_along("y")), header.unit_of_values
    if units[0] is None or units[1] is None:
        return Recorded(values, unit, (dx, dy))
    scale = [length_in_metres(name, f"the lengths of {path}") for name in units if name]
    return Recorded(values, unit, (dx * scale[0], dy * scale[1]), "m")


def _axis(table: TextTable, column: int, path: Path) -> tuple[np.ndarray, float]:
    """Index of each point along an axis, and the step of the grid."""
    name, x = "xy"[column], table.values[:, column]
    ordered = np.sort(x)
    rises = np.diff(ordered)
    if not rises.any():
        raise InvalidInput(
            f"{path} has three columns, but no list of x, y and height on a grid: {name} is the "
            "same in all lines; a map that is three samples wide is read from .npy or .npz"
        )
    # Points of one row of the grid differ by rounding only.
    breaks = np.flatnonzero(rises > 0.1 * rises.max())
    rows = np.array([part.mean() for part in np.split(ordered, breaks + 1)])
    steps = np.rint((rows - rows[0]) / np.diff(rows).min())
    step = float((rows[-1] - rows[0]) / steps[-1])
    index = (x - rows[0]) / step
    off = np.abs(index - np.rint(index))
    if off.max() > OFF_GRID:
        worst = int(np.argmax(off))
        raise InvalidInput(
            f"line {table.line[worst]} of {path}: {name} = {x[worst]:g} is not on the even grid of "
            f"the others, whose step is {step:g}; a list of x, y and height must be on one, and a "
            "map that is three samples wide is read from .npy or .npz"
        )
    return np.rint(index).astype(int), step
