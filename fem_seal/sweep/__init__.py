"""A scene over the values of some of its fields: one row a point, done points are kept."""

from fem_seal.sweep.axis import Axis
from fem_seal.sweep.sweep import Tally, sweep
from fem_seal.sweep.table import Row, Table

__all__ = ["Axis", "Row", "Table", "Tally", "sweep"]
