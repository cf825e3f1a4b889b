"""Cautions: warnings to the user of a result."""

from collections.abc import Iterator

import numpy as np

from fem_seal.contact.state import ContactState
from fem_seal.digits import length_text, per_cent, with_prefix
from fem_seal.error_budget import ErrorBudget
from fem_seal.errors import present
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.grid import GridField
from fem_seal.patch import Patch
from fem_seal.scene import FileSurface, Scene
from fem_seal.scene.shape import AnyShape, Shape
from fem_seal.scene_steps import whole_map
from fem_seal.surface import Lay, PreparedSurface, spikes_caution
from fem_seal.upscaling.seal import SealLeak, median_patch

STEEP = 1.0  # rms slope above which the film is not thin, and a unit probably wrong
LAY_RATIO = 2.0  # slopes across a lay over those along it: above it the direction is named
MOST_RATIO = 100.0  # the same ratio, above which its value says no more
OBLIQUE = 10.0  # angle between a lay and an axis above which it is neither along nor across
THICK = 0.1  # mean gap over the length of the film above which the film is not thin
# Part of the load carried by the solid below which the user is warned. Bolts and gauges easily have
# an error of 5 %: it may take all of that part away (docs/guide/lift.md).
NEAR_LIFT_OFF = 0.05
# Contact pressure that no metal bears [Pa]; hardened steel yields at a mean of 6 to 8 GPa.
UNBEARABLE = 10e9
COARSER = 1.1  # edges of a mesh over the distance of the samples above which it is too coarse
JUMP = 1e-3  # jump of a gap over its mean, above which it is named
FEWEST_TOUCHING = 10  # samples in contact below which the contact area is meaningless
# Values of [fluid] beyond which a unit is probably wrong. Liquids: from hydrogen at 20 K (13 uPa s)
# to stiff silicone oils. Gases at 1 bar have at most 51 uPa s (neon at 600 K; CRC Handbook of
# Chemistry and Physics, Viscosity of Gases), and up to 0.35 kg/mol (uranium hexafluoride).
USUAL_FLUIDS = {
    "liquid": {"viscosity": (1e-5, 1e3, "Pa s")},
    "gas": {
        "viscosity": (1e-6, 1e-4, "Pa s"),
        "molar_mass": (1e-3, 0.5, "kg/mol"),
        "temperature": (150.0, 900.0, "K"),
    },
}
BOILING = 1e4  # absolute pressure below which a liquid may boil [Pa]; water at 45 degC does


def cautions(
    patch: Patch, budget: ErrorBudget | None, seal: SealLeak | None = None
) -> tuple[str, ...]:
    """Sentences about the error budget, the heights, the contact and the gap of a patch.

    The cautions of the budget, of the patch or its seal, come first.
    """
    sentences = [entry.sentence for entry in budget or () if entry.caution]
    sentences.extend(cautions_of_map(patch))
    sentences.extend(_of_fluid(patch.scene))
    near = _near_lift_off(patch) if seal is None else _seal_near_lift_off(patch, seal)
    sentences.extend(filter(None, (near,)))
    if seal is not None and seal.state == "lifted off":
        return tuple(sentences)
    if not patch.scene.own_gap:
        shape, gap, film = patch.scene.shape, patch.grid_gap, patch.film
        length = film.size[0] if isinstance(film, GridFilm) else gap.size[0]
        floats = patch.lifted is not None and patch.lifted.floats  # on a thick film, in any unit
        of_gap = gap.slope_between_samples()
        if shape is not None and shape.grid == "polar":
            of_gap = _polar_slope(gap, shape.grid_origin[0])
        slope = steep(of_gap, "the gap")
        thick = slope or (None if floats else _thickness(float(gap.values.mean()), length))
        coarse = _coarse_mesh(film, shape, gap) if isinstance(film, MeshFilm) and shape else None
        sentences.extend(filter(None, (_contact(patch, gap), _peak(patch), thick, coarse)))
    elif isinstance(film := patch.film, MeshFilm):
        thick = _thickness(film.mean_gap, min(film.size))
        jump = _jump(film, present(patch.scene.shape, "[shape]"))
        sentences.extend(filter(None, (thick, jump)))
    return tuple(sentences)


def cautions_of_map(patch: Patch) -> tuple[str, ...]:
    """Sentences about spikes and lay of a measured map; of a seal's windows, of the whole map."""
    map_, seal = patch.scene.measured_map, patch.scene.seal
    if map_ is None:
        return ()
    prepared = present(patch.prepared, "prepared heights")
    if seal is not None and seal.window is not None:
        whole = whole_map(map_)
        prepared = PreparedSurface(whole, whole, ())
    count = np.count_nonzero(prepared.outliers) if map_.outliers is None else 0
    return tuple(filter(None, (spikes_caution(count), _lay(prepared.lay, map_))))


def _of_fluid(scene: Scene) -> Iterator[str]:
    """Warn of values that no usual fluid has, and of a liquid that may boil."""
    fluid, outlet = scene.fluid, scene.flow.outlet_pressure
    if fluid is None:
        return
    for name, (least, most, unit) in USUAL_FLUIDS[fluid.kind].items():
        value = getattr(fluid, name)
        if not least <= value <= most:
            yield (
                f"fluid.{name} = {value:g} {unit}, where a usual {fluid.kind} has {least:g} to "
                f"{most:g} {unit}: is it in the right unit?"
            )
    if fluid.kind == "liquid" and outlet is not None and outlet < BOILING:
        yield (
            f"the liquid may boil or cavitate: its pressure falls to {with_prefix(outlet, 'Pa')} "
            "at the outlet (water of 20 degC boils at 2.3 kPa), and the flow is computed as if it "
            "did not"
        )


def _lay(lay: Lay, surface: FileSurface) -> str | None:
    """Warn of a lay: the leak rate depends on which way the flow crosses it."""
    if lay.ratio <= LAY_RATIO:
        return None
    off_x = min(lay.angle, 180 - lay.angle)
    off_axis = min(off_x, 90 - off_x)
    times = f"{lay.ratio:.2g} times" if lay.ratio < MOST_RATIO else f"over {MOST_RATIO:g} times"
    turned = f"surface.turn = {(surface.turn + 90) % 360}"
    if off_axis > OBLIQUE:
        flows = f"at {off_x:.0f} degrees to it, and with {turned} at {90 - off_x:.0f}"
    else:
        ways = ("along", "across") if off_x < OBLIQUE else ("across", "along")
        flows = f"{ways[0]} it, and with {turned} {ways[1]}"
    chevrons = ""
    if surface.make_periodic == "mirror" and off_axis > OBLIQUE:
        chevrons = (
            "; mirroring bends such a lay into chevrons, which the surface has not: measure the "
            "part with its lay along x or y, or compare with make_periodic = 'tukey'"
        )
    return (
        f"the surface has a lay at {lay.angle:.0f} degrees from x towards y, across which slopes "
        f"are {times} those along it: the flow, along x, runs {flows}{chevrons}"
    )


def _near_lift_off(patch: Patch) -> str | None:
    """Warn if the fluid carries nearly all of the load of a patch that leaks."""
    if patch.lifted is None or patch.lifted.state != "leaking":
        return None
    solid = present(patch.lifted.contact, "contact").mean_pressure
    load = solid + patch.lifted.fluid_load
    if patch.lifted.floats:
        gap = length_text(patch.grid_gap.values.mean())
        return (
            f"floats: the fluid carries the whole load, and the solid rests on a film of {gap} on "
            "average, without contact; a tilt of the solid, which makes one side leak more, is not "
            "modelled"
        )
    if solid >= NEAR_LIFT_OFF * load:
        return None
    return (
        f"next to lift-off: the solid carries {with_prefix(solid, 'Pa')}, {per_cent(solid / load)} "
        "of the load, and the fluid the rest; a few per cent less load or more fluid pressure may "
        "lift the seal off"
    )


def _seal_near_lift_off(patch: Patch, seal: SealLeak) -> str | None:
    """Warn if the total pressure of a seal is hardly above the fluid's at the inlet."""
    along, inlet = median_patch(seal.patches).path, patch.scene.flow.gauge_pressures.inlet
    if seal.state == "lifted off" or along is None:
        return None
    highest = float(along.total_pressure.max())
    excess = 1 - inlet / highest
    if excess >= NEAR_LIFT_OFF:
        return None
    return (
        f"next to lift-off: the total pressure is at most {with_prefix(highest, 'Pa')}, the "
        f"fluid's at the inlet {with_prefix(inlet, 'Pa')}; {per_cent(excess)} less total pressure "
        "lifts the seal off"
    )


def _contact(patch: Patch, gap: GridField) -> str | None:
    """Warn if all samples, or hardly any, are in contact, and name the likely cause."""
    touching = np.count_nonzero(gap.values == 0)
    if touching == gap.values.size:
        no_contact = patch.scene.contact is None
        units = (
            "is the gap in the right unit?"
            if no_contact
            else "are the heights, the load and the modulus in the right units?"
        )
        return f"all samples are in contact, and the mean gap is 0: {units}"
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
    if pressed and touching < FEWEST_TOUCHING:
        samples = "1 sample is" if touching == 1 else f"only {touching} samples are"
        return (
            f"{samples} in contact, too few for their area: are the heights, the load and the "
            "modulus in the right units?"
        )
    return None


def _peak(patch: Patch) -> str | None:
    """Warn if the peak of an elastic contact pressure is beyond what any metal bears."""
    contact = patch.film_contact
    peak = float(contact.pressure.values.max()) if isinstance(contact, ContactState) else 0.0
    if peak <= UNBEARABLE:
        return None
    return (
        f"the elastic contact pressure is up to {with_prefix(peak, 'Pa')}, which no metal bears: "
        "it yields, more of it touches, and less leaks than computed"
    )


def _polar_slope(gap: GridField, first: float) -> float:
    """Rms slope between the samples of a polar gap, from a first radius [m] on."""
    dr, dtheta = gap.spacing
    arcs = dtheta * (first + dr * np.arange(gap.shape[0], dtype=float))
    away = arcs > 0  # a sample at the origin has no arc
    around = np.diff(gap.values[away], axis=1) / arcs[away, None]
    squares = [np.square(step) for step in (np.diff(gap.values, axis=0) / dr, around) if step.size]
    return float(np.sqrt(sum(map(np.mean, squares))))


def _thickness(mean_gap: float, length: float) -> str | None:
    """Warn if a mean gap [m] is too high for a film of a length [m]; flat gaps have no slopes."""
    if mean_gap <= THICK * length:
        return None
    return (
        f"the mean gap is {length_text(mean_gap)}, no thin film on a length of "
        f"{length_text(length)}: are gap and lengths in the right units?"
    )


def _coarse_mesh(film: MeshFilm, shape: AnyShape, gap: GridField) -> str | None:
    """Warn of a mesh coarser than the samples of its gap: it misses their channels and contact."""
    mesh, samples = film.mesh, gap.spacing
    if shape.grid == "polar":
        samples = samples[0], samples[1] * float(np.hypot(*mesh.xy.T).max())
    name = "smallest_size" if shape.smallest_size else "mesh_size"
    edge, of_mesh = getattr(shape, name, None), f"shape.{name}"
    if edge is None:
        edge = float(np.median(np.hypot(*np.diff(mesh.xy[mesh.edges.ends], axis=1)[:, 0].T)))
        of_mesh = "the median edge of the mesh"
    if edge <= COARSER * min(samples):
        return None
    of_shape, of_samples = map(per_cent, (film.contact_area_fraction, np.mean(gap.values == 0)))
    return (
        f"{of_mesh} = {length_text(edge)} is coarser than the samples of the gap, "
        f"{length_text(min(samples))} apart, so that the film misses channels and contact "
        f"({of_shape} of the shape's area, {of_samples} of the samples); take edges no longer than "
        "that, in channels at least (shape.smallest_size)"
    )


def _jump(film: MeshFilm, shape: Shape) -> str | None:
    """Warn if the gap of a shape jumps where theta does, at 180 degrees, inside the film."""
    from fem_seal.shaped import gap_source

    gap = gap_source(shape, None)
    x, y = np.moveaxis(film.mesh.xy[film.mesh.cells], 2, 0)
    across = (x.max(axis=1) < 0) & (y.min(axis=1) < 0) & (y.max(axis=1) >= 0)
    radii = np.hypot(x, y)[across].ravel()
    if radii.size == 0:
        return None
    # The sign of a zero y says on which side of the jump a point lies.
    above, below = (
        gap(np.column_stack([-radii, np.full_like(radii, side)])) for side in (0.0, -0.0)
    )
    jump = float(np.abs(above - below).max())
    if jump <= JUMP * film.mean_gap:
        return None
    return (
        f"the gap jumps by {length_text(jump)} at theta = 180 degrees, from where theta goes "
        "on at -180 degrees; the film is linear between the vertices on both sides"
    )


def steep(slope: float, what: str) -> str | None:
    """Warn if a gap or surface with this rms slope is too steep for contact and film."""
    if slope <= STEEP:
        return None
    return (
        f"{what} has slopes of {slope:.2g} (rms), where contact and film want them well below 1: "
        "are heights and spacing in the same unit?"
    )
