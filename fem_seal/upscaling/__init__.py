"""From a patch to a seal: the leak rate of a whole seal (docs/theory/scales-apart.md)."""

from fem_seal.pressure_profile import Hertz, TabulatedProfile, uniform
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.leak_path import EndPressures, RingPath, StraightPath
from fem_seal.upscaling.path_flow import SealFlow, seal_flow
