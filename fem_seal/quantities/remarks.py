"""Cautions: warnings to the user of a result."""

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.digits import with_prefix
from fem_seal.film import MeshFilm
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import ErrorBudget
from fem_seal.quantities.slope import slope_between_samples

STEEP = 1.0  # rms slope above which the film is not thin, and a unit probably wrong
THICK = 0.1  # mean gap over the length of the film above which the same holds
FEW = 10  # samples in contact below which the contact area is meaningless


def cautions(patch: Patch, budget: ErrorBudget | None) -> tuple[str, ...]:
    """Sentences about the error budget, the contact and the gap of a patch.

    Parameters
    ----------
    patch : Patch
        Patch whose contact and gap are checked.
    budget : ErrorBudget or None
        Error budget of the patch; its cautions come first.
    """
    sentences = [entry.sentence for entry in budget or () if entry.caution]
    shape = patch.scene.shape
    if shape is None or not shape.own_gap:
        gap = patch.grid_gap
        thick = _slope(gap) or _thickness(float(gap.values.mean()), gap.size[0])
        sentences.extend(filter(None, (_contact(patch, gap), thick)))
    elif isinstance(film := patch.film, MeshFilm):
        thick = _thickness(film.mean_gap, float(np.ptp(film.mesh.xy, axis=0).min()))
        sentences.extend(filter(None, (thick,)))
    return tuple(sentences)


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


def _thickness(mean_gap: float, length: float) -> str | None:
    """Warn if a mean gap [m] is too high for a film of a length [m]; flat gaps have no slopes."""
    if mean_gap <= THICK * length:
        return None
    return (
        f"the mean gap is {with_prefix(mean_gap, 'm')}, no thin film on a length of "
        f"{with_prefix(length, 'm')}: are gap and lengths in the right units?"
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
