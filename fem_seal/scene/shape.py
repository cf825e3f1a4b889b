"""The section [shape]: a film that is not the rectangle of a grid, with its mesh and its gap."""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import combinations
from math import pi, sqrt
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, Strict, ValidationInfo, field_validator

from fem_seal.errors import InvalidInput
from fem_seal.scene.measured import LengthUnit
from fem_seal.scene.messages import ContradictionError
from fem_seal.scene.section import Count, InputFile, Length, Section
from fem_seal.units import to_si

Angle = Annotated[float, BeforeValidator(partial(to_si, unit="rad")), Field(gt=0, lt=2 * pi)]
Position = Annotated[float, BeforeValidator(partial(to_si, unit="m"))]
MOST_TRIANGLES = 1e8  # more take gmsh hours and tens of gigabytes
# Units of the two axes of a gap on a grid.
_AXES = {"cartesian": ("m", "m"), "polar": ("m", "rad")}


def along_second_axis(value: object, info: ValidationInfo) -> float:
    """A length on a cartesian grid, an angle on a polar one."""
    return to_si(value, _AXES[info.data.get("grid", "cartesian")][1])


SecondPosition = Annotated[float, BeforeValidator(along_second_axis)]
GroupName = Annotated[str, Strict()] | Annotated[int, Strict()]


class Shape(Section):
    """Base class of the shapes; the geometry of each but a file is KIND.geo in meshes/.

    The gap is `gap` or `gap_expression`, or else the grid of [gap], or of [surface] and [contact].
    """

    gap: Length | None = Field(None, description="the same gap everywhere")
    gap_expression: str | None = Field(
        None, description="gap [m] in x, y, r [m] and theta, such as '5e-6 + 1e-6*cos(3*theta)'"
    )
    grid: Literal["cartesian", "polar"] = Field(
        "cartesian", description="kind of the two axes of a gap on a grid"
    )
    grid_origin: tuple[Position, SecondPosition] = Field(
        (0.0, 0.0), description="[x, y], or [radius, angle], of the first sample"
    )
    smallest_size: Length | None = Field(
        None, description="edge length in narrow channels; mesh_size in the open"
    )

    @field_validator("gap_expression")
    @classmethod
    def _is_formula(cls, text: str | None) -> str | None:
        if text is not None:
            from fem_seal.expression import check_formula

            try:
                check_formula(text)
            except InvalidInput as error:
                raise ContradictionError(str(error)) from None
        return text

    @property
    def own_gap(self) -> bool:
        """Whether the section itself defines the gap."""
        return self.gap is not None or self.gap_expression is not None

    @property
    def needs_gmsh(self) -> bool:
        """Whether there is no mesh yet."""
        return True

    @property
    def middle_angle(self) -> float:
        """Angle [rad] within π of which theta of `gap_expression` lies."""
        return 0.0

    def numbers(self) -> Mapping[str, float]:
        """Values of the geometry's constants, in m and rad, which have the names of the fields."""
        shared = {*Shape.model_fields, "kind"}
        own = [name for name in type(self).model_fields if name not in shared]
        return {name: getattr(self, name) for name in own}

    def _contradictions(self) -> Iterator[str]:
        if self.gap is not None and self.gap_expression is not None:
            yield "gap and gap_expression are both given; give one"
        if self.own_gap and (self.grid, self.grid_origin) != ("cartesian", (0.0, 0.0)):
            yield (
                "grid and grid_origin belong to a gap on a grid, but the gap is given by "
                f"{'gap' if self.gap is not None else 'gap_expression'}"
            )
        if self.grid == "polar" and self.grid_origin[0] < 0:
            yield (
                f"grid_origin of a polar grid starts at a radius of {self.grid_origin[0]:g} m, "
                "below 0"
            )
        size = getattr(self, "mesh_size", None)
        if self.smallest_size is not None and size is not None and self.smallest_size > size:
            yield (
                f"smallest_size = {self.smallest_size:g} m must not exceed mesh_size = {size:g} m"
            )


def _too_many(area: float, rim: float, shape: "_Strip | _Ring") -> Iterator[str]:
    """A mesh that would be too large to be made, by area [m²] and length of the rim [m]."""
    # Equilateral triangles; a strip narrower than its edges has two along each of them. The size
    # grows as half the distance from a channel's bank, so it takes about two triangles for each
    # of the smallest edges, and the channel is assumed to be half as long as the rim.
    inside = area / (sqrt(3) / 4) / shape.mesh_size / shape.mesh_size
    narrow = 0.0 if shape.smallest_size is None else rim / shape.smallest_size
    count = inside + rim / shape.mesh_size + narrow
    if count > MOST_TRIANGLES:
        name = "mesh_size" if narrow < count / 2 else "smallest_size"
        yield (
            f"{name} = {getattr(shape, name):g} m would take about {count:.0e} triangles, more "
            f"than {MOST_TRIANGLES:.0e}; choose larger edges"
        )


def _too_long(shape: "PlateWithHoles | _Ring", name: str) -> Iterator[str]:
    """Edges longer than the radius of a circle, which do not follow it."""
    radius = getattr(shape, name)
    if shape.mesh_size > radius:
        yield (
            f"mesh_size = {shape.mesh_size:g} m is longer than {name} = {radius:g} m, so that no "
            "mesh follows the circle; choose an eighth of the radius or less"
        )


class _Strip(Shape):
    length: Length = Field(description="length from inlet to outlet")
    width: Length = Field(description="width between the side walls")
    mesh_size: Length = Field(description="longest edge of the first mesh")

    def _contradictions(self) -> Iterator[str]:
        yield from super()._contradictions()
        area, rim = self.length * self.width, 2 * (self.length + self.width)
        yield from _too_many(area, rim, self)


class Rectangle(_Strip):
    """Squares with alternating diagonals, as on a grid."""

    kind: Literal["rectangle"] = Field(description="name of the shape")

    def _contradictions(self) -> Iterator[str]:
        yield from super()._contradictions()
        if self.smallest_size is not None:
            yield (
                "smallest_size has no meaning for kind = 'rectangle', whose squares are equal; "
                "choose kind = 'strip'"
            )


class Strip(_Strip):
    """Strip between two side walls."""

    kind: Literal["strip"] = Field(description="name of the shape")


class PlateWithHoles(_Strip):
    """Strip with an array of impermeable round pillars."""

    kind: Literal["plate-with-holes"] = Field(description="name of the shape")
    holes: tuple[Count, Count] = Field(description="number of holes along and across the flow")
    radius: Length = Field(description="radius of the holes")

    def numbers(self) -> Mapping[str, float]:
        """Values of the geometry's constants [m], with the two numbers of holes."""
        constants = dict(super().numbers())
        del constants["holes"]
        return constants | dict(zip(("holes_x", "holes_y"), self.holes, strict=True))

    def _contradictions(self) -> Iterator[str]:
        yield from super()._contradictions()
        room = min(self.length / self.holes[0], self.width / self.holes[1])
        if 2 * self.radius >= room:
            yield (
                f"radius = {self.radius:g} m must be below {room / 2:g} m, as the centres of the "
                f"holes are {room:g} m apart; take a smaller radius or fewer holes"
            )
        yield from _too_long(self, "radius")


class _Ring(Shape):
    inner_radius: Length = Field(description="radius of the inlet")
    outer_radius: Length = Field(description="radius of the outlet")
    mesh_size: Length = Field(description="longest edge of the first mesh")

    def _contradictions(self) -> Iterator[str]:
        yield from super()._contradictions()
        if not self.inner_radius < self.outer_radius:
            yield (
                f"inner_radius = {self.inner_radius:g} m must be below outer_radius = "
                f"{self.outer_radius:g} m"
            )
        yield from _too_long(self, "inner_radius")
        width = self.outer_radius - self.inner_radius
        rim = 2 * pi * (self.outer_radius + self.inner_radius)
        yield from _too_many(width * rim / 2, rim, self)


class FaceSeal(_Ring):
    """Ring around the origin, leaking outwards."""

    kind: Literal["face-seal"] = Field(description="name of the shape")


class Sector(_Ring):
    """Part of a ring, from theta = 0 to `angle`, with walls along both radii."""

    kind: Literal["sector"] = Field(description="name of the shape")
    angle: Angle = Field(description="opening angle, below a full turn")

    @property
    def middle_angle(self) -> float:
        """Middle of the sector, so that theta does not jump inside it [rad]."""
        return self.angle / 2


class MeshFile(Shape):
    """A user's own geometry or mesh."""

    kind: Literal["file"] = Field(description="name of the shape")
    path: InputFile = Field(description=".geo, .msh, .vtu or .xdmf")
    unit: LengthUnit = Field(description="unit of its lengths; the file itself has none")
    inlet: GroupName = Field("inlet", description="name or number of the group")
    outlet: GroupName = Field("outlet", description="name or number of the group")
    wall: GroupName = Field("wall", description="name or number of the group")
    mesh_size: Length | None = Field(None, description="longest edge; .geo only")

    @property
    def needs_gmsh(self) -> bool:
        """Whether there is no mesh yet."""
        return self.path.suffix.lower() == ".geo"

    def _contradictions(self) -> Iterator[str]:
        yield from super()._contradictions()
        for one, other in combinations(("inlet", "outlet", "wall"), 2):
            if getattr(self, one) == getattr(self, other):
                yield f"{one} and {other} are both {getattr(self, one)!r}; give each its own group"
        if not self.needs_gmsh and (self.mesh_size or self.smallest_size):
            yield (
                "mesh_size and smallest_size are for a .geo file; "
                f"{self.path.name} is meshed already"
            )
        if self.smallest_size and not self.mesh_size:
            yield "smallest_size needs mesh_size, the size in the open"


AnyShape = Annotated[
    Rectangle | Strip | FaceSeal | Sector | PlateWithHoles | MeshFile, Field(discriminator="kind")
]
