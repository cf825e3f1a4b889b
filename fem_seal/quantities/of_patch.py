"""The quantities of a scene, from the steps of its Patch."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from fem_seal import parallel
from fem_seal.errors import present
from fem_seal.film import GridFilm
from fem_seal.leak_rate import Estimate
from fem_seal.patch import Patch
from fem_seal.quantities.aperture import hydraulic_aperture, uniform_rectangle
from fem_seal.quantities.constriction import Constriction, constriction
from fem_seal.quantities.tensor import ConductivityTensor
from fem_seal.scene_steps import FLOWS
from fem_seal.threshold import Threshold, threshold


@dataclass(frozen=True)
class Quantities:
    """The quantities that a scene names, in SI units; None if not named, or if there is none."""

    constriction: Constriction | None = None  #: the critical one
    threshold: Threshold | None = None
    hydraulic_aperture: Estimate | None = None  #: [m]
    trapped_volume: float | None = None  #: of the pockets [m³]
    conductivity_tensor: ConductivityTensor | None = None  #: in all directions
    sensitivity: dict[str, float] | None = None  #: d ln Q/d ln of each input


def quantities(patch: Patch) -> Quantities | None:
    """Compute the quantities that the scene names; None if it names none.

    With a limit the constriction is computed as well: it shows how near the patch is to sealing.
    """
    scene = patch.scene
    named = set(scene.output.products)
    if scene.limit and scene.needs_leak_rate:
        named.add("constriction")
    names = [name for name in QUANTITIES if name in named]
    if patch.lifted_off:
        # There is no film; only the load that would keep the solids together can be computed.
        names = [name for name in names if name == "threshold"]
    if not names:
        return None
    with patch.timed("quantities"):
        computed: dict[str, Any] = {name: QUANTITIES[name](patch) for name in names}
    return Quantities(**computed)


def _constriction(patch: Patch) -> Constriction | None:
    field = patch.leak_rate.field
    potential = None
    if field is not None:
        critical = present(patch.film.constriction, "constriction").gap
        drive, slip, p = patch.scene.drive, patch.scene.slip, field.pressure
        potential = drive.potential(p) if slip is None else slip.potential(p, critical)
    return parallel.on_root(lambda: constriction(patch.film, field, potential), patch.comm)


def _hydraulic_aperture(patch: Patch) -> Estimate:
    scene, film = patch.scene, patch.film
    if isinstance(film, GridFilm):
        gap, drop = 1.0, scene.drive.pressure_drop
        uniform = uniform_rectangle(film, gap, scene.viscosity, drop, scene.slip)
    else:
        # A shape in contact everywhere has no open gap: take any for the uniform film.
        gap = film.largest_gap or 1.0
        settings = replace(patch.flow_settings, decide=None)
        uniform = FLOWS[settings.method](settings, film.with_gap(gap), patch.report, patch.comm)
    return hydraulic_aperture(patch.leak_rate, uniform, gap, scene.slip)


def _trapped_volume(patch: Patch) -> float:
    film = patch.film
    return parallel.on_root(lambda: film.trapped_volume, patch.comm)


def _conductivity_tensor(patch: Patch) -> ConductivityTensor:
    from fem_seal.flow.cell_tensor import conductivity_tensor

    flow = patch.scene.flow
    # With a leak rate that of its flow, which a total error chooses.
    rtol = patch.flow_settings.rtol if patch.scene.needs_leak_rate else flow.rtol

    def progress(unknowns: int, width: float) -> None:
        patch.report("tensor", f"{unknowns} unknowns, known to {width:.2g}")

    bounds = conductivity_tensor(
        patch.grid_gap,
        viscosity=patch.scene.viscosity,
        slip=patch.scene.slip,
        representation=flow.representation,
        rtol=rtol,
        limits=flow.limits,
        progress=progress,
        comm=patch.comm,
    )
    return ConductivityTensor.of(bounds)


def _sensitivity(patch: Patch) -> dict[str, float] | None:
    sensitivity = patch.sensitivity
    return None if sensitivity is None else sensitivity.by_input


QUANTITIES: dict[str, Callable[[Patch], object]] = {
    "constriction": _constriction,
    "threshold": threshold,
    "hydraulic_aperture": _hydraulic_aperture,
    "trapped_volume": _trapped_volume,
    "conductivity_tensor": _conductivity_tensor,
    "sensitivity": _sensitivity,
}
