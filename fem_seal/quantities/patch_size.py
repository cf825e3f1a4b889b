"""Leak path and patches of a seal in longest wavelengths of the roughness."""

from fem_seal import parallel
from fem_seal.digits import length_text, per_cent
from fem_seal.error_budget import Uncertainty
from fem_seal.errors import present
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene import SelfAffine
from fem_seal.scene_steps import whole_map
from fem_seal.surface import kept_roughness, longest_wavelength
from fem_seal.surface.windows import MOST_LOST, WAVES

APART = 0.1  # longest wavelength over the leak path above which the user is warned


def scale_entries(patch: Patch, leak_path: float) -> tuple[Uncertainty, Uncertainty]:
    """Entries "scales apart" and "size of the patch" of the error budget of a seal.

    Both use one longest wavelength: of a random surface its long cut-off, of a measured one that of
    the whole map (`surface.longest_wavelength`), whether or not windows of it are the patches.
    """
    map_, surface = patch.scene.measured_map, patch.scene.surface
    heights = present(patch.surface, "surface")
    if map_ is not None:
        heights = parallel.on_root(lambda: whole_map(map_), patch.comm)
    if isinstance(surface, SelfAffine):
        longest: float | None = surface.long_wavelength
    else:
        longest = longest_wavelength(heights)
    return _scales(heights, longest, leak_path), _size(patch, heights, longest)


def _scales(heights: GridField, longest: float | None, leak_path: float) -> Uncertainty:
    length = longest or min(heights.covered)
    ratio = length / leak_path
    its = f", {length_text(length)}, is"
    if longest is None:
        its = f" is longer than the map, {length_text(length)} wide, which is"
    sentence = (
        "assumed: the fluid's pressure changes little over one wave of the roughness; the longest "
        f"wavelength{its} {ratio:.2g} of the leak path"
    )
    return Uncertainty("scales_apart", "not covered", sentence, caution=ratio > APART)


def _size(patch: Patch, heights: GridField, longest: float | None) -> Uncertainty:
    map_, window = patch.scene.measured_map, present(patch.scene.seal, "[seal]").window
    lengths, loss, lost = heights.covered, "", False
    patches, remedy = f"patches {length_text(min(lengths))} wide, between straight ends,", ""
    if map_ is not None and window is not None:
        patches = f"patches made of windows, {' by '.join(map(length_text, window))},"
        lengths, kept = window, kept_roughness(heights, window, map_.detrend or "mean")
        loss = f"; levelled, they keep {per_cent(kept)} of the rms height of the map"
        lost = 1 - kept > MOST_LOST
        remedy = "leave seal.window out: the patches are then the map and its twins"
    elif map_ is not None:
        # The mirror images of a map contain no more of the surface.
        patches = f"patches made of the map, {' by '.join(map(length_text, lengths))},"
        remedy = "take a larger map"
    wide = "do not show the longest wavelength, which is longer than the map"
    ratio = 0.0 if longest is None else min(lengths) / longest
    if longest is not None:
        wide = f"are {ratio:.2g} of the longest wavelengths wide, {length_text(longest)} each"
    small = ratio < WAVES
    if lost:
        loss += ", which biases the leak rate, and no scatter shows it"
    sentence = f"{patches} {wide}{loss}; larger ones scatter less"
    if remedy and (small or lost):
        sentence += f"; {remedy}"
    # Windows that lose roughness leak less than the map would, by an unknown factor.
    lower, upper = (1.0, None) if lost else (None, None)
    return Uncertainty(
        "size_of_the_patch", "not covered", sentence, lower, upper, caution=small or lost
    )
