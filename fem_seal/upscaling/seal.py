"""The leak rate of a scene's whole seal, from its patches."""

from dataclasses import dataclass
from itertools import chain
from math import inf, pi
from pathlib import Path

import numpy as np

from fem_seal.errors import InvalidInput, present
from fem_seal.patch import Patch
from fem_seal.scene import Scene, SelfAffineSurface
from fem_seal.units import to_si
from fem_seal.upscaling.network import (
    PatchCount,
    drawn_seals,
    generalised_interval,
    sealed_share,
)
from fem_seal.upscaling.patch_conductivity import LoadedPatch, PatchFlow, refined
from fem_seal.upscaling.profile import Hertz, Profile, TabulatedProfile, Uniform
from fem_seal.upscaling.seal_flow import EndPressures, StraightPath, seal_flow


@dataclass(frozen=True, eq=False)
class SealLeak:
    """Leak rate of a seal, and what it comes from.

    Parameters
    ----------
    state : "leaking", "sealed" or "lifted off"
    value, lower, upper : float
        Leak rate [m³/s], of a gas at reference conditions; 0 if sealed, infinite if lifted off. The
        bounds are those of flow and load table, for the patches at hand.
    patches : tuple of PatchFlow
        What the seal would leak if all its patches were like one of the realizations.
    count : PatchCount
        Patches along the part of the path that seals, and around the seal.
    scatter : float
        Standard deviation of the leak rate of such seals over its mean.
    interval : (float, float) or None
        Confidence interval [m³/s] of the leak rate, as far as patches scatter; None where the
        realizations say too little.
    share_sealed : (float, float, float)
        Share of sealed realizations, and its confidence interval (Clopper and Pearson).
    converged : bool
    reason : str
        Why not, else empty.
    """

    state: str
    value: float
    lower: float
    upper: float
    patches: tuple[PatchFlow, ...]
    count: PatchCount
    scatter: float
    interval: tuple[float, float] | None
    share_sealed: tuple[float, float, float]
    converged: bool
    reason: str


def solve_seal(patch: Patch) -> SealLeak:
    """Leak rate of the seal of a scene with [seal].

    Parameters
    ----------
    patch : Patch
        First of the realizations.

    Returns
    -------
    SealLeak

    Raises
    ------
    InvalidInput
        If the table of the pressure profile cannot be read.
    NotConverged
        If a contact is not solved to its tolerance.
    """
    scene = patch.scene
    seal, profile = present(scene.seal, "[seal]"), profile_of(scene)
    ends = EndPressures.of(scene.drive, scene.gauge_pressures)
    path = StraightPath(profile.length, seal.circumference)
    flows = []
    for number in range(seal.patches):
        patch.report("seal", f"patch {number + 1} of {seal.patches}")
        flows.append(
            refined(
                LoadedPatch(realization(patch, number)),
                lambda table: seal_flow(table, profile, path, ends),
                profile.highest,
                ends.inlet,
                ends.outlet,
                uniform=isinstance(profile, Uniform),
                tolerance=seal.rtol,
                most_loads=seal.max_loads,
            )
        )
    return _together(tuple(flows), path, present(patch.surface, "surface").size)


def _together(
    flows: tuple[PatchFlow, ...], path: StraightPath, size: tuple[float, float]
) -> SealLeak:
    """Put the patches of a size [m] into the network of the seal."""
    rates = np.array([(one.flow.lower, one.flow.value, one.flow.upper) for one in flows])
    lengths = [one.flow.path.sealing_length for one in flows if one.flow.path]
    length = float(np.median(lengths)) if lengths else path.length
    count = PatchCount.of(length, path.circumference, size)
    sealed = sum(one.flow.state == "sealed" for one in flows)
    share = sealed / len(flows), *sealed_share(sealed, len(flows))
    reasons = [one.reason for one in flows if not one.converged]
    rest = not reasons, reasons[0] if reasons else ""
    if any(one.flow.state == "lifted off" for one in flows):
        return SealLeak("lifted off", inf, inf, inf, flows, count, 0.0, None, share, *rest)
    drawn = drawn_seals(rates, count)
    lower, value, upper = map(float, drawn.mean)
    interval = generalised_interval(rates[:, 1], count.along)
    state = "sealed" if upper == 0 else "leaking"
    return SealLeak(
        state, value, lower, upper, flows, count, drawn.scatter, interval, share, *rest
    )


def realization(patch: Patch, number: int) -> Patch:
    """Patch with another seed, or of a twin of the measured map; number 0 is the patch itself.

    Parameters
    ----------
    patch : Patch
    number : int
        The seed, or the seed of the twin, is raised by it.
    """
    scene, surface = patch.scene, present(patch.scene.surface, "[surface]")
    name = "seed" if isinstance(surface, SelfAffineSurface) else "twin_seed"
    if number:
        seed = (getattr(surface, name) or 0) + number
        scene = scene.model_copy(update={"surface": surface.model_copy(update={name: seed})})
    # The flows of a chain of loads are not drawn, and a conductivity without slip is the same at
    # all fluid pressures.
    output = scene.output.model_copy(update={"products": ("seal",)})
    fluid = present(scene.fluid, "[fluid]")
    fluid = fluid.model_copy(update={"slip": False if fluid.kind == "gas" else None})
    scene = scene.model_copy(update={"output": output, "fluid": fluid})
    heights = None if number else patch.surface
    return Patch(scene, patch.report, surface=heights, comm=patch.comm)


def profile_of(scene: Scene) -> Profile:
    """Contact pressure along the leak path of a scene with [seal]."""
    seal = present(scene.seal, "[seal]")
    if seal.table is not None:
        return read_profile(seal.table)
    pressure = present(present(scene.contact, "[contact]").pressure, "contact.pressure")
    leak_path = present(seal.leak_path, "seal.leak_path")
    if seal.pressure_profile == "hertz":
        # The mean of Hertz's pressure over its width is π/4 of the maximum.
        return Hertz(4 / pi * pressure, leak_path)
    return Uniform(pressure, leak_path)


def read_profile(path: Path) -> TabulatedProfile:
    """Read a table of x and pressure, as finite-element codes write it.

    Two columns, separated by commas, semicolons or blanks. A first line may name them, with units
    in brackets: "x [mm], pressure [MPa]"; without units they are m and Pa. Lines that begin with #
    are left out.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InvalidInput
        If the file is no such table.
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


def loads_of(seal: SealLeak) -> tuple[float, ...]:
    """All net loads [Pa] under which patches were solved."""
    tables = (one.table.loads.tolist() for one in seal.patches if one.table is not None)
    return tuple(sorted(set(chain.from_iterable(tables))))
