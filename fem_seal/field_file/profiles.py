"""Profiles in text files, as a stylus writes them: x and heights, or heights at a step."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.markers import refuse_markers, without_marked
from fem_seal.field_file.own_layouts import read_own_layout
from fem_seal.field_file.recorded import Recorded, even_step, metres_in, refuse_other_unit
from fem_seal.field_file.text_header import statements_of
from fem_seal.field_file.text_table import read_table
from fem_seal.memory import within_available_memory

SAME_STEP = 1e-4  # largest relative difference of steps that count as equal


@dataclass(frozen=True, eq=False)
class Profiles:
    """Heights along lines."""

    heights: np.ndarray  #: (k, n), heights [m] of k profiles; NaN where a sample is missing
    step: float  #: distance of neighbouring samples [m]


def holds_profiles(path: Path) -> bool:
    """Whether a text file has one or two columns, or titles of x and heights without y."""
    with within_available_memory(str(path)):
        recorded = read_own_layout(path)
        if recorded is not None:
            return recorded.values.shape[1] == 1
        table = read_table(path)
    header = statements_of(table, path)
    return table.values.shape[1] <= 2 or header.titled_as_profiles


def says_step(path: Path) -> bool:
    """Whether a file of profiles has x, or says the step of its samples."""
    with within_available_memory(str(path)):
        return _recorded(path).spacing is not None


def read_profiles(
    paths: Sequence[Path],
    *,
    unit: str | None = None,
    step: float | None = None,
    missing: float | None = None,
) -> Profiles:
    """Read profiles. Each column is one; a first column that rises or falls evenly is x.

    Profiles of different lengths are cut to the shortest. Samples at the ends that are missing in
    any profile are left out of all.

    Parameters
    ----------
    unit
        Unit of heights and x if the files have none.
    step
        Distance of neighbouring samples [m] if the files have none.
    missing
        Number in the files that marks missing samples.
    """
    with within_available_memory(str(paths[0])):
        read = [_profiles(path, unit, step, missing) for path in paths]
    for path, other in zip(paths, read, strict=True):
        if not isclose(other.step, read[0].step, rel_tol=SAME_STEP):
            raise InvalidInput(
                f"profiles in {path} have a step of {other.step:g} m, and those in {paths[0]} one "
                f"of {read[0].step:g} m; resample them to the same"
            )
    shortest = min(profiles.heights.shape[1] for profiles in read)
    heights = np.concatenate([profiles.heights[:, :shortest] for profiles in read])
    complete = np.flatnonzero(~np.isnan(heights).any(axis=0))
    if complete.size:
        heights = heights[:, complete[0] : complete[-1] + 1]
    return Profiles(heights, read[0].step)


def _profiles(
    path: Path, unit: str | None, stated: float | None, missing: float | None
) -> Profiles:
    recorded = _recorded(path)
    values = recorded.values if missing is None else without_marked(recorded.values, missing)
    refuse_markers(values, str(path))
    heights = values.T * metres_in(recorded.unit, unit, f"the heights of {path}")
    step, own_unit = stated, recorded.length_unit
    if recorded.spacing is not None:
        of_x = metres_in(own_unit, None if own_unit else unit, f"x in {path}")
        step = recorded.spacing[0] * of_x
        if not step > 0:
            raise InvalidInput(f"{path} has a step of {step:g} m, which must be above 0")
        if stated is not None and not isclose(step, stated, rel_tol=SAME_STEP):
            raise InvalidInput(
                f"{path} has a step of {step:g} m, but surface.step = {stated:g} m was given; "
                "leave out the wrong one"
            )
        if own_unit is None:
            remedy = "give x a title with its own, such as 'x [mm]'"
            refuse_other_unit(heights, (step,), str(unit), f"x in {path} has no unit", remedy)
    if step is None:
        raise InvalidInput(
            f"{path} has no x, and does not say the step of its samples; give it, such as "
            f"surface.step = '0.5 um'{recorded.length_hint}"
        )
    return Profiles(heights, step)


def _recorded(path: Path) -> Recorded:
    return read_own_layout(path) or _from_table(path)


def _from_table(path: Path) -> Recorded:
    """Samples (n, k) of k profiles, and their step, if the file has x or says it."""
    table = read_table(path)
    header, values = statements_of(table, path), table.values
    # x is the column with this title, else the first one.
    along = next((k for k, title in enumerate(header.titles) if title.axis == "x"), 0)
    even = even_step(values[:, along]) if values.shape[1] > 1 else None
    columns = list(range(values.shape[1]))
    unit_of_step: str | None = "m"
    hint = ""
    if even is not None:
        values = np.delete(values, columns.pop(along), axis=1)[:: 1 if even > 0 else -1]
        step: float | None = abs(even)
        unit_of_step = header.unit_of_coordinates(along)
    elif header.titled_as_profiles:
        raise InvalidInput(
            f"x in {path} neither rises nor falls evenly; resample the profile to even steps"
        )
    elif header.unclear:
        step, hint = None, f"; its header {header.unclear[0].says}"
    else:
        step = header.metres(header.steps, "x")
    counted = [k for k, column in zip(columns, values.T, strict=True) if even_step(column)]
    if counted:
        raise InvalidInput(
            f"column {counted[0] + 1} of {path} rises or falls evenly, as x does and no profile: "
            "give x a title such as 'x [mm]', and delete the other one"
        )
    for mark in header.missing:
        values = without_marked(values, mark)
    spacing = None if step is None else (step, step)
    unit = header.unit_of_values(columns)
    return Recorded(values, unit, spacing, unit_of_step, length_hint=hint)
