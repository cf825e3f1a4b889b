"""Part of result.json about the fluid that lifts the solid."""

from fem_seal.digits import rounded_down, rounded_up, with_prefix
from fem_seal.errors import present
from fem_seal.patch import Patch
from fem_seal.results.record import Finite, Record


class DryRecord(Record):
    """The contact without the fluid's pressure."""

    contact_area_fraction: float
    mean_gap: float


class LiftRecord(Record):
    """Loads, Newton's steps and leak rates of a lift; docs/reference/results.md explains each."""

    model: str
    solid_pressure: float | None
    fluid_pressure: float | None
    steps: int
    change: Finite
    lowest: Finite
    highest: Finite
    dry: DryRecord
    settled: bool = True
    residuals: tuple[float, ...] = ()

    @classmethod
    def of(cls, patch: Patch) -> "LiftRecord | None":
        """Record of a patch; None if flow.lift is "none"."""
        model = patch.scene.lift
        if model == "none":
            return None
        dry = DryRecord.model_validate(present(patch.contact, "contact"))
        if model == "range":
            low, high = patch.lift_range
            return cls(
                model=model,
                solid_pressure=None,
                fluid_pressure=None,
                steps=2,
                change=None,
                lowest=low.value if low.lower is None else low.lower,
                highest=high.value if high.upper is None else high.upper,
                dry=dry,
            )
        state = present(patch.lifted, "lifted state")
        return cls(
            model=model,
            solid_pressure=state.contact.mean_pressure if state.contact else None,
            fluid_pressure=state.fluid_load,
            steps=state.steps,
            change=state.change if state.contact else None,
            lowest=state.lowest,
            highest=state.highest,
            dry=dry,
            settled=state.converged,
            residuals=state.residuals,
        )


def lift_words(lift: LiftRecord, sealed: bool = False) -> str:
    """Loads of fluid and solid, or the range of leak rates, in words.

    In a sealed film the fluid's pressure is that of a film that conducts a little in contact, so
    that the loads are an assumption.
    """
    area = 100 * lift.dry.contact_area_fraction
    dry = f"dry, {area:.4g} % of the area would touch"
    if lift.model == "range":
        low = f"at least {rounded_down(present(lift.lowest, 'lowest leak rate'))}"
        high = "without an upper end, the seal may lift off"
        if lift.highest is not None:
            high = f"at most {rounded_up(lift.highest)} m^3/s"
        return f"at any fluid pressure between the ends' {low} and {high}"
    if lift.solid_pressure is None:
        return f"no load is left to the solid; {dry}"
    carried = with_prefix(present(lift.fluid_pressure, "fluid pressure"), "Pa")
    kept = with_prefix(lift.solid_pressure, "Pa")
    steps = f"{lift.steps} steps"
    if not lift.settled:
        steps += ", not settled"
    elif lift.change:
        steps += f", the last changes the leak rate by {100 * lift.change:.2g} %"
    assumed = ", if its pressure falls evenly through the contact" if sealed else ""
    return f"the fluid carries {carried}, the solid {kept}{assumed}; {dry}; {steps}"
