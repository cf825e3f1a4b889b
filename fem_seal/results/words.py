"""The sentences about a result, for the terminal, the report and notebooks.

Those of the entries of the error budget and of cautions are made with their numbers, in
`fem_seal.quantities`; all others are here.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from fem_seal.accuracy import Choice, error_words
from fem_seal.digits import (
    bracket_digits,
    in_digits,
    length_text,
    number_of,
    per_cent,
    readable,
    with_prefix,
)
from fem_seal.error_budget import (
    IN_BOUNDS,
    ONE_PATCH,
    ErrorBudget,
    combined,
    ends_words,
    entry_words,
    factor_words,
    may_open,
)
from fem_seal.errors import present
from fem_seal.fluid import volume_conditions
from fem_seal.leak_rate import Estimate, FlowState, rate_text
from fem_seal.quantities.constriction import Constriction
from fem_seal.quantities.headline import SI, ShownUnit
from fem_seal.quantities.of_patch import Quantities
from fem_seal.quantities.tensor import ConductivityTensor
from fem_seal.results.records import GasRecord, LiftRecord, SealRecord
from fem_seal.results.result import Result
from fem_seal.surface import MapStatistics
from fem_seal.threshold import Threshold

WALLS = (
    "walls, though the gap is periodic, and walls make it leak less; flow.sides = 'periodic' of a "
    "scene, or --sides periodic of fem-seal leak, joins them"
)


def summary_of(result: Result) -> list[tuple[str, str]]:
    """Labels and texts of a result, with units; result.json has all digits."""
    state, named = result.state, result.quantities or Quantities()
    walls = result.leak_rate and result.gap_is_periodic and result.flow().sides == "wall"
    lifted_seal = result.seal is not None and state == "lifted off"
    memory = result.peak_memory_bytes / 1e6
    parts: list[tuple[str, Callable[[Any], str], object]] = [
        ("state", str, state),
        ("leak rate", str, result.headline),
        ("flow", flow_words, result if result.leak_rate else None),
        ("sides", str, WALLS if walls else None),
        ("surface", preparation_words, result.preparation or None),
        ("seal", seal_words, result.seal),
        ("lift", partial(lift_words, sealed=state == "sealed", shown=result.shown), result.lift),
        ("gas", gas_words, result.gas),
        # What is uncertain stands in other lines.
        (
            "verdict",
            lambda judged: f"{judged.decision}: {judged.comparison}",
            result.verdict if result.provenance.has_section("limit") else None,
        ),
        *(("caution", str, caution) for caution in result.cautions),
        ("tightest", constriction_words, named.constriction),
        ("threshold", threshold_words, named.threshold),
        ("aperture", aperture_words, named.hydraulic_aperture),
        ("trapped", lambda v: f"{in_digits(v)} m^3 in closed pockets", named.trapped_volume),
        ("tensor", tensor_words, named.conductivity_tensor),
        ("sensitivity", sensitivity_words, named.sensitivity),
        ("accuracy", partial(accuracy_words, state=state), result.accuracy),
        ("errors", partial(budget_words, state=state), result.error_budget or None),
        ("contact", contact_words, None if lifted_seal else result),
        ("cost", str, f"{result.seconds['total']:.1f} s elapsed, {memory:.0f} MB at most"),
    ]
    return [(label, words(part)) for label, words, part in parts if part is not None]


def first_sentence(result: Result) -> str:
    """First sentence of a report: decision or state, the headline, and what the limit makes of it.

    Of a contact alone the part of the area in contact.
    """
    judged, head = result.verdict, result.headline
    if head is None:
        text = f"{100 * result.contact_area_fraction:.3g} % of the nominal area is in contact"
        if result.state == "lifted off":
            text = "lifted off, the fluid presses harder than the load"
    else:
        decision = judged.decision if judged else result.state
        parts = (f"{decision}: {head}", judged.comparison if judged else "")
        text = "; ".join(filter(None, parts))
    return f"{text[0].upper()}{text[1:]}."


def remarks(result: Result) -> list[str]:
    """Sentences below the first one: what was not reached, why a gap is sealed, and cautions."""
    budget, first, sentences = result.error_budget or (), first_sentence(result), []
    if not result.converged:
        sentences.append(f"what was asked for was not reached: {result.reason}")
    if result.state == "sealed":
        sentences.append(
            "zero is the leak rate as computed; errors that are not covered may open a path"
        )
        own = [e.sentence for e in budget if e.counted and e.key not in IN_BOUNDS]
        sentences += [sentence for sentence in own if sentence not in first]
    if result.state == "sealed" and any(entry.key == ONE_PATCH for entry in budget):
        opens = "less load or more fluid pressure may open a path, and so may another patch of the"
        opens += " face"
        if result.quantities is None or result.quantities.threshold is None:
            opens += "; the product threshold computes the load at which this patch begins to leak"
        sentences.append(opens)
    sentences += [text for text in result.cautions if text not in first]
    return [f"{text[0].upper()}{text[1:]}." for text in dict.fromkeys(sentences)]


def budget_words(budget: ErrorBudget, state: FlowState | None = "leaking") -> str:
    """Factors of the counted entries, single and combined, and names of entries not covered.

    A leak rate of zero has no factors. For a sealed patch or seal the text names the entries that
    may open a path. Without such entries it gives the sentences that say why none opens.
    """
    counted = [entry for entry in budget if entry.counted and state == "leaking"]
    opening = [entry for entry in budget if state == "sealed" and may_open(entry)]
    words = f"{entry_words(counted)} times the value" if counted else ""
    if len(counted) > 1:
        together = f"together {factor_words(combined(budget))}"
        words = f"{entry_words(counted)}, {together} times the value"
    not_covered = [entry.name for entry in budget if entry.kind == "not covered"]
    names = [entry.name for entry in opening]
    named = ", ".join(name for name in not_covered if name not in names)
    if opening:
        words = f"may leak all the same: {', '.join(names)}"
        if len(opening) == 1 and opening[0].upper_rate:
            words += ", up to the upper end of the leak rate"
    elif state == "sealed":
        why = (e for e in budget if e.counted and e.key not in IN_BOUNDS)
        words = "; ".join(f"{e.name}: {e.sentence} ({e.kind})" for e in why)
    return "; ".join(filter(None, (words, named and f"not covered: {named}")))


def flow_words(result: Result) -> str:
    """Method, number of unknowns and, on a grid, the sides: the leak rate depends on them."""
    text = f"{result.method}, {result.unknowns} unknowns"
    if result.preconditioner not in ("hypre", None):
        text += f" (preconditioner {result.preconditioner})"
    shaped = result.provenance.has_section("shape")
    flow = result.flow()
    default = "" if flow.sides else " (default)"
    sides = flow.sides_of(bool(result.gap_is_periodic))
    return text if shaped else f"{text}, {sides} sides{default}"


def contact_words(result: Result) -> str:
    """Area, mean gap and load; of a patch that is lifted off those without load."""
    area = 100 * result.contact_area_fraction
    whose = "the shape's area" if result.provenance.has_section("shape") else "the area"
    text = f"{area:.4g} % of {whose}, mean gap {length_text(result.mean_gap)}"
    if result.state == "lifted off":
        return f"{text}; without load, where the solids only just touch"
    if result.mean_pressure is not None:
        text += f", load {with_prefix(result.mean_pressure, 'Pa')}"
    return text if result.seal is None else f"{text}; of the first patch, dry"


def accuracy_words(accuracy: Choice, state: FlowState) -> str:
    """Contact grid and tolerance that were chosen for the total error."""
    nx, ny = accuracy.samples
    chosen = f"chosen for {100 * accuracy.total:g} %: contact on {nx} x {ny}"
    if state == "sealed":
        return f"{chosen}, sealed"
    grid, flow = accuracy.contact_error, accuracy.flow_error
    bound = "unknown" if flow is None else f"at most {per_cent(flow)}"
    text = f"{chosen} (error {error_words(grid)}), flow.rtol = {accuracy.rtol:.2g} ({bound})"
    for name, error in (("area", accuracy.area_error), ("lift", accuracy.lift_error)):
        text += "" if error is None else f", {name} ({error_words(error)})"
    return text


def sensitivity_words(by_input: dict[str, float]) -> str:
    """Derivatives of ln Q by ln of each input, the largest first."""
    ordered = sorted(by_input, key=lambda name: -abs(by_input[name]))
    parts = (f"{name} {in_digits(by_input[name], 2)}" for name in ordered)
    return f"change of the leak rate in per cent, for 1 % more of each input: {', '.join(parts)}"


def tensor_words(tensor: ConductivityTensor) -> str:
    """Components with their bounds, and the angle of the easiest direction."""
    parts = (("xx", tensor.xx), ("xy", tensor.xy), ("yy", tensor.yy))
    texts = ((name, *bracket_digits(c.value, c.lower, c.upper)) for name, c in parts)
    words = (f"{name} = {value} [{low}, {high}]" for name, value, low, high in texts)
    if tensor.xx.upper == tensor.yy.upper == 0:
        return f"{', '.join(words)} m^3/(Pa s); sealed in every direction"
    ease = f"easiest at {tensor.angle:.3g} degrees"
    if tensor.hardest > 0:
        ratio = f"{tensor.easiest / tensor.hardest:.3g}"
        ease = "equal in all directions" if ratio == "1" else f"{ease}, {ratio} times the hardest"
    return f"{', '.join(words)} m^3/(Pa s); {ease}"


def gas_words(gas: GasRecord) -> str:
    """Reference conditions of the volume, mass rate, throughput, and mean free path."""
    slip = "no slip"
    if gas.accommodation is not None:
        slip = f"{gas.slip or 'first-order'} slip at the walls"
    path = f"mean free path {length_text(gas.mean_free_path)}"
    if gas.knudsen_number is not None:
        path += f", Knudsen number {in_digits(gas.knudsen_number, 2)} at the critical constriction"
    return (
        f"volume {volume_conditions(gas.reference_temperature, gas.reference_pressure)}; "
        f"{in_digits(gas.mass_rate.value)} kg/s, {in_digits(gas.throughput.value)} Pa m^3/s, "
        f"{in_digits(gas.amount_rate.value)} mol/s; {slip}; {path}"
    )


def constriction_words(tightest: Constriction) -> str:
    """Place, height, width and share of the pressure drop."""
    text = f"{length_text(tightest.gap)} high"
    if tightest.width is not None:
        text += f", {length_text(tightest.width)} wide"
    text += f", at x = {length_text(tightest.x)}, y = {length_text(tightest.y)}"
    if tightest.pressure_share is not None:
        text += f"; takes {per_cent(tightest.pressure_share)} of the pressure drop"
    return f"{text}; sealed if the gap were lowered by {length_text(tightest.gap)}"


def threshold_words(threshold: Threshold) -> str:
    """Pressures and contact areas between which the contact seals."""
    leaking, sealed = (f"{a:.4g}" for a in (threshold.area_leaking, threshold.area_sealed))
    areas = f"A/A0 = {leaking} and {sealed}"
    if threshold.pressure_sealed is None:
        how = "lowered uniformly, " if threshold.model == "gap" else ""
        where = f"between {areas}" if leaking != sealed else f"at A/A0 = {sealed}"
        return f"{how}seals {where}"
    low, high = present(threshold.pressure_leaking, "pressure"), threshold.pressure_sealed
    return f"seals between {with_prefix(low, 'Pa')} and {with_prefix(high, 'Pa')}, {areas}"


def aperture_words(aperture: Estimate) -> str:
    """Hydraulic aperture with its bounds."""
    scale, unit = readable(aperture.value, "m")
    lower, upper = (None if b is None else b * scale for b in (aperture.lower, aperture.upper))
    return rate_text(aperture.value * scale, lower, upper, unit.replace("µ", "u"))


def lift_words(lift: LiftRecord, sealed: bool = False, shown: ShownUnit = SI) -> str:
    """Loads of fluid and solid, or the range of leak rates, in words.

    In a sealed film the fluid's pressure is an assumption, and with it both loads: the model lets
    contact conduct with a small gap ε.
    """
    area = 100 * lift.dry.contact_area_fraction
    dry = f"dry, {area:.4g} % of the area would touch"
    if lift.model == "range":
        ends = [f"{ends_words(lift.lowest, lift.highest, shown.per_solved)} {shown.name}"]
        if lift.highest is None:
            ends = ends if lift.lowest else []
            # Without a lower end the outlet's pressure alone lifts it off.
            may_close = lift.lowest is not None
            ends.append("without limit if the seal lifts off" if may_close else "without limit")
        text = ", and ".join(ends)
        return f"{text}, whatever the fluid's pressure between those of inlet and outlet"
    if lift.solid_pressure is None:
        return f"no load is left to the solid; {dry}"
    carried = with_prefix(present(lift.fluid_pressure, "fluid pressure"), "Pa")
    kept = with_prefix(lift.solid_pressure, "Pa")
    steps = number_of(lift.steps, "step")
    if not lift.settled:
        steps += ", not settled"
    elif lift.change:
        steps += f", the last stage changed the leak rate by {per_cent(lift.change)}"
    assumed = " (the model lets contact conduct with a small gap ε)" if sealed else ""
    return f"the fluid carries {carried}, the solid {kept}{assumed}; {dry}; {steps}"


def preparation_words(steps: tuple[MapStatistics, ...]) -> str:
    """Rms height, rms slope and seam after each step, and the number of points filled."""
    words = []
    for before, step in zip((None, *steps), steps, strict=False):
        filled = before.missing - step.missing if before and step.name.startswith("fill") else 0
        name = f"{step.name} ({number_of(filled, 'point')})" if filled else step.name
        height = length_text(step.rms_height)
        words.append(f"{name}: {height}, {step.rms_slope:.3g}, {step.seam:.3g}")
    return "; ".join(words) + " (rms height, rms slope, seam)"


def lifted_words(seal: SealRecord) -> str:
    """Why a seal is lifted off, with both pressures."""
    P, inlet = max(seal.path.total_pressure), seal.path.fluid_pressure[0]
    return (
        f"lifted off: the total pressure, at most {with_prefix(P, 'Pa')}, is nowhere above the "
        f"fluid's at the inlet, {with_prefix(inlet, 'Pa')}; press harder"
    )


def seal_words(seal: SealRecord) -> str:
    """Number of the patches of a seal, net loads, and the part that decides the leak rate."""
    if seal.leak_rate is None:
        return lifted_words(seal)
    rate = seal.leak_rate
    sealed = sum(patch.state == "sealed" for patch in seal.patches)
    where, decided = "along the path", "sealed"
    if rate.upper != 0:
        where, decided = f"{where} where it decides the leak rate", "the leak rate is decided"
    made = (
        f"{number_of(seal.patches_along, 'patch')} {where}, {seal.patches_around} around the seal"
    )
    words = f"{made}, drawn from {number_of(len(seal.patches), 'realization')}, {sealed} sealed"
    net = "(total pressure less fluid pressure)"
    if len(seal.loads) == 1:
        words += f"; solved at a net load {net} of {with_prefix(seal.loads[0], 'Pa')}"
    elif seal.loads:
        ends = f"{with_prefix(seal.loads[0], 'Pa')} to {with_prefix(seal.loads[-1], 'Pa')}"
        words += f"; solved at {len(seal.loads)} net loads {net} from {ends}"
    if seal.sealing is None:
        return words
    start, middle, end = (
        length_text(x) for x in (seal.sealing.start, seal.sealing.middle, seal.sealing.end)
    )
    if start == end:
        return f"{words}; {decided} where the total pressure is highest, {start} behind the inlet"
    if (seal.sealing.start, seal.sealing.end) == seal.path.ends:
        return f"{words}; {decided} on the whole path, {end}"
    begin = f"from {start}" if seal.sealing.start > 0 else "from the inlet"
    words += f"; {decided} {begin} to {end} behind the inlet"
    return words if rate.upper == 0 else f"{words}, half of it before {middle}"
