"""The pressure profile, the leak path and its ends of a scene with [seal]."""

from math import pi
from pathlib import Path

from fem_seal.errors import InvalidInput, present
from fem_seal.field_file.text_header import column_titles, names_units
from fem_seal.field_file.text_table import is_comment, read_table
from fem_seal.scene import Scene
from fem_seal.upscaling.leak_path import EndPressures, LeakPath, RingPath, StraightPath
from fem_seal.upscaling.profile import Hertz, Profile, TabulatedProfile, uniform

# Relative difference of a table's length from that of a ring, which rounded numbers make.
SAME_LENGTH = 1e-4
SI = "m", "Pa"  # units of x and pressure in a table that names none


def leak_path_of(scene: Scene, part: float = 1.0) -> tuple[Profile, LeakPath, EndPressures]:
    """A part of the contact pressure along the leak path, the path, and the pressures at its ends.

    The scene has a [seal].
    """
    profile, path = _along(scene)
    ends = EndPressures.of(scene.drive, scene.flow.gauge_pressures)
    return profile.times(part), path, ends


def _along(scene: Scene) -> tuple[Profile, LeakPath]:
    seal = present(scene.seal, "[seal]")
    width = seal.leak_path
    ring = None
    if seal.is_ring:
        ring = RingPath(
            present(seal.inlet_radius, "seal.inlet_radius"),
            present(seal.outlet_radius, "seal.outlet_radius"),
        )
        width = ring.length
    profile = _profile(scene, width)
    if ring is None:
        circumference = present(seal.circumference, "seal.circumference")
        return profile, StraightPath(profile.length, circumference)
    if isinstance(profile, TabulatedProfile):
        if abs(profile.length / ring.length - 1) > SAME_LENGTH:
            raise InvalidInput(
                f"{seal.table} is {profile.length:g} m long, but from seal.inlet_radius to "
                f"seal.outlet_radius are {ring.length:g} m"
            )
        stretched = profile.x * (ring.length / profile.length)
        profile = TabulatedProfile(stretched, profile.pressure)
    return profile, ring


def _profile(scene: Scene, width: float | None) -> Profile:
    """Contact pressure over a width [m]; a table and a line load have their own width."""
    seal = present(scene.seal, "[seal]")
    if seal.table is not None:
        return read_profile(seal.table)
    if seal.line_load is not None:
        radius = present(seal.cylinder_radius, "seal.cylinder_radius")
        return Hertz.pressed(seal.line_load, radius, present(scene.solid, "[solid]").E_star)
    width = present(width, "seal.leak_path")
    if seal.maximum_pressure is not None:
        return Hertz(seal.maximum_pressure, width)
    pressure = present(present(scene.contact, "[contact]").pressure, "contact.pressure")
    if seal.pressure_profile == "hertz":
        # The mean of Hertz's pressure over its width is π/4 of the maximum.
        return Hertz(4 / pi * pressure, width)
    return uniform(pressure, width)


def read_profile(path: Path) -> TabulatedProfile:
    """Read a table of x and pressure, as finite-element codes write it.

    Two columns, whose titles may name their units: "x [mm], pressure [MPa]". Without any they are m
    and Pa, unless the header names another unit. InvalidInput if it is no such table, or the units
    are not clear.
    """
    table = read_table(path, columns=2)
    titles = column_titles(table)
    axes = [title.axis for title in titles]
    order = (1, 0) if "p" in axes[:1] or axes[1:] == ["x"] else (0, 1)
    sizes = [titles[k].size(si, path) if titles else None for k, si in zip(order, SI, strict=True)]
    words = [line for line in table.header if line.strip(";, \t")]
    unclear = [line for line in words if not titles and not is_comment(line)]
    if None in sizes:
        unclear += [line for line in table.header if names_units(line) or sizes != [None, None]]
    if unclear:
        raise InvalidInput(
            f"{path}: the units of both columns must stand in one line such as 'x [mm], pressure "
            f"[MPa]', not as in {unclear[-1].strip()!r}; without any they are m and Pa"
        )
    x, pressure = (table.values[:, k] * (size or 1) for k, size in zip(order, sizes, strict=True))
    try:
        return TabulatedProfile(x, pressure)
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None
