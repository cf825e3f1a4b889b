"""The patches of a seal: seeds of a random surface, twins of a measured map, or windows of it."""

from collections.abc import Sequence
from math import prod

import numpy as np

from fem_seal.digits import rounded_down
from fem_seal.errors import InvalidInput, present
from fem_seal.field_file import HEIGHT_NAMES, read_map
from fem_seal.scene import FileSurface, Scene

WINDOW_ROUNDING = 1e-6  # part of a window by which a map may be too short for the last one


def realizations(scene: Scene) -> tuple[Scene, ...]:
    """Scenes of the patches of a seal; the first patch is that of the scene itself.

    Each is a seal of one patch. It has no output but the seal, and neither a limit nor tolerances
    of inputs, which change nothing of it.
    """
    seal, map_ = present(scene.seal, "[seal]"), scene.measured_map
    shared: dict[str, object] = {"output": {"products": ["seal"]}}
    shared |= dict.fromkeys(("seal.patches", "seal.window", "limit", "tolerances"))
    changes: list[dict[str, object]]
    if map_ is not None and seal.window is not None:
        places = _window_places(map_, seal.window, seal.patches)
        changes = [{"surface.crop": map_.window(place, seal.window)} for place in places]
    else:
        name = f"surface.{present(scene.surface, '[surface]').seed_field}"
        first = scene.seed or 0
        changes = [{name: first + k} if k else {} for k in range(seal.patches)]
    return tuple(scene.with_(shared | change) for change in changes)


def _window_places(
    surface: FileSurface, window: tuple[float, float], patches: int
) -> list[tuple[int, int]]:
    """Places of the windows, spread evenly over the map; the first one is at its corner."""
    if surface.crop is None:
        lengths = read_map(surface.path, HEIGHT_NAMES, surface.stated, heights=True).covered
    else:
        (x0, x1), (y0, y1) = surface.crop
        lengths = x1 - x0, y1 - y0
    along, across = (
        int(length / part + WINDOW_ROUNDING) for length, part in zip(lengths, window, strict=True)
    )
    if along * across < patches:
        raise InvalidInput(_too_few(surface, lengths, window, patches, (along, across)))
    chosen = np.linspace(0, along * across - 1, patches).round().astype(int)
    return [(int(number) // across, int(number) % across) for number in chosen]


def _too_few(
    surface: FileSurface,
    lengths: Sequence[float],
    window: tuple[float, float],
    patches: int,
    held: tuple[int, int],
) -> str:
    """Message on windows that do not fit, with the largest windows that fit."""
    whole = surface.path if surface.crop is None else f"surface.crop of {surface.path}"
    scale = largest_scale(lengths, window, patches)
    # Round down: the windows must fit. With 1 + 1e-9 rounding errors do not cost a digit.
    fitting = [float(rounded_down(1e6 * scale * length * (1 + 1e-9), 3)) for length in window]
    uncropped = "" if surface.crop is None else ", take surface.crop out"
    return (
        f"seal.patches = {patches}, but {whole}, {_lengths_text(lengths)} um, holds {held[0]} x "
        f"{held[1]} windows of {_lengths_text(window)} um (seal.window); as many fit with "
        f'seal.window = ["{fitting[0]:g} um", "{fitting[1]:g} um"]{uncropped}, or '
        "leave seal.window out: the patches are then the map and random twins with its spectrum"
    )


def _lengths_text(lengths: Sequence[float]) -> str:
    """Two lengths as text in um, "150 x 150"."""
    return " x ".join(f"{1e6 * length:.4g}" for length in lengths)


def largest_scale(lengths: Sequence[float], window: Sequence[float], patches: int) -> float:
    """Largest factor by which a window can be scaled so that a map holds `patches` of them."""
    ratios = [length / part for length, part in zip(lengths, window, strict=True)]
    # At the largest factor a whole number of windows fills one side of the map.
    scales = sorted((ratio / n for ratio in ratios for n in range(1, patches + 1)), reverse=True)
    return next(
        scale
        for scale in scales
        if prod(int(ratio / scale + WINDOW_ROUNDING) for ratio in ratios) >= patches
    )
