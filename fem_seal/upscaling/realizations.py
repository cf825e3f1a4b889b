"""The patches of a seal: seeds of a random surface, twins of a measured map, or windows of it."""

from collections.abc import Sequence

import numpy as np

from fem_seal import parallel
from fem_seal.errors import InvalidInput, present
from fem_seal.field_file import HEIGHT_NAMES, read_map
from fem_seal.patch import Patch
from fem_seal.progress import Report
from fem_seal.scene import FileSurface, Scene
from fem_seal.scene.sections import Section

OF_FLOWS = 0.5  # of seal.rtol; the loads take the rest
ROUNDING = 1e-6  # of a window, by which a map may be too short for the last one


def realizations(scene: Scene) -> tuple[Scene, ...]:
    """Scenes of the patches of a seal; the first one is that of the scene itself.

    The patches have no output but the seal, and no limit.

    Parameters
    ----------
    scene : Scene
        With [seal].

    Returns
    -------
    tuple of Scene, `seal.patches` long

    Raises
    ------
    InvalidInput
        If the map cannot be read, or holds fewer windows.
    """
    seal = present(scene.seal, "[seal]")
    surface = scene.surface
    surfaces: Sequence[Section]
    if surface is None:
        raise InvalidInput("[seal] needs [surface], of which its patches are made")
    if isinstance(surface, FileSurface) and seal.window is not None:
        places = _places(surface, seal.window, seal.patches)
        surfaces = [surface.in_window(place, seal.window) for place in places]
    else:
        surfaces = [_other(surface, number) for number in range(seal.patches)]
    output = scene.output.model_copy(update={"products": ("seal",), "leak_rate_unit": None})
    patch = seal.model_copy(update={"window": None})
    return tuple(
        scene.model_copy(
            update={"surface": one, "seal": patch, "output": output, "limit": None}
        )
        for one in surfaces
    )


def _other(surface: Section, number: int) -> Section:
    """The surface with another seed, or a twin of the map; number 0 is the surface itself."""
    name = "twin_seed" if isinstance(surface, FileSurface) else "seed"
    if number == 0:
        return surface
    return surface.model_copy(update={name: (getattr(surface, name) or 0) + number})


def _places(
    surface: FileSurface, window: tuple[float, float], patches: int
) -> list[tuple[int, int]]:
    """Places of the windows, spread evenly over the map; the first one is at its corner."""
    if surface.crop is None:
        field = read_map(surface.path, HEIGHT_NAMES, surface.stated, heights=True)
        sides = [n * d for n, d in zip(field.values.shape, field.spacing, strict=True)]
    else:
        sides = [end - start for start, end in surface.crop]
    along, across = (
        int(side / part + ROUNDING) for side, part in zip(sides, window, strict=True)
    )
    if along * across < patches:
        raise InvalidInput(
            f"seal.patches = {patches}, but {surface.path} holds {along} x {across} windows of "
            f"{window[0]:g} m by {window[1]:g} m; lower seal.patches or seal.window"
        )
    chosen = np.linspace(0, along * across - 1, patches).round().astype(int)
    return [(int(number) // across, int(number) % across) for number in chosen]


def patch_of(scene: Scene, report: Report, comm: parallel.Comm) -> Patch:
    """Patch of a realization without its [seal]; the flows of a chain of loads are not drawn.

    Unless the scene names flow.rtol, the flows take a part of seal.rtol.
    """
    output = scene.output.model_copy(update={"products": ("leak_rate",)})
    named = "rtol" in scene.flow.model_fields_set
    rtol = scene.flow.rtol if named else OF_FLOWS * present(scene.seal, "[seal]").rtol
    flow = scene.flow.model_copy(update={"lift": "none", "rtol": rtol})
    alone = scene.model_copy(update={"output": output, "seal": None, "flow": flow})
    return Patch(alone, report, comm=comm)
