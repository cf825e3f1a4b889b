"""The sections [solid] and [contact]."""

from collections.abc import Callable, Iterator
from typing import Annotated, Literal

from pydantic import Field

from fem_seal.contact import Arithmetic, ContactStopping, ElasticSolid, Layer
from fem_seal.contact import settings as contact_settings
from fem_seal.contact.methods import SMALLEST_TOLERANCE
from fem_seal.errors import present
from fem_seal.scene.section import (
    Count,
    Length,
    NonNegativePressure,
    Number,
    OneOrTwo,
    PoissonRatio,
    Pressure,
    Section,
    is_changed,
    not_one,
)


class Solid(Section):
    """Elasticity of the two solids, mapped to one contact modulus."""

    contact_modulus: Pressure | None = Field(None, description="E*, or the two keys below")
    youngs_modulus: Annotated[tuple[Pressure, ...], *OneOrTwo] | None = Field(
        None, description="E of both solids, or of one against a rigid counter-face"
    )
    poisson_ratio: Annotated[tuple[PoissonRatio, ...], *OneOrTwo] | None = Field(
        None, description="ν of the solids of youngs_modulus"
    )
    layer_thickness: Length | None = Field(
        None, description="thickness of an elastic layer on a rigid base"
    )
    layer_base: Literal["fixed", "sliding"] = Field(
        "fixed", description="layer bonded to its base, or without friction on it"
    )
    layer_poisson_ratio: PoissonRatio | None = Field(
        None, description="ν of the layer; poisson_ratio, else 0.5, if left out"
    )

    def _contradictions(self) -> Iterator[str]:
        yield from not_one(self, ("contact_modulus", "youngs_modulus"))
        E, ratios = self.youngs_modulus or (), self.poisson_ratio or ()
        if (self.youngs_modulus is None) != (self.poisson_ratio is None):
            yield "youngs_modulus and poisson_ratio belong together; give both"
        if len(E) != len(ratios):
            yield (
                f"youngs_modulus is that of {_solids(len(E))}, and poisson_ratio that of "
                f"{_solids(len(ratios))}; give both for the same solids"
            )
        if self.layer_thickness is None:
            if is_changed(self, "layer_base") or self.layer_poisson_ratio is not None:
                yield (
                    "layer_base and layer_poisson_ratio are those of a layer; give its "
                    "layer_thickness, or leave them out for a half-space"
                )
            return
        if len(E) == 2:
            yield (
                "layer_thickness is for one solid, the layer, and what it touches is taken for "
                "rigid; give youngs_modulus and poisson_ratio of the layer alone, or "
                "contact_modulus, its E/(1 - ν²)"
            )
        if self.layer_poisson_ratio not in (None, *ratios) and ratios:
            yield (
                f"layer_poisson_ratio = {self.layer_poisson_ratio:g} and poisson_ratio = "
                f"{ratios[0]:g} are those of one layer; leave one out"
            )

    @property
    def elastic(self) -> ElasticSolid:
        """The solid as an argument of the contact solver."""
        if self.layer_thickness is None:
            return ElasticSolid(self.E_star)
        (nu,) = self.poisson_ratio or (0.5,)
        if self.layer_poisson_ratio is not None:
            nu = self.layer_poisson_ratio
        return ElasticSolid(self.E_star, Layer(self.layer_thickness, self.layer_base, nu))

    @property
    def E_star(self) -> float:
        """Contact modulus [Pa]: 1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2 (Johnson 1985, eq. 4.24).

        A rigid counter-face, as that of a single solid, adds nothing to the sum.
        """
        if self.youngs_modulus is None or self.poisson_ratio is None:
            return present(self.contact_modulus, "solid.contact_modulus")
        pairs = zip(self.youngs_modulus, self.poisson_ratio, strict=True)
        return 1 / sum((1 - nu**2) / E for E, nu in pairs)


def _solids(count: int) -> str:
    return "one solid" if count == 1 else "both solids"


LOADS = ("pressure", "area_fraction", "mean_gap")
ITERATION = ("tolerance", "solver", "max_iterations", "precision", "threads")


class Contact(Section):
    """Contact of the two faces: the model, exactly one load, and the solver."""

    model: Literal["gfmd", "bearing"] = Field("gfmd", description="elastic, or plain cutting")
    pressure: NonNegativePressure | None = Field(
        None, description="mean pressure, 0 is touch; gfmd only"
    )
    area_fraction: Number | None = Field(None, ge=0, lt=1, description="contact area / A0")
    mean_gap: Length | None = Field(None, description="mean of the gap")
    tolerance: Number = Field(
        1e-6, ge=SMALLEST_TOLERANCE, lt=1, description="of the contact's certificate; gfmd only"
    )
    solver: Literal["free-set-cg", "damped", "fista", "polonsky-keer"] = Field(
        "free-set-cg", description="gfmd only; damped is the letter's own relaxation"
    )
    max_iterations: Count | None = Field(
        None, description="gfmd only; the contact has failed after so many"
    )
    precision: Literal["mixed", "double"] = Field(
        "mixed", description="single until near the tolerance, or double throughout; gfmd only"
    )
    threads: Count | None = Field(
        None, le=1024, description="gfmd only; the cores of this process if left out"
    )

    def _contradictions(self) -> Iterator[str]:
        # A [seal] may give the load in place of this section: `_load` of `checks`.
        if any(getattr(self, name) is not None for name in LOADS):
            yield from not_one(self, LOADS)
        if self.model == "gfmd":
            return
        if self.pressure is not None:
            yield (
                "pressure has no meaning for model = 'bearing', which knows no elasticity; "
                "give area_fraction or mean_gap"
            )
        for name in ITERATION:
            if is_changed(self, name):
                yield (
                    f"{name} is of the iteration for an elastic contact, and model = 'bearing' "
                    "needs none; leave it out"
                )

    @property
    def is_elastic(self) -> bool:
        """Whether the model knows elasticity and pressures; its state is a `ContactState`."""
        return self.model == "gfmd"

    @property
    def load(self) -> contact_settings.Load:
        """The one load that is set; see `Scene.load` for a scene whose [seal] gives it."""
        return contact_settings.one_load(
            pressure=self.pressure, area_fraction=self.area_fraction, mean_gap=self.mean_gap
        )

    def stopping(self, progress: Callable[[int, float], None] | None = None) -> ContactStopping:
        """Method and tolerance of an elastic contact."""
        return ContactStopping(self.solver, self.tolerance, self.max_iterations, progress)

    @property
    def arithmetic(self) -> Arithmetic:
        """Threads and precision of the transforms."""
        return Arithmetic(self.threads, self.precision)
