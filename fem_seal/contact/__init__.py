"""Elastic contact of rough surfaces on periodic grids, and the bearing model."""

from fem_seal.contact.halfspace import Layer
from fem_seal.contact.methods import CONTACT_METHODS, ContactStopping
from fem_seal.contact.plane_cut import bearing
from fem_seal.contact.settings import Arithmetic, ElasticSolid, Load
from fem_seal.contact.solve import press
from fem_seal.contact.state import BearingState, ContactState, GapState
