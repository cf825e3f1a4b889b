"""What slip of a gas at the walls leaves open in the leak rate."""

from fem_seal.digits import length_text, per_cent
from fem_seal.error_budget import SLIP_INTERVAL, Uncertainty, parts_of_bounds
from fem_seal.errors import present
from fem_seal.fluid import GasDrive
from fem_seal.leak_rate import relative_half_width
from fem_seal.patch import Patch
from fem_seal.rarefied import FIRST_ORDER
from fem_seal.scene import Scene

# Largest Knudsen number at the critical constriction for which the error of first-order slip is
# estimated.
LARGEST_KNUDSEN = 0.05
# Largest relative excess of the kinetic law (`rarefied`) over first-order slip in a channel, per
# Knudsen number and 2 - σ: 0.97 between nearly equal pressures, 1.16 into vacuum, for Knudsen
# numbers up to 0.17 and σ from 0.1 to 1.
EXCESS = 1.2
MOST_EXCESS = 0.17  # the largest of these Knudsen numbers
# Relative difference of other models of the gas from the kinetic law, in the part of the flow that
# slip adds: hard spheres slip 3 % less than the BGK model (viscous slip coefficients 0.985 and
# 1.016 in F. Sharipov, Eurosime 2004 and references there); 1 % more allows for other models.
KINETIC_ERROR = 0.04
# Mean free path over the length of a film at which the kinetic law gives no more than what
# molecules without collisions carry through slots at least 32 times as long as high (A. S. Berman,
# J. Appl. Phys. 36, 3356 (1965)). From 160 times on 0.45 would do, and in the limit 0.57.
FREE_FLIGHT = 0.25


def knudsen_number(patch: Patch) -> float | None:
    """Mean free path at the mean pressure over the critical gap.

    None for a liquid, and where the film is sealed or lifted off.
    """
    drive = patch.scene.drive
    if patch.sealed or patch.lifted_off or not isinstance(drive, GasDrive):
        return None
    critical = present(patch.film.constriction, "constriction").gap
    return drive.mean_free_path(patch.scene.viscosity) / critical


def slip_entry(patch: Patch) -> Uncertainty | None:
    """Entry for the error of the law of slip; None for a liquid or a sealed gap.

    Of a sealed gap that more fluid pressure would open it is that of the opened one.
    """
    if patch.lifted_off:
        return None
    film, lifted = patch.film, patch.lifted
    opened = 0.0 if lifted is None else lifted.opened_gap
    critical = opened if film.constriction is None else film.constriction.gap
    if critical == 0:
        return None
    return slip_entry_at(patch.scene, critical, max(film.size), patch.flow_settings.rtol)


def slip_entry_at(scene: Scene, critical: float, length: float, rtol: float) -> Uncertainty | None:
    """Entry at a critical gap [m] of a film of a length [m]; None for a liquid.

    The kinetic law is computed from a model of the gas, and other models differ a little. The
    first-order law gives too little slip, and a scene without slip none at all: slip multiplies the
    flow through a channel of height g by 1 + 6 Kn (2 - σ)/σ to first order, Kn = λ/g, with λ the
    mean free path at the mean pressure (E. B. Arkilic et al., J. Microelectromech. Syst. 6, 167
    (1997)), and by up to 1 + `EXCESS` (2 - σ) Kn more than that. More slip only raises the leak
    rate, so that the lower bound holds in both of these cases. Without slip the added flow, above
    `MOST_EXCESS` that of the kinetic law, is a factor if it is at most half of the flow's
    tolerance.
    """
    drive, law = scene.drive, scene.slip
    if not isinstance(drive, GasDrive):
        return None
    path = drive.mean_free_path(scene.viscosity)
    knudsen = path / critical
    sigma = present(scene.fluid, "[fluid]").accommodation or 1.0
    beyond = 1 + EXCESS * (2 - sigma) * knudsen  # what slip to first order lacks
    if law is None:
        added = (1 + 6 * knudsen * (2 - sigma) / sigma) * beyond - 1
        if knudsen > MOST_EXCESS:
            kinetic = drive.slip(scene.viscosity, sigma, "kinetic").mean_gain(critical)
            added = (kinetic - 1) * (1 + KINETIC_ERROR)
        sentence = (
            f"slip of the gas at the walls is left out and would add about {per_cent(added)} to "
            f"the flow at the critical constriction (mean free path {length_text(path)} at the "
            f"mean pressure, gap {length_text(critical)})"
        )
        if added <= rtol / 2:
            return Uncertainty("slip", "estimated", sentence, 1.0, 1 + added)
        sentence += ": the upper bound does not hold for this gas, the lower one does"
        return Uncertainty("slip", "not covered", sentence, 1.0, None, caution=True)
    if law.coefficient is FIRST_ORDER:
        return _first_order(knudsen, beyond)
    error = KINETIC_ERROR * (1 - 1 / law.mean_gain(critical))
    sentence = (
        "slip of the gas at the walls is that of the linearised BGK equation, and other models of "
        f"the gas differ from it by up to {per_cent(KINETIC_ERROR)} of what slip adds; Knudsen "
        f"number {knudsen:.2g} at the critical constriction"
    )
    # In the lower bound the flight of a molecule ends by collisions, and at the ends of the film.
    t, flights = critical * law.mean_pressure / law.product, path / (FREE_FLIGHT * length)
    shorter = min(1.0, float(law.coefficient(t * (1 + flights)) / law.coefficient(t)))
    caution = flights > 1
    if caution:
        sentence += (
            f"; the mean free path {length_text(path)} is longer than a quarter of the film, so "
            "that molecules which fly along the gap carry less than between endless walls"
        )
    return Uncertainty(
        "slip", "estimated", sentence, shorter / (1 + error), 1 + error, caution=caution
    )


def slip_interval_entry(patch: Patch) -> Uncertainty | None:
    """Entry for the slip interval, since the local pressure is not known; None without slip."""
    leak = patch.leak_rate
    if leak.slip_interval is None:
        return None
    refined, interval = parts_of_bounds(leak)
    sentence = (
        "how much the gas slips depends on its pressure, which lies between those of inlet and "
        "outlet; contained in the bounds, and no refinement narrows it"
    )
    width = relative_half_width(interval.lower, interval.upper)
    if width > relative_half_width(refined.lower, refined.upper):
        sentence += f": ±{per_cent(width)}, the larger part of them"
    return Uncertainty(SLIP_INTERVAL, "guaranteed", sentence, interval.lower, interval.upper)


def _first_order(knudsen: float, beyond: float) -> Uncertainty:
    """Entry of first-order slip at a Knudsen number, and the factor on it of what it lacks."""
    sentence = (
        "slip of the gas at the walls is computed to first order in the mean free path, and more "
        f"leaks than that; Knudsen number {knudsen:.2g} at the critical constriction"
    )
    if knudsen <= LARGEST_KNUDSEN:
        return Uncertainty("slip", "estimated", sentence, 1.0, beyond)
    sentence += (
        f"; above {LARGEST_KNUDSEN:g} the upper bound does not hold, the lower one does; "
        "fluid.slip = 'kinetic' covers it"
    )
    return Uncertainty("slip", "not covered", sentence, 1.0, None, caution=True)
