"""The fluid lifts the solid: contact and flow that hold each other, as one state."""

from fem_seal.coupling.lifted import LiftedState, Problem, lifted

__all__ = ["LiftedState", "Problem", "lifted"]
