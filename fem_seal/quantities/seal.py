"""Uncertainties and verdict of a whole seal."""

from math import exp, log

from fem_seal.digits import with_prefix
from fem_seal.errors import present
from fem_seal.fluid import GasDrive
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.error_budget import (
    CONTACT_GRID,
    FLOW_AND_LOADS,
    ErrorBudget,
    Kind,
    Uncertainty,
)
from fem_seal.quantities.isotropy import isotropy
from fem_seal.quantities.of_patch import shown_in
from fem_seal.quantities.verdict import Verdict, verdict
from fem_seal.scene import SelfAffineSurface
from fem_seal.upscaling.seal import SealLeak

WISH = (
    "more realizations (seal.patches), a smaller seal.rtol with a smaller flow.rtol, or larger "
    "patches might decide"
)


def leak_rate_of(patch: Patch, seal: SealLeak) -> LeakRate:
    """Leak rate of a seal as the verdict and the words take it."""
    if seal.state == "lifted off":
        return LeakRate.lifted_off(patch.scene.flow.method)
    return LeakRate(
        state=seal.state,
        method=patch.scene.flow.method,
        value=seal.value,
        lower=seal.lower,
        upper=seal.upper,
        converged=seal.converged,
        reason=seal.reason,
    )


def seal_verdict(patch: Patch, seal: SealLeak, budget: ErrorBudget) -> Verdict:
    """Hold the leak rate of a seal, with its error budget, against the scene's limit."""
    limit, leak = patch.scene.limit, leak_rate_of(patch, seal)
    if limit is None:
        return verdict(leak, shown_in(patch), None, None, budget)
    allowed = limit.volume_rate(patch.scene.drive)
    return verdict(leak, shown_in(patch), limit.leak_rate, allowed, budget, WISH)


def seal_budget(patch: Patch, seal: SealLeak) -> ErrorBudget:
    """List the uncertainties of the leak rate of a seal."""
    entries = (
        _flow_and_loads(patch, seal),
        _patches(seal),
        _scales(patch),
        _network(seal),
        _size(patch),
        isotropy(patch),
        Uncertainty(
            CONTACT_GRID,
            "not covered",
            "what a finer grid of the contact would change was not computed",
        ),
        _slip(patch, seal),
        Uncertainty(
            "model",
            "not covered",
            "Reynolds' equation for a thin film between smooth slopes, and a linear elastic "
            "contact without friction and adhesion",
        ),
    )
    return tuple(entry for entry in entries if entry is not None)


def _flow_and_loads(patch: Patch, seal: SealLeak) -> Uncertainty:
    layer = present(patch.scene.solid, "[solid]").layer_thickness is not None
    kind: Kind = "estimated" if layer else "guaranteed"
    sentence = (
        "bounds of the flow through each patch, and steps of the conductivity from load to load; "
        "under the hypotheses that the scales are apart, that the conductivity falls with the "
        "load, and that the patches are those of the seal"
    )
    if seal.state != "leaking":
        return Uncertainty(FLOW_AND_LOADS, kind, sentence, 1.0, 1.0)
    return Uncertainty(
        FLOW_AND_LOADS, kind, sentence, seal.lower / seal.value, seal.upper / seal.value
    )


def _patches(seal: SealLeak) -> Uncertainty:
    number, (share, low, high) = len(seal.patches), seal.share_sealed
    sealed = (
        f"{100 * share:.0f} % of {number} realization(s) are sealed (95 %: {100 * low:.0f} to "
        f"{100 * high:.0f} %)"
    )
    leaking = [one.flow.value for one in seal.patches if one.flow.state == "leaking"]
    if seal.interval is None or seal.value == 0 or seal.state != "leaking":
        wish = "three that leak are needed to say how much others differ; raise seal.patches"
        return Uncertainty("patches", "not covered", f"{sealed}; {wish}", caution=number < 3)
    logs = [log(value) for value in leaking]
    mean = sum(logs) / len(logs)
    scatter = (sum((x - mean) ** 2 for x in logs) / (len(logs) - 1)) ** 0.5
    lower, upper = seal.interval
    sentence = (
        f"other patches leak more or less: {sealed}; the others scatter by a factor of "
        f"{exp(scatter):.2g}, taken for log-normal (95 % interval)"
    )
    return Uncertainty(
        "patches",
        "estimated",
        sentence,
        min(1.0, lower / seal.value),
        max(1.0, upper / seal.value),
    )


def _scales(patch: Patch) -> Uncertainty:
    surface, seal = patch.scene.surface, present(patch.scene.seal, "[seal]")
    sentence = "the fluid's pressure varies little over the roughness"
    if isinstance(surface, SelfAffineSurface) and seal.leak_path is not None:
        ratio = surface.long_wavelength / seal.leak_path
        sentence += f"; its longest wavelength is {ratio:.2g} of the leak path"
    return Uncertainty("scales apart", "not covered", sentence)


def _network(seal: SealLeak) -> Uncertainty | None:
    if seal.count.along == 1 or len(seal.patches) == 1:
        return None
    sentence = (
        f"the seal is a network of {seal.count.along} patches along the part of the path that "
        f"seals by {seal.count.across} around it, each of one conductivity and drawn from the "
        "realizations"
    )
    return Uncertainty("network", "not covered", sentence)


def _size(patch: Patch) -> Uncertainty:
    surface, size = patch.scene.surface, min(present(patch.surface, "surface").size)
    sentence = f"patches {with_prefix(size, 'm')} wide, between straight ends"
    if isinstance(surface, SelfAffineSurface):
        sentence += f", are {size / surface.long_wavelength:.2g} of the longest wavelengths"
    return Uncertainty("size of the patch", "not covered", f"{sentence}; larger ones scatter less")


def _slip(patch: Patch, seal: SealLeak) -> Uncertainty | None:
    """Slip of a gas in the narrowest uniform gap that conducts as a patch does; see `slip`."""
    drive = patch.scene.drive
    if seal.state != "leaking" or not isinstance(drive, GasDrive):
        return None
    viscosity = patch.scene.viscosity
    lowest = min(one.flow.path.conductivity.min() for one in seal.patches if one.flow.path)
    aperture = float(12 * viscosity * lowest) ** (1 / 3)
    added = 6 * drive.mean_free_path(viscosity) / aperture
    sentence = (
        f"slip of the gas at the walls is not computed and adds {100 * added:.2g} % or more to the "
        "flow where the seal is tightest"
    )
    return Uncertainty("slip", "not covered", sentence, 1.0, None, caution=True)
