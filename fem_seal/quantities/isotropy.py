"""Error budget: a surface made of profiles is assumed to be isotropic and Gaussian."""

from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import Uncertainty
from fem_seal.scene import ProfileSurface


def isotropy(patch: Patch) -> Uncertainty | None:
    """Entry for the assumption behind a surface made of profiles; None for other surfaces."""
    if not isinstance(patch.scene.surface, ProfileSurface):
        return None
    sentence = (
        "the surface is random, isotropic and Gaussian with the spectrum of the profiles; lay, "
        "plateaus and pits of the measured one are not in it"
    )
    return Uncertainty("isotropic_surface", "not covered", sentence)
