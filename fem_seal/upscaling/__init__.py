"""From a patch to a seal: what patches of rough contact let a whole seal leak (docs/ring.md)."""

from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.profile import Hertz, TabulatedProfile, Uniform
from fem_seal.upscaling.seal_flow import EndPressures, RingPath, SealFlow, StraightPath, seal_flow

__all__ = [
    "ConductivityTable",
    "EndPressures",
    "Hertz",
    "RingPath",
    "SealFlow",
    "StraightPath",
    "TabulatedProfile",
    "Uniform",
    "seal_flow",
]
