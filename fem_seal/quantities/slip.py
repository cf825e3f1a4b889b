"""What slip at the walls, which the flow of a gas leaves out, may add to its leak rate."""

from fem_seal.digits import with_prefix
from fem_seal.fluid import GasDrive
from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import Uncertainty


def slip(patch: Patch) -> Uncertainty | None:
    """Estimate the slip of a gas at the critical constriction.

    None for a liquid, and where the film is sealed or lifted off.

    To first order slip multiplies the flow through a channel of height g by 1 + 6 Kn, Kn = λ/g, λ
    the mean free path at the mean pressure (E. B. Arkilic et al., J. Microelectromech. Syst. 6, 167
    (1997)). It only adds to the leak rate: without slip the lower bound stands. Up to half the
    tolerance of the flow it counts as an estimate; above that the leak rate is open upwards, since
    first order is too low itself and wider places slip less.
    """
    drive = patch.scene.drive
    if patch.sealed or patch.lifted_off or not isinstance(drive, GasDrive):
        return None
    path = drive.mean_free_path(patch.scene.fluid.viscosity)
    tightest = patch.film.constriction.gap
    added = 6 * path / tightest
    rtol = patch.scene.flow.rtol
    sentence = (
        f"slip of the gas at the walls is not computed and adds about {100 * added:.2g} % to the "
        f"flow at the tightest place (mean free path {with_prefix(path, 'm')} at the mean "
        f"pressure, gap {with_prefix(tightest, 'm')})"
    )
    if added <= rtol / 2:
        return Uncertainty("slip", "estimated", sentence, 1.0, 1 + added)
    sentence += ": the upper bound does not hold for this gas, the lower one does"
    return Uncertainty("slip", "not covered", sentence, 1.0, None, caution=True)
