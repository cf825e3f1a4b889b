"""Maps as text: a matrix, one line for each row, or a list of x, y and height.

x is the first axis of a map. In a matrix without a header that names x and y (or width and height)
each line is a row of constant x; where the header names them, x runs along the lines, as in the
files of instruments.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.column_titles import bare
from fem_seal.field_file.markers import without_marked
from fem_seal.field_file.own_layouts import read_own_layout, zygo_resolution
from fem_seal.field_file.recorded import LONGEST, OFF_GRID, Pair, Recorded, even_step, in_si
from fem_seal.field_file.text_header import ROUNDED, Statements, statements_of, unit_in
from fem_seal.field_file.text_table import TextTable, read_table

COUNTING = "; its first line and column count points, without a unit, and say no lengths"
SAYS = "; its header says {}, but not one length of each side with its unit"
CONTRADICT = "; the steps and the lengths in its header contradict each other: {}"
# Steps along a length, which may be one fewer than the points, may differ from their number by so
# many, beside what rounded digits make.
SAME_COUNT = 1.5
WIDEST_LIST = 8  # columns from which on a table is no list of points
LEAST_EVEN = 5  # numbers in a line that rise evenly by chance in no rough map
UNCALIBRATED = "; its header says that the camera's resolution is 0: it was not calibrated"
FEWEST_OF_GRID = 0.25  # least part of the points of a grid that a list must have


def read_text(path: Path) -> Recorded:
    """Read a map, and unit, steps and mark of missing points if the header has them."""
    in_own_layout = read_own_layout(path)
    if in_own_layout is not None:
        if in_own_layout.values.shape[1] == 1:
            raise _line_scan(path)
        return in_own_layout
    table = read_table(path)
    header = statements_of(table, path)
    if (table.values.shape[1] == 2 or header.titled_as_profiles) and len(table.values) > 3:
        raise _line_scan(path)
    if header.titled_as_points or (table.values.shape[1] == 3 and len(table.values) > 3):
        recorded = _from_points(table, header, path)
    else:
        _refuse_list(table, header, path)
        recorded = _from_matrix(table, header, path)
    values = recorded.values
    for mark in header.missing:
        values = without_marked(values, mark)
    return replace(recorded, values=values, header=table.header)


def _line_scan(path: Path) -> InvalidInput:
    return InvalidInput(
        f"{path} has columns of x and height of a profile: this is a line scan; a map is "
        "wanted (or surface.kind = 'profiles')"
    )


def _refuse_list(table: TextTable, header: Statements, path: Path) -> None:
    """Refuse a list of x, y, height and more, which would be read as a narrow matrix."""
    if 3 < table.values.shape[1] < WIDEST_LIST < len(table.values):
        try:
            _from_points(table, header, path)
        except InvalidInput:
            return
        raise InvalidInput(
            f"the first two columns of {path} are x and y of a grid; give all columns titles in "
            "one line, such as 'x [mm], y [mm], z [um], intensity'"
        )


def _from_matrix(table: TextTable, header: Statements, path: Path) -> Recorded:
    """Map of a matrix; x runs along its lines if the header names x and y."""
    values, between = _without_coordinates(table, path)
    lateral = unit_in(table.corner or "") or header.lateral_unit
    if between is not None and (lateral or between != (1, 1)):
        return Recorded(values.T, header.unit_of_values(), between, lateral)
    lines, columns = values.shape
    counts, lengths = header.counts, dict(header.lengths)
    expected = counts.get("y", lines), counts.get("x", columns)
    across = expected != (lines, columns) and expected[::-1] == (lines, columns)
    if expected != (lines, columns) and not across and {"x", "y"} <= counts.keys():
        raise InvalidInput(
            f"{path} holds {lines} lines of {columns} numbers, and its header announces "
            f"{expected[0]} of {expected[1]}; it may be cut off"
        )
    named = set(header.steps.keys() | lengths.keys() | counts.keys())
    along_x = {"x", "y"} <= _named_axes(named, header, path) and not across
    values = np.ascontiguousarray(values.T) if along_x else values
    if lines != columns:
        lengths.pop("", None)  # a length without an axis: its side is not known
    steps, unequal = [], []
    for axis, count in zip("xy", values.shape, strict=True):
        step, length = header.metres(header.steps, axis), header.metres(lengths, axis)
        if step is not None and length is not None:
            unequal.append(abs(length / step - count) > SAME_COUNT + ROUNDED * count)
        if step is not None or length is not None:
            steps.append((length or 0.0) / count if step is None else step)
    spacing = (steps[0], steps[1]) if len(steps) == 2 else None
    hint = COUNTING if between else SAYS.format(header.quoted) if header.quoted else ""
    # A length along one axis alone may be that of something else, such as the height of a peak.
    if len(unequal) == 2 and any(unequal):
        spacing, hint = None, CONTRADICT.format(header.quoted)
    if header.unclear:
        spacing, hint = None, f"; its header {header.unclear[0].says}"
    return Recorded(values, header.unit_of_values(), spacing, "m", length_hint=hint)


def _named_axes(clear: set[str], header: Statements, path: Path) -> set[str]:
    """Axes that clear lines name and, by their keys, unclear ones about steps and lengths.

    Refused if x and y are both named or not, or a count says that they are exchanged or not, as an
    unclear value is read.
    """
    counts = [line for line in header.unclear if line.about == "count"]
    others = [line for line in header.unclear if line.about != "count"]
    named = clear.union(*(line.named for line in others))
    possible = named.union(*(line.possible for line in header.unclear))
    if {"x", "y"} <= possible and (counts or not {"x", "y"} <= named):
        line = (counts or [line for line in others if line.possible - line.named])[0]
        raise InvalidInput(
            f"the header of {path} {line.says}; it may say that x runs along the lines of the file"
        )
    return named


def _without_coordinates(table: TextTable, path: Path) -> tuple[np.ndarray, Pair | None]:
    """Heights between a first line of x and a first column of y, and the steps of both.

    A matrix whose first line and column do not both rise or fall evenly is returned as it is.
    """
    values = table.values
    above = table.layout.row(bare(table.header[-1])) if table.header else []
    if len(above) == values.shape[1] - 1 and None not in above:
        values = np.vstack([[np.nan, *above], values])
    x, y = even_step(values[0, 1:]), even_step(values[1:, 0])
    if x is not None and y is not None:
        # In a plane, all lines and columns rise evenly.
        plane = even_step(values[1, 1:]) is not None and even_step(values[1:, 1]) is not None
        if np.isnan(values[0, 0]) or not plane:
            rising = values[1:, 1:][:: int(np.sign(y)), :: int(np.sign(x))]
            return rising, (abs(x), abs(y))
    if table.corner is not None:
        raise InvalidInput(
            f"line {table.line[0]}, column 1 of {path} is {table.corner!r}, which is no number; a "
            "title stands there only if first line and first column are evenly spaced coordinates"
        )
    for name, rows in (("column", table.values.T), ("line", table.values)):
        first, second = rows[0], rows[min(1, len(rows) - 1)]
        if len(first) >= LEAST_EVEN and even_step(first) is not None and even_step(second) is None:
            raise InvalidInput(
                f"the first {name} of {path} rises evenly, as coordinates do, but first line and "
                "first column are not both coordinates: delete them and give size in the scene, or "
                "set surface.kind = 'profiles' if the other columns are profiles"
            )
    return table.values, None


def _from_points(table: TextTable, header: Statements, path: Path) -> Recorded:
    """Map of a list of x, y and height on an even grid; points that are not listed are missing."""
    axes, titled = [title.axis for title in header.titles], header.titled_as_points
    along, across = (axes.index("x"), axes.index("y")) if titled else (0, 1)
    others = [k for k in range(table.values.shape[1]) if k not in (along, across)]
    heights = [k for k in others if titled and axes[k] == "z"] or others
    if titled and len(heights) > 1:
        raise InvalidInput(f"the titles of {path} name x and y, but not one column as height or z")
    nowhere = ~(np.abs(table.values[:, [along, across]]) < LONGEST).all(axis=1)
    if nowhere.any():
        raise InvalidInput(
            f"line {table.line[np.argmax(nowhere)]} of {path} has no x or no y; give all three of "
            "x, y and height"
        )
    (i, dx), (j, dy) = (_axis(table, k, name, path) for k, name in ((along, "x"), (across, "y")))
    shape = int(i.max()) + 1, int(j.max()) + 1
    if len(i) < FEWEST_OF_GRID * shape[0] * shape[1]:
        raise InvalidInput(
            f"{path} has columns of x, y and height, but its {len(i)} points are few of the "
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
    values.flat[site] = table.values[:, heights[0]]
    pixel = zygo_resolution(table.header, path)
    if pixel is not None:
        step = (dx * pixel, dy * pixel) if pixel else None
        return Recorded(values, "um", step, "m", length_hint=UNCALIBRATED)
    of_x, of_y = header.unit_of_coordinates(along), header.unit_of_coordinates(across)
    if (of_x is None) != (of_y is None):
        raise InvalidInput(f"of x and y in {path} only one has a unit; give that of both")
    unit = header.unit_of_values(heights[:1])
    if of_x is None or of_y is None:
        return Recorded(values, unit, (dx, dy))
    what = f"the lengths of {path}"
    return Recorded(values, unit, (dx * in_si(of_x, "m", what), dy * in_si(of_y, "m", what)), "m")


def _axis(table: TextTable, column: int, name: str, path: Path) -> tuple[np.ndarray, float]:
    """Index of each point along an axis, and the step of the grid."""
    x = table.values[:, column]
    ordered = np.sort(x)
    rises = np.diff(ordered)
    if not rises.any():
        raise InvalidInput(
            f"{path} has three columns, but no list of x, y and height on a grid: {name} is the "
            "same in all lines; a map that is three samples wide is read from .npy or .npz"
        )
    # Points of one row of the grid differ by rounding only. The largest rise may be that over a
    # hole of many rows, and smaller ones part them.
    step, width, least = 0.0, np.inf, np.inf
    while width > 2 * OFF_GRID * step:
        least = 0.1 * rises[rises <= least].max()
        parts = np.split(ordered, np.flatnonzero(rises > least) + 1)
        width = max(part[-1] - part[0] for part in parts)
        rows = np.array([part.mean() for part in parts])
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
