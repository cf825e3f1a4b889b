"""Uncertainties and verdict of a whole seal."""

from collections.abc import Callable
from math import ceil, exp, inf, log
from statistics import stdev

from fem_seal.digits import number_of, per_cent
from fem_seal.error_budget import (
    CONTACT_GRID,
    FLOW_AND_LOADS,
    INPUTS,
    LIFT,
    MOST_LOG,
    ErrorBudget,
    Uncertainty,
)
from fem_seal.errors import present
from fem_seal.leak_rate import Factors, LeakRate
from fem_seal.patch import Patch
from fem_seal.quantities.advice import finer_grid, of_widest
from fem_seal.quantities.inputs import Probe, inputs_entry
from fem_seal.quantities.patch_size import scale_entries
from fem_seal.quantities.uncertainties import model_entry, surface_entry
from fem_seal.slip_error import slip_entry_at
from fem_seal.upscaling.mosaic import (
    DRAWS,
    FEW_AROUND,
    LEAST_LEAKING,
    error_of_mean,
    may_conduct,
    patches_for,
)
from fem_seal.upscaling.seal import SealLeak

# Keys of entries that no other module looks for.
PATCHES, SLIP_ALONG = "patches", "slip_along_the_path"
MOST_PATCHES = 1000  # largest number of patches of a scene
MOSAIC = "mosaic of patches"
# What a mosaic lacks of ln Q, over the variance of ln K: 0.057 at a deviation of 1, 0.049 at 1.9
# and less above, of seals of many patches; of few along the path less.
MOSAIC_BIAS = 0.065
NARROW_RATIO = 2.0  # upper over lower end of an interval that is narrow enough


def seal_advice(patch: Patch, seal: SealLeak, budget: ErrorBudget) -> str:
    """Advice for an undecided verdict."""
    patches = "more realizations (seal.patches) or larger ones might decide"
    if seal.interval is not None and seal.interval.upper > NARROW_RATIO * seal.interval.lower:
        many = _about(_realizations_for(seal))
        patches += f": {many} give the mean to a factor of {NARROW_RATIO:g}"
    remedies = {
        FLOW_AND_LOADS: "a smaller seal.rtol might decide",
        PATCHES: patches,
        CONTACT_GRID: finer_grid(patch.scene),
        INPUTS: "smaller [tolerances] might decide",
    }
    return of_widest(budget, remedies)


def seal_budget(patch: Patch, seal: SealLeak, rate_of: Callable[[Patch], LeakRate]) -> ErrorBudget:
    """List the uncertainties of the leak rate of a seal; `rate_of` gives that of another one."""
    if seal.state == "lifted off":
        sentence = (
            "the total pressure is nowhere above the fluid's at the inlet: no contact is left, "
            "whatever the roughness; contact remains where the total pressure is above it"
        )
        lifted = Uncertainty(LIFT, "guaranteed", sentence, 1.0, 1.0)
        return (
            lifted,
            inputs_entry(patch, seal, rate_of, Probe(lifted_off=True)),
            model_entry(patch),
        )
    scales, size = scale_entries(patch, seal.leak_path)
    most = max(seal.patches, key=lambda each: each.value)
    gap, rtol = seal.critical_gap, present(patch.scene.seal, "[seal]").rtol
    entries = (
        _flow_and_loads_entry(seal),
        patches_entry(seal),
        _contact_grid_entry(seal),
        scales,
        _mosaic_entry(seal),
        size,
        surface_entry(patch),
        None if gap is None else slip_entry_at(patch.scene, gap, seal.leak_path, rtol),
        _slip_along_entry(seal),
        inputs_entry(patch, seal, rate_of, Probe(gap, most.table)),
        model_entry(patch),
    )
    return tuple(entry for entry in entries if entry is not None)


def _flow_and_loads_entry(seal: SealLeak) -> Uncertainty:
    sentence = (
        "bounds of the flow through each patch, and of its conductivity between two loads; they "
        "hold if the roughness is much finer than the leak path, if the gap falls with the load "
        "and is convex in it (a theorem for the half-space, not for its grid), and for a seal of "
        "these patches alone"
    )
    if seal.state == "sealed":
        sentence = f"no path of leaking patches joins inlet and outlet, by the {sentence}"
        return Uncertainty(FLOW_AND_LOADS, "estimated", sentence, 1.0, 1.0)
    lower, upper = seal.lower / seal.value, seal.upper / seal.value
    return Uncertainty(FLOW_AND_LOADS, "estimated", sentence, lower, upper)


def patches_entry(seal: SealLeak) -> Uncertainty:
    """Entry for the patches that were not drawn."""
    number, share = len(seal.patches), seal.share_sealed
    sealed = (
        f"{round(share.value * number)} of {number_of(number, 'realization')} sealed (95 % "
        f"interval: {100 * share.lower:.0f} to {100 * share.upper:.0f} %)"
    )
    if seal.state == "sealed":
        return _sealed_patches(seal, sealed)
    if seal.interval is None:
        needed = max(LEAST_LEAKING, ceil(LEAST_LEAKING * number / max(seal.leaking, 1)))
        sentence = (
            f"{sealed}; three that leak are needed to say how much others differ: try "
            f"seal.patches = {needed}"
        )
        # No upper factor: patches that were not drawn may leak any amount more.
        return Uncertainty(PATCHES, "not covered", sentence, 0.0, None, caution=True)
    lower, upper = (end / seal.value for end in seal.interval.range)
    factors = _of_patches(seal)
    sentence = (
        f"other patches leak more or less: {sealed}; the others scatter by "
        f"{_factor(_log_scatter(seal))}, taken for log-normal (95 % interval)"
    )
    if upper > NARROW_RATIO * lower:
        many = _realizations_for(seal)
        sentence += (
            f"; {_about(many)} realizations would give the mean to a factor of {NARROW_RATIO:g}"
        )
        if many > MOST_PATCHES:
            sentence += ", larger patches scatter less"
    if seal.count.across <= FEW_AROUND:
        sentence += (
            f"; seals of {number_of(seal.count.across, 'patch')} around differ from each other by "
            f"about {per_cent(seal.relative_scatter)} (standard deviation) with any seal.patches"
        )
    return Uncertainty(PATCHES, "estimated", sentence, factors.lower, factors.upper)


def _log_scatter(seal: SealLeak) -> float:
    """Standard deviation of the logarithms of the leak rates of the patches that leak."""
    return stdev(log(patch.value) for patch in seal.patches if patch.state == "leaking")


def _realizations_for(seal: SealLeak) -> int:
    """Number of realizations for which the ends of the mean differ by `NARROW_RATIO`."""
    return ceil(patches_for(_log_scatter(seal), NARROW_RATIO) * len(seal.patches) / seal.leaking)


def _about(many: int) -> str:
    return f"about {many}" if many <= MOST_PATCHES else f"more than {MOST_PATCHES}"


def _factor(log_scatter: float) -> str:
    """Text of the factor exp(log_scatter)."""
    decades = log_scatter / log(10)
    return f"a factor of {exp(log_scatter):.2g}" if decades < 3 else f"{decades:.0f} powers of ten"


def _sealed_patches(seal: SealLeak, sealed: str) -> Uncertainty:
    """Entry of a sealed seal: patches that were not drawn may leak and form a path."""
    leaking = 1 - seal.share_sealed.lower
    if not may_conduct(leaking, seal.count):
        sentence = (
            f"{sealed}; even if {100 * leaking:.0f} % of the patches leak, no path of them crosses "
            f"the {number_of(seal.count.along, 'patch')} along the path"
        )
        return Uncertainty(PATCHES, "estimated", sentence, 1.0, 1.0)
    may_cross = f"if {100 * leaking:.0f} % of the patches leak, a path of them may cross the seal"
    number, lowered, share = len(seal.patches), seal.lowered, seal.next_load_share
    if lowered is None:
        # Fluid below ambient may keep all patches sealed without any load.
        advice = (
            "more realizations that are sealed (seal.patches) may exclude that, and less load, if "
            "patches leak under it, bounds what leaks"
        )
        if share is not None:
            few = number < LEAST_LEAKING
            more = f" with {LEAST_LEAKING} realizations (seal.patches)" if few else ""
            advice = (
                f"compute the seal under about {100 * share:.0f} % of its load{more}, until "
                "patches leak: under its own load it leaks at most the upper end of that result"
            )
        sentence = f"{sealed}; {may_cross}; {advice}"
        return Uncertainty(PATCHES, "not covered", sentence, 1.0, None, caution=True)
    known = "included" if lowered.grid_known else "not known there, and not included"
    sentence = (
        f"{sealed}; {may_cross}; under {100 * lowered.load_share:.0f} % of its load "
        f"{lowered.leaking} of {number} leak, and under its own load the seal leaks less than the "
        f"upper end of the 95 % interval there (the error of the contact's grid is {known}); more "
        "realizations (seal.patches) may lower it"
    )
    return Uncertainty(PATCHES, "estimated", sentence, 1.0, None, upper_rate=lowered.at_most)


def _contact_grid_entry(seal: SealLeak) -> Uncertainty:
    if seal.state == "sealed":
        sentence = "what a finer grid of the contact would change is computed of leaking seals only"
        return Uncertainty(CONTACT_GRID, "not covered", sentence)
    if seal.of_grid is None:
        sentence = (
            "the patches have too few samples to be solved on half of them, which would say what a "
            "finer grid of the contact would change"
        )
        return Uncertainty(CONTACT_GRID, "not covered", sentence)
    sentence = (
        "estimate of what a finer grid of the contact would change: each leaking patch is solved "
        "on half of the samples at the load that matters most, and the largest error counts"
    )
    lower, upper = seal.of_grid.lower, seal.of_grid.upper
    if not lower:
        sentence += "; patches of a finer grid may be sealed"
    if seal.leaking < len(seal.patches):
        sentence += "; that a finer grid may open the sealed patches does not count"
    return Uncertainty(CONTACT_GRID, "estimated", sentence, lower or None, upper)


def _of_patches(seal: SealLeak) -> Factors:
    """Factors for patches that were not drawn, of a seal that leaks."""
    if seal.interval is None:
        return Factors(0.0, inf)
    lower, upper = (end / seal.value for end in seal.interval.range)
    return Factors(min(lower, 1.0), max(upper, 1.0))


def as_uncertain(here: SealLeak, there: SealLeak) -> LeakRate:
    """The leak rate under other inputs, wider by what it errs more than that of `here`.

    Next to closing other patches scatter more and the grid errs more; slip matters more in lower
    gaps. The entries of `here` multiply the ends as well.
    """
    if there.state != "leaking":
        return there
    if there.of_grid is None and here.of_grid is not None:
        return there.widened(Factors(0.0, inf))
    none = Factors()
    patches = _of_patches(there).beyond(_of_patches(here) if here.state == "leaking" else none)
    slip = (there.slip_along or none).beyond(here.slip_along or none)
    grid = (there.of_grid or none).beyond(here.of_grid or none)
    mosaic = (_of_mosaic(there) or none).beyond(_of_mosaic(here) or none)
    return there.widened(patches * slip * grid * mosaic)


def _of_mosaic(seal: SealLeak) -> Factors | None:
    """Factors for the nodes of a mosaic's patches; None if some of these are sealed."""
    if seal.count.along == 1 or len(seal.patches) == 1:
        return Factors()
    if seal.leaking < len(seal.patches):
        return None
    sigma = stdev(log(flow.value) for flow in seal.patches)
    return Factors(1.0, exp(min(MOSAIC_BIAS * sigma**2, MOST_LOG)))


def _mosaic_entry(seal: SealLeak) -> Uncertainty | None:
    if seal.count.along == 1 or len(seal.patches) == 1:
        return None
    sentence = (
        f"the seal is a mosaic of {seal.count.along} patches along the part of the path that "
        f"decides the leak rate by {seal.count.across} around it, each of one conductivity and "
        "drawn from the realizations"
    )
    if seal.relative_scatter > 0:
        error = per_cent(error_of_mean(seal.relative_scatter, seal.count))
        sentence += f"; the mean of {DRAWS} such seals has a standard error of {error}"
    factors = _of_mosaic(seal)
    sentence += "; where patches differ it conducts too little, "
    if factors is None:
        sentence += "by how much is not known beside sealed ones"
        return Uncertainty("network", "not covered", sentence, name=MOSAIC)
    sentence += "which the factor allows for"
    return Uncertainty("network", "estimated", sentence, factors.lower, factors.upper, name=MOSAIC)


def _slip_along_entry(seal: SealLeak) -> Uncertainty | None:
    """Entry for the slip at the pressures along the path."""
    if seal.slip_along is None:
        return None
    sentence = (
        "the gas slips more where its pressure is low: along the path the conductivity of a patch "
        "changes as that of its critical constriction; in wider places it changes less, which the "
        "factors allow for"
    )
    factors = seal.slip_along
    return Uncertainty(SLIP_ALONG, "estimated", sentence, factors.lower, factors.upper)
