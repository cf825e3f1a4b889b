"""Profiles in text files, as a stylus writes them: x and heights, or heights at a step."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.markers import refuse_markers, without_marked
from fem_seal.field_file.recorded import metres_in
from fem_seal.field_file.text_header import Statements, statements
from fem_seal.field_file.text_table import read_table

# Largest distance of coordinates from an even grid, over its step: written numbers are rounded.
OFF_GRID = 0.05
SAME_STEP = 1e-4  # largest relative difference of steps that count as equal


@dataclass(frozen=True, eq=False)
class Profiles:
    """Heights along lines.

    Attributes
    ----------
    heights : (k, n) float
        Heights [m] of k profiles; NaN where a sample is missing.
    step : float
        Distance of neighbouring samples [m].
    """

    heights: np.ndarray
    step: float


def holds_profiles(path: Path) -> bool:
    """Whether a text file has one or two columns, or titles of x and heights without y."""
    table = read_table(path)
    header = statements(table.header)
    return table.values.shape[1] <= 2 or header.titled_as_profiles


def read_profiles(
    paths: Sequence[Path],
    *,
    unit: str | None = None,
    step: float | None = None,
    missing: float | None = None,
) -> Profiles:
    """Read profiles. Each column is one; a first column that rises evenly is x.

    Profiles of different lengths are cut to the shortest. Samples at the ends that are missing in
    any profile are left out of all.

    Parameters
    ----------
    paths : sequence of Path
        Text files.
    unit : str, optional
        Unit of heights and x if the files have none.
    step : float, optional
        Distance of neighbouring samples [m] if the files have none.
    missing : float, optional
        Number in the files that marks missing samples.

    Raises
    ------
    InvalidInput
        If a file cannot be read, unit or step are unknown or contradict the file, or the steps of
        two files differ.
    """
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


def _profiles(path: Path, unit: str | None, step: float | None, missing: float | None) -> Profiles:
    table = read_table(path)
    header, values = statements(table.header), table.values
    for mark in (*header.missing, *([] if missing is None else [missing])):
        values = without_marked(values, mark)
    even = _even_step(values[:, 0]) if values.shape[1] > 1 else None
    if even is not None:
        values = values[:, 1:]
    elif header.titled_as_profiles:
        raise InvalidInput(f"x in {path} does not rise evenly; resample the profile to even steps")
    refuse_markers(values, str(path))
    scale = metres_in(header.unit_of_values, unit, f"the heights of {path}")
    return Profiles(values.T * scale, _step(path, header, even, unit, step))


def _even_step(x: np.ndarray) -> float | None:
    """Step of a column that rises evenly; None for other columns."""
    if len(x) < 3 or not (np.diff(x) > 0).all():
        return None
    step = float(x[-1] - x[0]) / (len(x) - 1)
    off = np.abs(x - x[0] - step * np.arange(len(x))).max()
    return step if off < OFF_GRID * step else None


def _step(
    path: Path, header: Statements, even: float | None, unit: str | None, stated: float | None
) -> float:
    """Step of the samples [m]: from the column x, the header, or the scene."""
    if even is not None:
        step: float | None = even * metres_in(header.unit_along("x"), unit, f"x in {path}")
    else:
        step = header.metres(header.steps, "x")
    if step is None and stated is None:
        raise InvalidInput(
            f"{path} has no x, and does not say the step of its samples; give it, such as "
            "surface.step = '0.5 um'"
        )
    if step is not None and stated is not None and not isclose(step, stated, rel_tol=SAME_STEP):
        raise InvalidInput(
            f"{path} has a step of {step:g} m, but surface.step = {stated:g} m was given; leave "
            "out the wrong one"
        )
    return step if step is not None else float(stated or 0)
