"""From a patch to a seal: the leak rate of a whole seal (docs/theory/scales-apart.md)."""

from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.leak_path import EndPressures, RingPath, StraightPath
from fem_seal.upscaling.network import (
    DrawnSeals,
    PatchCount,
    drawn_seals,
    generalised_interval,
    network_conductivity,
    sealed_share,
)
from fem_seal.upscaling.patch_conductivity import LoadedPatch, PatchFlow, refined_table
from fem_seal.upscaling.profile import Hertz, TabulatedProfile, uniform
from fem_seal.upscaling.seal_flow import SealFlow, seal_flow

__all__ = [
    "ConductivityTable",
    "DrawnSeals",
    "EndPressures",
    "Hertz",
    "LoadedPatch",
    "PatchCount",
    "PatchFlow",
    "RingPath",
    "SealFlow",
    "StraightPath",
    "TabulatedProfile",
    "drawn_seals",
    "generalised_interval",
    "network_conductivity",
    "refined_table",
    "seal_flow",
    "sealed_share",
    "uniform",
]
