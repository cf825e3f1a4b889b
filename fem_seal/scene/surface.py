"""The rough counter-face: what each kind of surface says of itself, and the random one."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from fem_seal.errors import InvalidInput
from fem_seal.scene.section import Count, Length, Number, Section, Seed, not_one
from fem_seal.surface.spectrum import Spectrum


class SurfaceSection(Section):
    """Base class of the kinds of surface: what the steps, checks and texts ask of each."""

    #: fields to which all heights are proportional; an error of the heights changes those given
    proportional: ClassVar[tuple[str, ...]]
    #: field whose values make other patches of the same surface
    seed_field: ClassVar[str]
    #: key and sentence of the entry of the error budget on what the heights lack; None: nothing
    lacks: ClassVar[tuple[str, str] | None] = None


class SelfAffine(SurfaceSection):
    """A random rough surface, ``<|h(q)|^2> ~ q^-(2+2H)`` between two cut-offs."""

    proportional = ("rms_height", "rms_slope")
    seed_field = "seed"

    kind: Literal["self-affine"] = Field(description="kind of surface")
    shape: tuple[Count, Count] = Field(description="samples [nx, ny]")
    size: tuple[Length, Length] = Field(description="lengths [Lx, Ly] of the periodic cell")
    hurst: Number = Field(gt=0, le=1, description="Hurst exponent H, 0 < H <= 1")
    long_wavelength: Length = Field(description="long cut-off of the roughness")
    short_wavelength: Length = Field(description="short cut-off of the roughness")
    rolloff_wavelength: Length | None = Field(
        None, description="the spectrum is constant from the long cut-off down to here"
    )
    rms_height: Length | None = Field(None, description="rms height; this or rms_slope")
    rms_slope: Number | None = Field(None, gt=0, description="rms slope; this or rms_height")
    scaling: Literal["exact", "ensemble"] = Field(
        "exact", description="the rms value holds on this sample, or in the ensemble mean"
    )
    seed: Seed = Field(0, description="seed of the random phases")

    @property
    def spectrum(self) -> Spectrum:
        """Cut-offs and Hurst exponent as an argument of the synthesis."""
        return Spectrum(
            self.hurst, self.long_wavelength, self.short_wavelength, self.rolloff_wavelength
        )

    def _contradictions(self) -> Iterator[str]:
        yield from not_one(self, ("rms_height", "rms_slope"))
        try:
            self.spectrum.require_room(self.shape, self.size)
        except InvalidInput as error:
            yield str(error)
