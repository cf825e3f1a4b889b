"""The fluid lifts the solid: contact and flow in one equilibrium."""

from fem_seal.coupling.problem import LiftProblem
from fem_seal.coupling.search import lifted_state
from fem_seal.coupling.state import SETTLED, LiftedState
