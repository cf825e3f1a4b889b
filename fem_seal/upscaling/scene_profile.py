"""The pressure profile, the leak path and its ends of a scene with [seal]."""

from math import pi

from fem_seal.errors import InvalidInput, present
from fem_seal.pressure_profile import Hertz, Profile, TabulatedProfile, uniform
from fem_seal.scene import Scene
from fem_seal.upscaling.leak_path import EndPressures, LeakPath, RingPath, StraightPath

# Relative difference of a table's length from that of a ring, which rounded numbers make.
SAME_LENGTH = 1e-4


def leak_path_of(scene: Scene, load_share: float = 1.0) -> tuple[Profile, LeakPath, EndPressures]:
    """A part of the total pressure along the leak path, the path, and the pressures at its ends.

    The scene has a [seal].
    """
    profile, path = _along(scene)
    ends = EndPressures.of(scene.drive, scene.flow.gauge_pressures)
    return profile.times(load_share), path, ends


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
    """Contact pressure over a width [m], None where the profile has its own."""
    seal, modulus = present(scene.seal, "[seal]"), present(scene.solid, "[solid]").E_star
    own = seal.own_profile(modulus, width)
    if own is not None:
        return own
    width = present(width, "seal.leak_path")
    pressure = present(present(scene.contact, "[contact]").pressure, "contact.pressure")
    if seal.pressure_profile == "hertz":
        # The mean of Hertz's pressure over its width is π/4 of the maximum.
        return Hertz(4 / pi * pressure, width)
    return uniform(pressure, width)
