"""Matrices of numbers as text, one line a row (first axis), comments behind #.

Between the numbers of a line stand blanks, commas or semicolons.
"""

import re
import warnings
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.field_file.containers import whole
from fem_seal.field_file.recorded import Recorded

# ContactMechanics 1.8 (CommandLineInterface/HardWall.py) ends the head of a gap like this; the
# surfaces of Tamaas 2.9 (`tamaas surface`) have a head of parameters without any unit.
_UNIT = re.compile(r"reported in units of (\S+?)\.?$", re.MULTILINE)
_HEAD_BYTES = 10_000
# "0,5 0,7" and "0,5;0,7"
_DECIMAL_COMMA = re.compile(r"\d,\d+(?:\s+[-+\d]|\s*;)")


def read_text(path: Path) -> Recorded:
    """Read a matrix, and the unit where the head names one.

    Raises
    ------
    InvalidInput
        If the file is missing or its lines are not numbers, or not equally many; if their decimals
        stand behind commas; or if it is a list of points in place of a map.
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
            # An empty file is an error here, not a warning.
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
