"""One surface on coarser and finer grids: what the grid of its contact does to the leak rate.

The leak rate of a finer grid is estimated from two grids, n/2 and n, by one rule (`grid_error`).
The rule and how well it held: docs/guide/contact-grid.md.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import exp, hypot, inf, log, log1p

import numpy as np

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.digits import per_cent
from fem_seal.error_budget import CONTACT_GRID, MOST_LOG, Uncertainty, estimate
from fem_seal.errors import NotConverged, narrowed, present
from fem_seal.film import GridFilm, MeshFilm
from fem_seal.flow_settings import FlowSettings
from fem_seal.grid import GridField
from fem_seal.leak_rate import Estimate, Factors, log_ratio
from fem_seal.lifting import lifting_problem
from fem_seal.memory import available_memory
from fem_seal.patch import Given, Patch, once
from fem_seal.progress import silent
from fem_seal.scene import Scene
from fem_seal.scene_steps import FLOWS
from fem_seal.sensitivity import ByLoad
from fem_seal.slip_error import slip_entry
from fem_seal.surface.resampling import resample
from fem_seal.threshold import sealing_load
from fem_seal.worker import in_worker

LEAST_SAMPLES = 8  # along each side of a grid
# The flow on a coarser grid, which only compares grids, is looser by this factor, up to LOOSEST.
LOOSER, LOOSEST = 6.0, 0.3
# Factors of the rule (`grid_error`), fitted to the surfaces of docs/guide/contact-grid.md:
OF_UNRESOLVED = 0.5  # of u/g_c, the height between the samples over the critical gap, in e
OF_CHANGE = 0.15  # of the change of ln Q from half of the samples, in e
SECOND_ORDER = 4.0  # of e², added to e
MOST_E = 0.8  # e from which the constriction may close
MOST = MOST_E * (1 + SECOND_ORDER * MOST_E)  # largest |Δ ln Q| that is claimed for both sides
IF_LIFTED = 1.5  # of e where the fluid lifts the solid
LINEAR_GAP = "the gap that is linear between the samples"
# Samples from which the coarser grid is solved in a process of its own while the flow is, and
# the memory that must be available for that process and for the flow: dry and lifted, bytes for
# each sample of the finer grid, and for the libraries.
DRY_IN_WORKER, LIFTED_IN_WORKER = 2048**2, 1024**2
DRY_BYTES, LIFTED_BYTES, BYTES_OF_WORKER = 80, 800, 1e9
# A patch is sealed on finer grids as well if it stays so under its load over 1 plus a margin and a
# multiple of u/h_rms, the height between the samples over the rms height.
MARGIN, OF_UNRESOLVED_RMS = 0.1, 2.5


def grids(samples: tuple[int, int], max_refinement: int) -> list[tuple[int, int]]:
    """Contact grids to try, each about twice as fine as the one before."""
    (nx, ny), coarse = samples, half(samples)
    factors = (2**k for k in range(max_refinement.bit_length()))
    return [*([coarse] if coarse else []), *((nx * factor, ny * factor) for factor in factors)]


def half(samples: tuple[int, int]) -> tuple[int, int] | None:
    """Half of the samples along each side; None if they are too few."""
    nx, ny = (round(n / 2) for n in samples)
    return (nx, ny) if min(nx, ny) >= LEAST_SAMPLES else None


def on_half(patch: Patch, even: bool = False) -> Patch | None:
    """Same patch on half of its samples, its flow looser and without a limit; None if too few.

    With `even` both numbers of samples are even: the flow of a mirrored map is then that of a
    quarter of it.
    """
    surface, settings = present(patch.surface, "surface"), patch.flow_settings
    shape = half(surface.shape)
    if shape is None:
        return None
    if even:
        shape = 2 * round(surface.shape[0] / 4), 2 * round(surface.shape[1] / 4)
    rtol = max(settings.rtol, min(LOOSER * settings.rtol, LOOSEST))
    settings = replace(settings, rtol=rtol, decide=None, field=False)
    return patch.with_(Given(resample(surface, shape), flow_settings=settings))


def rate_range(patch: Patch) -> Estimate:
    """Leak rate of a patch [m³/s]: the value alone, or with the range that a lift leaves."""
    state, value = patch.lifted, patch.leak_rate.value
    if state is not None and state.is_range:
        return Estimate(value, state.lowest, state.highest)
    return Estimate(value)


def error_of_sealed(patch: Patch) -> Uncertainty:
    """Whether a finer grid may open a sealed patch: it must stay sealed under a part of its load.

    The heights between the samples, u over the rms height, let a finer grid seal under more load.
    """
    height = present(patch.surface, "surface")
    left_out, rms = unresolved(height), float(height.values.std())
    load_share = 1 / (1 + MARGIN + OF_UNRESOLVED_RMS * (left_out / rms if rms else 0.0))
    less = f"under {per_cent(1 - load_share)} less load, as much as the grid may be wrong"
    try:
        if sealed_under(patch, load_share):
            return estimate(CONTACT_GRID, f"it is sealed as well {less}", 1.0, 1.0)
        words = f"this one may {less}"
    except NotConverged as error:
        words = f"{less}, {error}"
    return estimate(CONTACT_GRID, f"a finer grid may leak: {words}", 1.0)


def sealed_under(patch: Patch, load_share: float) -> bool:
    """Whether a patch is sealed under a part of its load, and no fluid pressure would open it."""
    if not present(patch.scene.contact, "[contact]").is_elastic:
        area = present(patch.contact, "contact").contact_area_fraction
        return load_share * area >= (sealing_load(patch) or 0.0)
    lighter = patch.pressed_by(load_share * present(patch.carried_load, "load"), patch.lift)
    return lighter.state == "sealed" and (lighter.lifted is None or not lighter.lifted.is_range)


def estimates_grid_error(scene: Scene) -> bool:
    """Whether a patch is solved on half of its samples as well."""
    contact, accuracy = scene.contact, scene.accuracy
    asked = scene.total_error is None and (accuracy is None or accuracy.contact_grid)
    return asked and contact is not None and contact.is_elastic and scene.shape is None


def pays_in_worker(samples: float, lifted: bool, comm: parallel.Comm = None) -> bool:
    """Whether a second process during the flow of so many samples saves time: a core is idle."""
    idle = parallel.processes(comm) == 1 and parallel.cores() > 1
    return idle and samples >= (LIFTED_IN_WORKER if lifted else DRY_IN_WORKER)


@once
def half_solver(patch: Patch) -> Callable[[], Estimate | None]:
    """Solver of half of the samples: here, or in a process of its own (`half_in_worker`)."""
    return partial(_solved_here, patch)


@contextmanager
def half_in_worker(patch: Patch) -> Iterator[None]:
    """Solve half of the samples while the block runs, where they are asked for and that saves time.

    The flow of a patch uses one core: another process uses the second one where it is idle.
    """
    asked = patch.scene.leak_rate_of == "patch" and estimates_grid_error(patch.scene)
    if not asked or not _saves_time(patch):
        yield
        return
    given = Given(
        patch.surface, load=patch.load, lift=patch.lift, flow_settings=patch.flow_settings
    )
    with in_worker(_solved_in_worker, patch.scene, given) as answer:
        # Kept after the block: it has the answer then, or solves here.
        patch.keep(half_solver, answer)
        yield


def _saves_time(patch: Patch) -> bool:
    """Whether half of the samples during the flow save time, and fit into the memory."""
    lifted, samples = patch.lift == "resolved", present(patch.surface, "surface").values.size
    need = BYTES_OF_WORKER + (LIFTED_BYTES if lifted else DRY_BYTES) * samples
    pays = pays_in_worker(samples, lifted, patch.comm) and available_memory() >= need
    return pays and (lifted or not patch.sealed)


def _solved_here(patch: Patch) -> Estimate | None:
    """Leak rate on half of the samples [m³/s]; None if the fluid lifts their solid off."""
    coarse = present(on_half(patch), "coarser grid")
    return None if coarse.lifted_off else rate_range(coarse)


def _solved_in_worker(scene: Scene, given: Given) -> Estimate | None:
    return _solved_here(Patch(scene, given=given))


def unresolved(height: GridField) -> float:
    """Height that a grid leaves out between its samples [m], rms: (h(x-dx) - 2 h(x) + h(x+dx)) / 8.

    It is the error of linear interpolation in the middle of two samples, of both directions. Only
    samples with neighbours on all sides count.
    """
    h = np.pad(height.values, 1, mode="wrap") if height.periodic else height.values
    second = np.diff(h, 2, axis=0)[:, 1:-1], np.diff(h, 2, axis=1)[1:-1]
    return float(np.sqrt(sum(np.mean(np.square(part)) for part in second)) / 8)


def counting_error(patch: Patch) -> float | None:
    """|Δ ln Q| by the load that a prescribed area lacks, since samples on its edge count whole.

    The patch must leak. The load grows as the area does, of which the perimeter takes a part
    off (`contact_area_corrected`). None unless the area of an elastic contact is prescribed.
    """
    if patch.load.kind != "area_fraction" or not isinstance(patch.film_contact, ContactState):
        return None
    by = by_load(patch)
    counted = by.contact.contact_area_fraction / by.contact.contact_area_corrected
    load = present(patch.carried_load, "load")
    return parallel.on_root(lambda: abs(by.log_rate) * load * log(counted), patch.comm)


def critical_gap(patch: Patch) -> float:
    """Gap of the critical constriction of a patch that leaks [m]."""
    return present(patch.film.constriction, "constriction").gap


@once
def by_load(patch: Patch) -> ByLoad:
    """Derivatives of an elastic contact by its load."""
    critical = 0.0 if patch.sealed else critical_gap(patch)
    contact = narrowed(patch.film_contact, ContactState, "contact")
    height = present(patch.surface, "surface")
    problem = lifting_problem(patch.scene, patch.load, patch.flow_settings, height, silent)
    return ByLoad(problem, contact, patch.lifted, critical)


def between_pixels(
    film: GridFilm | MeshFilm, settings: FlowSettings, own: Estimate, comm: parallel.Comm
) -> float:
    """|Δ ln Q| to the gap that is linear between the samples; 0 unless each fills one pixel.

    Where the way of the flow leads through corners of such pixels it has no finite width, and on
    finer grids another conductance. Finite differences take no corners.
    """
    if not isinstance(film, GridFilm) or film.representation == "linear":
        return 0.0
    if settings.method == "finite-difference":
        return 0.0
    film = replace(film, representation="linear")
    settings = replace(settings, decide=None, field=False)
    linear = FLOWS[settings.method](settings, film, silent, comm)
    return change_of(Estimate(linear.value) if linear.converged else linear, own)


def grid_error(
    change: float,
    unresolved_share: float,
    counted: float | None = None,
    *,
    lifted: bool = False,
    pixels: float = 0.0,
) -> Uncertainty:
    """Estimate what a finer grid changes, from a leaking grid and one of half its samples.

    Two parts make up e. What the grid leaves out of the heights, u, shifts the gap of the critical
    constriction g_c, and with it ln Q: `unresolved_share` = u/g_c, which falls as the square of the
    spacing. Where that place does not rule the flow, `change` = |ln Q(n) - ln Q(n/2)| says more.
    Next to closing the way of the flow changes too: e + 4 e² allows for it. From e = 0.8 on, where
    an area leaves as much in all, and where the coarser grid is sealed, the constriction may close,
    and the lower side is open. The upper one then is at least the cube of 1 + u/g_c, which opens
    the constriction as far as the grid may be wrong. The load that gives a prescribed area, which
    counts samples, errs as the spacing: all changes to come add up to the last one, which is small
    by chance at times, and to `counted`, its `counting_error`. Where the fluid lifts the solid, e
    is larger by half: it lifts more where a constriction is wider. `pixels` is the change by the
    gap between the samples (`between_pixels`), which ends on ever finer grids.
    """
    first_order = OF_UNRESOLVED * unresolved_share + OF_CHANGE * change
    if lifted:
        first_order *= IF_LIFTED
    sentence = (
        "what four times the samples along each side would change, estimated from the leak rate on "
        "half of the samples and from the height that the grid leaves out between its samples, "
        f"{per_cent(unresolved_share)} of the gap of the critical constriction"
    )
    if pixels:
        sentence += f", and from {LINEAR_GAP}"
    claimed = first_order * (1 + SECOND_ORDER * first_order) + pixels
    if counted is not None:
        claimed += hypot(change, counted)
    if claimed < MOST:
        return estimate(CONTACT_GRID, sentence, exp(-claimed), exp(claimed))
    most = max(MOST, 3 * log1p(unresolved_share))
    sentence += "; a finer grid may be sealed"
    return estimate(CONTACT_GRID, sentence, upper=exp(min(most, MOST_LOG)))


@once
def estimated_error(patch: Patch) -> Uncertainty:
    """Estimate what a finer grid changes, for which the patch is solved on half of the samples.

    A sealed patch is solved under less load instead (`error_of_sealed`). For a measured map: what
    half of the samples change. Its own samples are all that is known.
    """
    if patch.given.grid_error is not None:
        return patch.given.grid_error(patch)
    if half(present(patch.surface, "surface").shape) is None:
        words = "the samples are too few to leave out every second one"
        return estimate(CONTACT_GRID, words)
    if patch.lifted is not None and not patch.lifted.converged:
        words = "contact and flow have not settled on the grid of the scene"
        return estimate(CONTACT_GRID, words)
    with patch.timed("contact grid"):
        if patch.state == "sealed":
            return error_of_sealed(patch)
        try:
            return _from_coarser(patch, half_solver(patch)())
        except NotConverged as error:
            return estimate(CONTACT_GRID, f"on half of the samples: {error}")


def error_beyond(patch: Patch, other: Patch) -> Factors:
    """Factors on the ends of another load's leak rate for what grid, slip and lift err more there.

    The factors of the entries of `patch` multiply its leak rate as well. Next to closing the grid
    errs far more, and a finer one may be sealed; of a sealed patch slip is no entry. Where the
    fluid lifts the solid off, neither limits the leak rate.
    """
    factors = Factors()
    if other.lifted_off:
        return factors
    sources: list[Callable[[Patch], Uncertainty | None]] = [slip_entry]
    if estimates_grid_error(patch.scene) or patch.scene.total_error is not None:
        sources.append(estimated_error)
    for source in sources:
        if (there := source(other)) is not None:
            here = source(patch)
            factors *= there.factors.beyond(Factors() if here is None else here.factors)
    if other.lifted is not None and other.lifted.converged:
        own = 0.0 if patch.lifted is None else patch.lifted.error
        beyond = exp(max(other.lifted.error - own, 0.0))
        factors *= Factors(1 / beyond, beyond)
    return factors


def error_from_half(patch: Patch, coarse: Estimate) -> Uncertainty:
    """`grid_error` of a leaking patch, from its leak rate on half of the samples [m³/s]."""
    unresolved_share = unresolved(present(patch.surface, "surface")) / critical_gap(patch)
    (change, pixels), lifted = _changes(patch, coarse), patch.lifted is not None
    counted = counting_error(patch)
    return grid_error(change, unresolved_share, counted, lifted=lifted, pixels=pixels)


def _changes(patch: Patch, coarse: Estimate) -> tuple[float, float]:
    """|Δ ln Q| of a leaking patch to half of its samples, and to the gap between them."""
    own = rate_range(patch)
    pixels = between_pixels(patch.film, patch.flow_settings, own, patch.comm)
    return change_of(coarse, own), pixels


def _from_coarser(patch: Patch, coarse: Estimate | None) -> Uncertainty:
    if coarse is None:
        return estimate(CONTACT_GRID, "on half of the samples the fluid lifts the solid off")
    if patch.scene.measured_map is None:
        return error_from_half(patch, coarse)
    return error_of_map(*_changes(patch, coarse))


def error_of_map(change: float, pixels: float) -> Uncertainty:
    """Estimate of a measured map: what half of its samples change, which are all that is known.

    `change` and `pixels` are |Δ ln Q| as of `grid_error`.
    """
    sentence = "what half of the samples of the map change"
    if change == inf:
        return estimate(CONTACT_GRID, f"{sentence}: they are sealed", upper=exp(MOST))
    if pixels:
        sentence += f", and {LINEAR_GAP}"
    change += pixels
    return estimate(CONTACT_GRID, sentence, exp(-change), exp(min(change, MOST_LOG)))


def change_of(coarse: Estimate, fine: Estimate) -> float:
    """Largest ln of the ratio of the leak rates of two grids; infinite if one alone is sealed."""
    (least, most), (lower, upper) = coarse.range, fine.range
    return max(log_ratio(upper, least), log_ratio(most, lower))
