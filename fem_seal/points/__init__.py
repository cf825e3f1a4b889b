"""Many points: independent computations in one process or many, a file for each point."""

from fem_seal.points.compute import Outcome, compute_points, compute_study, points_of
from fem_seal.points.folder import PointFolder
from fem_seal.points.task import StudyTask, Task
from fem_seal.points.work import Expected, Work
