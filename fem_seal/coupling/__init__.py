"""The fluid lifts the solid: contact and flow that hold each other, as one state."""

from fem_seal.coupling.lifted import LiftedState, LiftProblem, lifted

__all__ = ["LiftProblem", "LiftedState", "lifted"]
