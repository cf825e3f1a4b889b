"""The pressure profile and the leak path of a scene with [seal]."""

from math import pi
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput, present
from fem_seal.scene import Scene
from fem_seal.units import to_si
from fem_seal.upscaling.leak_path import LeakPath, RingPath, StraightPath
from fem_seal.upscaling.profile import Hertz, Profile, TabulatedProfile, Uniform

# Relative difference of a table's length from that of a ring, which rounded numbers make.
SAME_LENGTH = 1e-4


def profile_of(scene: Scene) -> tuple[Profile, LeakPath]:
    """Contact pressure along the leak path, and the path, of a scene with [seal]."""
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
    return Uniform(pressure, width)


def read_profile(path: Path) -> TabulatedProfile:
    """Read a table of x and pressure, as finite-element codes write it.

    Two columns, separated by commas, semicolons or blanks. A first line may name them, with units
    in brackets: "x [mm], pressure [MPa]"; without units they are m and Pa. Lines that begin with #
    are left out.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput(f"cannot read the pressure profile {path}: {error}") from None
    lines = [line for line in text.splitlines() if line.strip() and line.lstrip()[0] != "#"]
    if lines and _numbers(lines[0]) is None:
        units, lines = _units(lines[0], path), lines[1:]
    else:
        units = (1.0, 1.0)
    rows = [_numbers(line) for line in lines]
    for line, row in zip(lines, rows, strict=True):
        if row is None:
            raise InvalidInput(
                f"{path}: {line.strip()!r} is no line of a pressure profile; give two numbers, x "
                "and pressure"
            )
    x, pressure = np.array(rows).reshape(-1, 2).T
    try:
        return TabulatedProfile(x * units[0], pressure * units[1])
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {error}") from None


def _numbers(line: str) -> tuple[float, float] | None:
    words = line.replace(";", " ").replace(",", " ").split()
    try:
        x, pressure = map(float, words)
    except ValueError:
        return None
    return x, pressure


def _units(line: str, path: Path) -> tuple[float, float]:
    """Sizes [m] and [Pa] of the units in brackets of a line of names."""
    parts = line.replace(";", ",").split(",")
    if len(parts) != 2:
        raise InvalidInput(
            f"{path}: the first line {line.strip()!r} should name two columns, such as "
            '"x [mm], pressure [MPa]"'
        )
    names = [part.partition("[")[2].partition("]")[0].strip() for part in parts]
    try:
        sizes = [
            to_si(f"1 {name}", unit) if name else 1.0
            for name, unit in zip(names, ("m", "Pa"), strict=True)
        ]
    except ValueError as error:
        raise InvalidInput(f"{path}: a unit of {line.strip()!r}: {error}") from None
    return sizes[0], sizes[1]
