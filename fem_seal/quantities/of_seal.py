"""The quantities and the verdict of a scene, from the steps of its Seal."""

from collections.abc import Callable
from dataclasses import dataclass

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.quantities.aperture import (
    HydraulicAperture,
    hydraulic_aperture,
    uniform_rectangle,
)
from fem_seal.quantities.constriction import Constriction, constriction
from fem_seal.quantities.error_budget import ErrorBudget
from fem_seal.quantities.tensor import ConductivityTensor
from fem_seal.quantities.threshold import Threshold, threshold_of_cut, threshold_of_pressure
from fem_seal.quantities.uncertainties import error_budget
from fem_seal.quantities.verdict import Shown, Verdict, verdict
from fem_seal.seal import Seal
from fem_seal.steps import elastic_contact


@dataclass(frozen=True)
class Quantities:
    """What a scene's products name, in SI units; None for what they do not, or does not exist."""

    constriction: Constriction | None = None
    threshold: Threshold | None = None
    hydraulic_aperture: HydraulicAperture | None = None
    trapped_volume: float | None = None
    conductivity_tensor: ConductivityTensor | None = None


def quantities(seal: Seal) -> Quantities | None:
    """Compute the quantities that the scene names; None if it names none.

    A limit asks for the constriction as well: it says how near to sealed the seal is.
    """
    scene = seal.scene
    named = set(scene.output.products) | ({"constriction"} if scene.limit else set())
    wanted = [name for name in QUANTITIES if name in named]
    if not wanted:
        return None
    with seal.timed("quantities"):
        return Quantities(**{name: QUANTITIES[name](seal) for name in wanted})


def verdict_of(seal: Seal, budget: ErrorBudget | None = None) -> Verdict | None:
    """Hold the leak rate against the scene's limit; None if the scene needs no flow.

    Parameters
    ----------
    seal : whose leak rate is judged
    budget : of the leak rate; made here if left out
    """
    scene = seal.scene
    if not scene.needs_flow:
        return None
    budget = error_budget(seal) if budget is None else budget
    limit = scene.limit
    shown = shown_in(seal)
    if limit is None:
        return verdict(seal.leak_rate, shown, None, None, budget)
    allowed = limit.volume_rate(scene.drive)
    return verdict(seal.leak_rate, shown, limit.leak_rate, allowed, budget)


def shown_in(seal: Seal) -> Shown:
    """Unit that people read: of the output, else of the limit, else m³/s."""
    scene = seal.scene
    unit = scene.output.leak_rate_unit or (scene.limit and scene.limit.leak_rate.unit)
    if not unit:
        return Shown("m^3/s", 1.0)
    return Shown(unit.name, scene.drive.rates[unit.kind] / unit.size)


def _constriction(seal: Seal) -> Constriction | None:
    field = seal.leak_rate.field
    potential = None if field is None else seal.scene.drive.potential(field.pressure)
    return parallel.on_root(lambda: constriction(seal.film, field, potential))


def _threshold(seal: Seal) -> Threshold | None:
    return parallel.on_root(lambda: _THRESHOLDS[_model(seal)](seal))


def _model(seal: Seal) -> str:
    return "gap" if seal.scene.contact is None else seal.scene.contact.model


def _of_gap(seal: Seal) -> Threshold | None:
    return threshold_of_cut(seal.film, "gap")


def _of_bearing(seal: Seal) -> Threshold | None:
    surface = seal.surface
    untouched = GridField(
        surface.values.max() - surface.values, surface.spacing, periodic=surface.periodic
    )
    return threshold_of_cut(seal.film_of(untouched), "bearing")


def _of_elastic(seal: Seal) -> Threshold | None:
    if seal.contact.mean_pressure == 0:
        return None

    def press(pressure: float, start: ContactState) -> ContactState:
        seal.report("threshold", f"contact at {pressure:.3e} Pa")
        return elastic_contact(seal.scene, seal.surface, start, pressure=pressure)

    return threshold_of_pressure(seal.contact, press, lambda gap: seal.film_of(gap).sealed)


_THRESHOLDS: dict[str, Callable[[Seal], Threshold | None]] = {
    "gap": _of_gap,
    "bearing": _of_bearing,
    "gfmd": _of_elastic,
}


def _hydraulic_aperture(seal: Seal) -> HydraulicAperture:
    scene, film = seal.scene, seal.film
    if isinstance(film, GridFilm):
        height, drive = 1.0, scene.drive.pressure_drop
        uniform = uniform_rectangle(film, height, scene.fluid.viscosity, drive)
    else:
        # Of a shape in contact everywhere no height is known to be of the right size.
        height = film.highest or 1.0
        uniform = seal.leak_rate_of(film.with_gap(height))
    return hydraulic_aperture(seal.leak_rate, uniform, height)


def _trapped_volume(seal: Seal) -> float:
    return parallel.on_root(lambda: seal.film.trapped_volume)


def _conductivity_tensor(seal: Seal) -> ConductivityTensor:
    from fem_seal.flow import Limits
    from fem_seal.flow.cell_tensor import conductivity_tensor

    flow = seal.scene.flow

    def progress(unknowns: int, gap: float) -> None:
        seal.report("tensor", f"{unknowns} unknowns, known to {gap:.2g}")

    found = conductivity_tensor(
        seal.film.field,
        viscosity=seal.scene.fluid.viscosity,
        representation=flow.representation,
        rtol=flow.rtol,
        limits=Limits(
            unknowns=flow.max_unknowns, seconds=flow.max_seconds, memory_bytes=flow.max_memory
        ),
        progress=progress,
    )
    return ConductivityTensor.of(found)


QUANTITIES: dict[str, Callable[[Seal], object]] = {
    "constriction": _constriction,
    "threshold": _threshold,
    "hydraulic_aperture": _hydraulic_aperture,
    "trapped_volume": _trapped_volume,
    "conductivity_tensor": _conductivity_tensor,
}
