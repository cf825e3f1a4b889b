"""Elastic contact of rough surfaces on periodic grids, and the bearing model beside it."""

from fem_seal.contact.bearing import bearing
from fem_seal.contact.halfspace import Layer
from fem_seal.contact.methods import METHODS
from fem_seal.contact.solve import solve
from fem_seal.contact.state import BearingState, ContactState, GapState

__all__ = ["METHODS", "BearingState", "ContactState", "GapState", "Layer", "bearing", "solve"]
