"""Maps as text: one line for each row (first axis), comments after #.

Blanks, commas or semicolons separate the numbers of a line.
"""

import re
import warnings
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import whole
from fem_seal.field_file.recorded import Recorded

# ContactMechanics 1.8 (CommandLineInterface/HardWall.py) ends the header of a gap with this line.
# Surfaces of Tamaas 2.9 (`tamaas surface`) have a header of parameters, and no unit.
_UNIT = re.compile(r"reported in units of (\S+?)\.?$", re.MULTILINE)
_HEAD_BYTES = 10_000
# "0,5 0,7" and "0,5;0,7"
_DECIMAL_COMMA = re.compile(r"\d,\d+(?:\s+[-+\d]|\s*;)")


def read_text(path: Path) -> Recorded:
    """Read a matrix, and its unit if the header names one.

    Raises
    ------
    InvalidInput
        If the file is missing, if its lines are not numbers or differ in length, if it has decimal
        commas, or if it lists points instead of a map.
    """
    with whole(path, "text"):
        with path.open(encoding="utf-8") as file:
            lines = file.readlines(_HEAD_BYTES)
        head = "".join(line for line in lines if line.startswith("#"))
        first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
        if _DECIMAL_COMMA.search(first):
            raise InvalidInput(f"{path} has decimal commas; write decimal points")
        separator = next((mark for mark in ";," if mark in first), None)
        with warnings.catch_warnings():
            # Treat an empty file as an error; NumPy only warns.
            warnings.simplefilter("error", UserWarning)
            try:
                values = np.loadtxt(path, ndmin=2, delimiter=separator)
            except UserWarning:
                raise ValueError("no numbers") from None
    if values.shape[1] == 3 and len(values) > 3:
        raise InvalidInput(
            f"{path} has three columns, as a list of x, y and height has, which is no map of "
            "heights on a grid: write it as one, a line a row (a map that is three samples wide as "
            ".npy or .npz)"
        )
    unit = _UNIT.search(head)
    return Recorded(values, unit.group(1) if unit else None)
