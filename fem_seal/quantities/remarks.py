"""Cautions: warnings to the user of a result."""

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.digits import with_prefix
from fem_seal.film import Film, MeshFilm
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import ErrorBudget
from fem_seal.quantities.slope import slope_between_samples

STEEP = 1.0  # rms slope above which the film is not thin, and a unit probably wrong
THICK = 0.1  # mean gap of a shape over its shorter side above which the same holds
FEW = 10  # samples in contact below which the contact area is meaningless


def cautions(patch: Patch, budget: ErrorBudget | None) -> tuple[str, ...]:
    """Sentences about the error budget, the contact and the gap of a patch.

    Parameters
    ----------
    patch : Patch
        Patch whose contact and gap are checked.
    budget : ErrorBudget or None
        Its error budget, whose cautions come first.
    """
    sentences = [entry.sentence for entry in budget or () if entry.caution]
    if patch.scene.shape is None or not patch.scene.shape.own_gap:
        remarks = [_contact(patch, patch.grid_gap), _slope(patch.grid_gap)]
    else:
        remarks = [_thickness(patch.film)]
    return (*sentences, *filter(None, remarks))


def _contact(patch: Patch, gap: GridField) -> str | None:
    """Warn if all samples, or hardly any, are in contact, and name the likely cause."""
    touching = np.count_nonzero(gap.values == 0)
    if touching == gap.values.size:
        no_contact = patch.scene.contact is None
        inputs = "the gap" if no_contact else "the heights, the load and the modulus"
        return (
            f"all samples are in contact, and the mean gap is 0: are {inputs} in the right units?"
        )
    given_gap = patch.scene.gap
    if given_gap is not None:
        if touching == 0 and given_gap.contact_below is None:
            return (
                "no sample is in contact, which is a gap of exactly 0: if another program leaves "
                "roundings there, set gap.contact_below; and is the gap in the right unit?"
            )
        return None
    contact = patch.film_contact
    pressed = isinstance(contact, ContactState) and contact.mean_pressure > 0
    if pressed and touching < FEW:
        samples = "1 sample is" if touching == 1 else f"only {touching} samples are"
        return (
            f"{samples} in contact, too few for their area: are the heights, the load and the "
            "modulus in the right units?"
        )
    return None


def _thickness(film: Film) -> str | None:
    """Warn if the gap of a shape is too high for a thin film; a formula has no unit to check."""
    if not isinstance(film, MeshFilm):
        return None
    side = float(np.ptp(film.mesh.xy, axis=0).min())
    if film.mean_gap <= THICK * side:
        return None
    return (
        f"the mean gap is {with_prefix(film.mean_gap, 'm')}, which is no thin film on a shape "
        f"{with_prefix(side, 'm')} across: is the gap in metres?"
    )


def _slope(gap: GridField) -> str | None:
    """Warn if the gap is too steep for a thin film."""
    slope = slope_between_samples(gap)
    if slope <= STEEP:
        return None
    return (
        f"the gap has slopes of {slope:.2g} (rms), where contact and film want them well below 1: "
        "are heights and spacing in the same unit?"
    )
