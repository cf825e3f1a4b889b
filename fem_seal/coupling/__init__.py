"""The fluid lifts the solid: contact and flow that hold each other, as one state."""

from fem_seal.coupling.lifted import lifted
from fem_seal.coupling.passes import PassTuning
from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.state import LiftedState

__all__ = ["LiftProblem", "LiftedState", "PassTuning", "lifted"]
