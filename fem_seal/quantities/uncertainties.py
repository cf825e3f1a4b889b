"""Sources of uncertainty of a leak rate, one function each.

To add one, write a function `(Patch) -> Uncertainty | None` and put it into `SOURCES`.
"""

from collections.abc import Callable

from fem_seal.area_error import area_error
from fem_seal.error_budget import CONTACT_GRID, ONE_PATCH, ErrorBudget, Uncertainty, flow_entry
from fem_seal.grid_series import error_beyond, estimated_error, estimates_grid_error
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.inputs import Probe, inputs_entry, rate_in_range
from fem_seal.quantities.lift import lift_entry
from fem_seal.slip_error import slip_entry, slip_interval_entry


def error_budget(patch: Patch) -> ErrorBudget:
    """List the uncertainties of the leak rate of a patch."""
    entries = (source(patch) for source in SOURCES)
    return tuple(entry for entry in entries if entry is not None)


def _contact_grid_entry(patch: Patch) -> Uncertainty | None:
    scene = patch.scene
    if scene.contact is None or scene.seal is not None or patch.lifted_off:
        return None
    if scene.total_error is None and not estimates_grid_error(scene):
        sentence = "what a finer grid of the contact would change was not computed"
        return Uncertainty(CONTACT_GRID, "not covered", sentence)
    return estimated_error(patch)


def surface_entry(patch: Patch) -> Uncertainty | None:
    """Entry for what the heights of a kind of surface lack; None if they lack nothing."""
    surface = patch.scene.surface
    if surface is None or surface.lacks is None:
        return None
    key, sentence = surface.lacks
    return Uncertainty(key, "not covered", sentence)


def _given_gap_entry(patch: Patch) -> Uncertainty | None:
    if patch.scene.gap is None:
        return None
    sentence = "the gap is given, and its own error is not known"
    return Uncertainty("given_gap", "not covered", sentence)


def _shape_entry(patch: Patch) -> Uncertainty | None:
    shape = patch.scene.shape
    # Any mesh represents straight edges and a constant gap exactly.
    if shape is None or (shape.kind in ("rectangle", "strip") and shape.gap is not None):
        return None
    sentence = (
        "edges are straight and the gap is linear between the vertices of the mesh; half of "
        "shape.mesh_size, or a finer mesh file, shows what this changes"
    )
    return Uncertainty("shape", "not covered", sentence, name="mesh of the shape")


def _one_patch_entry(patch: Patch) -> Uncertainty | None:
    if patch.scene.own_gap:
        return None
    sentence = "this is one patch of one rough surface; others leak more or less"
    return Uncertainty(ONE_PATCH, "not covered", sentence, name="other patches of the face")


# Assumption of each contact model.
ASSUMPTIONS = {
    "gfmd": "a linear elastic contact without friction and adhesion",
    "bearing": "a surface that is cut at a plane",
}


def model_entry(patch: Patch) -> Uncertainty:
    """Entry for the equations themselves."""
    contact = patch.scene.contact
    solid = "" if contact is None else f", and {ASSUMPTIONS[contact.model]}"
    sentence = f"Reynolds' equation for a thin film between smooth slopes{solid}"
    return Uncertainty("model", "not covered", sentence, name="the model itself")


def _inputs_entry(patch: Patch) -> Uncertainty:
    def rate_of(other: Patch) -> LeakRate:
        return rate_in_range(other).widened(error_beyond(patch, other))

    tightest = patch.film.constriction
    probe = Probe(None if tightest is None else tightest.gap)
    return inputs_entry(patch, patch.leak_rate, rate_of, probe)


Source = Callable[[Patch], Uncertainty | None]
SOURCES: tuple[Source, ...] = (
    lambda patch: flow_entry(patch.leak_rate),
    slip_interval_entry,
    _contact_grid_entry,
    area_error,
    surface_entry,
    lift_entry,
    slip_entry,
    _given_gap_entry,
    _shape_entry,
    _one_patch_entry,
    _inputs_entry,
    model_entry,
)
