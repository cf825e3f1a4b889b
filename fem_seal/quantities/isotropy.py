"""What profiles leave open about the surface that they were measured on."""

from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import Uncertainty
from fem_seal.scene import ProfileSurface


def isotropy(patch: Patch) -> Uncertainty | None:
    """Assumption behind a surface made of profiles; None for any other."""
    if not isinstance(patch.scene.surface, ProfileSurface):
        return None
    sentence = (
        "the surface is random, isotropic and Gaussian with the spectrum of the profiles; lay, "
        "plateaus and pits of the measured one are not in it"
    )
    return Uncertainty("isotropic surface", "not covered", sentence)
