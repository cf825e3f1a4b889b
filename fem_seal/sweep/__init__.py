"""A scene over the values of some of its fields: one file and one row for each point."""

from fem_seal.points import Work
from fem_seal.sweep.axis import combinations, read_points
from fem_seal.sweep.point import Point
from fem_seal.sweep.run import Tally, sweep
