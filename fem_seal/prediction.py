"""Time and memory of a scene before it is solved.

The laws were fitted to runs on one core; `python tests/benchmarks/prediction.py` says how far they
are off. They hold where contacts are open: next to closing a lift takes up to ten times as long as
predicted, and a patch that is sealed needs no flow at all.
"""

from dataclasses import dataclass
from functools import cache
from math import ceil, inf, log2, pi, prod, sqrt
from time import thread_time

import numpy as np

from fem_seal import parallel
from fem_seal.contact.halfspace import THREADED_FROM
from fem_seal.contact.settings import USUAL_BYTES
from fem_seal.errors import InvalidInput, present
from fem_seal.grid import GridField
from fem_seal.grid_series import LOOSER, LOOSEST, estimates_grid_error, half, pays_in_worker
from fem_seal.memory import available_memory
from fem_seal.patch import Patch
from fem_seal.points import Expected, Work
from fem_seal.progress import duration
from fem_seal.scene import Scene, SelfAffine
from fem_seal.upscaling.conductivity import ConductivityTable
from fem_seal.upscaling.patch_conductivity import KEPT
from fem_seal.upscaling.path_flow import seal_flow
from fem_seal.upscaling.refined_table import intervals_needed
from fem_seal.upscaling.scene_profile import leak_path_of
from fem_seal.upscaling.solved_patches import OF_FLOWS

# A machine is as many times slower than that of the laws as it takes longer to compile STATEMENTS.
# While others used the same memory, compiling took 2.0 times as long, and a contact of 4096²
# samples with its flow 1.8 times. An FFT of 512² samples took 3.2 times: it would predict too much.
COMPILE = 4.6e-3  # CPU time on that machine [s]
STATEMENTS = "name = [function(argument) for argument in arguments if argument]\n" * 200
COMPILED_SECONDS = 0.1  # CPU seconds for which that is repeated
# CPU time [s] and memory [bytes] of importing what a stage needs.
CONTACT_IMPORTS = 1.1, 0.95e8
FLOW_IMPORTS = 0.75, 0.8e8
PICTURE_IMPORTS = 5.0, 8.8e8
SEAL_PICTURES = 2.2, 1.7e8  # no flow is drawn
OF_DIFFERENCES = 1e-5  # CPU time of a flow by finite differences [s/sample]
BY_AREA = 1.2  # time of the search for a contact area, over that of a contact under its pressure
# Time of the entry "contact area", over that of the contact, or of the flow that lifts it.
OF_CONTACT, OF_LIFT = 0.5, 0.2
LIFT_OF_SAMPLE = 6e-6  # CPU time of the networks of a flow that lifts [s/sample]
BYTES_OF_LIFT = 420  # memory of the networks of a flow that lifts [bytes/sample]
BYTES_OF_UNKNOWN = 1200  # memory of a flow [bytes/unknown]
# A patch of a seal takes at each net load:
NEXT_CONTACT = 0.5  # time of its contact, which starts from another, over that of a first one
OF_LOAD = 1.6  # time of its flow over that of one film, at a seal.rtol of USUAL_RTOL
EACH_LOAD = 0.1  # time that does not grow with the patch [s]
USUAL_RTOL = 0.5
# Memory of each flow that a patch of a seal keeps.
KEPT_OF_UNKNOWN = 500  # [bytes/unknown]
KEPT_OF_SAMPLE = 370  # [bytes/sample]
OF_WAVES = 0.91  # d ln(channels) over d ln(shortest waves along a side)
USUAL_WAVES = 8.0  # longest waves along a side of a map, where nobody says how many
# K of a patch falls as (1 - w/w_c)^EXPONENT with the net load w, which seals it at about w_c =
# SEALING E* h'rms; patches that leak are sealed at LEAST_SEALING of their decisive load at least.
EXPONENT, SEALING, LEAST_SEALING = 3.3, 0.2, 1.03
MODEL_LOADS, MODEL_CELLS = 60, 200  # of the table and the path of that K
# A table that is refined on the way needs so many times the intervals of one whose K is known.
OF_DEMAND = 1.4
# There is advice from this time [s], or from this part of the available memory, on.
LONG_SECONDS = 600.0
MEMORY_SHARE = 0.8


@dataclass(frozen=True)
class Prediction:
    """Time and memory that a scene takes on this machine, mostly to a factor of 1.5.

    Of contacts that leak easily to a factor of 2; a lift next to closing takes up to ten times as
    long as predicted.
    """

    samples: tuple[int, int]  #: of a patch
    patches: int  #: of the seal; 1 without one
    jobs: int  #: processes that share the patches
    parts: dict[str, float]  #: time of each stage [s]
    each_patch: Expected | None  #: of a seal
    memory: float  #: of all processes [bytes]
    advice: str  #: what makes it shorter; "" where it is short

    @property
    def seconds(self) -> float:
        """Time of the whole [s]."""
        return sum(self.parts.values())

    @property
    def of_point(self) -> Expected:
        """What a point of a sweep with this scene takes, once the libraries are there."""
        return Expected(self.seconds - self.parts["libraries"], self.memory)

    def __str__(self) -> str:
        nx, ny = self.samples
        patches = "" if self.patches == 1 else f"{self.patches} patches of "
        shared = "" if self.jobs == 1 else f" in {self.jobs} processes"
        parts = ", ".join(f"{name} {duration(seconds)}" for name, seconds in self.parts.items())
        words = (
            f"{patches}{nx} x {ny} samples{shared}: about {duration(self.seconds)} ({parts}) and "
            f"{self.memory / 1e9:.1f} GB"
        )
        return f"{words}; {self.advice}" if self.advice else words


def predicted(
    scene: Scene, surface: GridField | None = None, work: Work | None = None
) -> Prediction:
    """Predict time and memory of a scene; a file of heights or gaps is read if none are given.

    The patches of a [seal] count as shared among workers, or one after the other without `work`.
    """
    _require_predictable(scene)
    if surface is None and (scene.seal is not None or not isinstance(scene.surface, SelfAffine)):
        patch = Patch(scene)
        surface = patch.grid_gap if scene.surface is None else patch.surface
    shape, channels = _grid(scene, surface)
    samples, pace = prod(shape), _pace()
    parts = {name: pace * time for name, time in _stages(scene, shape, channels).items()}
    flows = scene.solves_any_flow or "tensor" in parts
    libraries = [CONTACT_IMPORTS] + [FLOW_IMPORTS] * flows
    memory = sum(size for _, size in libraries) + USUAL_BYTES * samples
    if scene.lift == "resolved":
        memory += BYTES_OF_LIFT * samples
    patches, jobs, each_patch = 1, 1, None
    if scene.seal is not None:
        heights = present(surface, "surface")
        seconds, of_flows = _seal_patch(scene, heights, samples, channels)
        memory += of_flows
        patches, each_patch = scene.seal.patches, Expected(pace * seconds, memory)
        jobs = min((work or Work()).jobs_for(patches, each_patch), patches)
        parts["patches"] = ceil(patches / jobs) * each_patch.seconds
    elif flows:
        memory += BYTES_OF_UNKNOWN * unknowns_of(channels, _rtol(scene))
    if scene.tolerances is not None and not scene.scales_exactly:
        # The whole again for the least and for the largest leak rate.
        parts["tolerances"] = 2 * sum(parts.values())
    memory *= max(jobs, parallel.processes())
    if jobs > 1:
        # The process that waits for the workers has solved the contact of the first patch.
        memory += CONTACT_IMPORTS[1] + USUAL_BYTES * samples
    start = sum(seconds for seconds, _ in libraries)
    if "pictures" in scene.output.products:
        # The memory of the flow is free by then.
        seconds, size = PICTURE_IMPORTS if scene.seal is None else SEAL_PICTURES
        memory = max(memory, size + USUAL_BYTES * samples)
        parts["pictures"] = pace * seconds
    parts = {"libraries": pace * start} | parts
    advice = _advice(scene, sum(parts.values()), memory)
    if work is not None and work.memory is not None and memory > work.memory:
        exceeds = f"that exceeds the {work.memory / 1e9:.3g} GB of --memory"
        advice = f"{exceeds}; {advice}" if advice else exceeds
    return Prediction(shape, patches, jobs, parts, each_patch, memory, advice)


def _require_predictable(scene: Scene) -> None:
    """Raise InvalidInput for scenes whose time depends on what only the solution shows."""
    if scene.shape is not None:
        raise InvalidInput("time and memory of a [shape] depend on its mesh and are not predicted")
    if scene.flow.method == "uniform" and scene.solves_flow:
        raise InvalidInput(
            "time and memory of flow.method = 'uniform' depend on how smooth the gap is, and are "
            "not predicted: each mesh has four times the unknowns of the last, and "
            "flow.max_unknowns, flow.max_seconds or flow.max_memory ends them; 'adaptive' needs "
            "fewer unknowns for the same flow.rtol"
        )


def _rtol(scene: Scene) -> float:
    """Tolerance of the flow, or of all where the scene limits the total error."""
    return scene.total_error or scene.flow.rtol


def _stages(scene: Scene, shape: tuple[int, int], channels: float) -> dict[str, float]:
    """CPU time [s] of the stages of one patch, on the machine of the laws."""
    samples, rtol, lifted = prod(shape), _rtol(scene), scene.lift == "resolved"
    pressed = scene.contact is not None and scene.contact.is_elastic
    by_area = pressed and scene.load.kind == "area_fraction"

    def of_contact(samples: float) -> float:
        """Time of the dry contact; two threads take 0.6 of the time of one."""
        threads = parallel.cores() if samples >= THREADED_FROM else 1
        each = contact_seconds(samples) * (BY_AREA if by_area else 1.0)
        return each / threads**0.75 if pressed else 0.0

    def of_flow(samples: float, rtol: float) -> float:
        """Time of the flow, and of its equilibrium with the contact."""
        each = flow_seconds(samples, channels, rtol)
        if scene.flow.method == "finite-difference":
            each = OF_DIFFERENCES * samples
        # A gas that slips takes two flows.
        each = 2 * each if lifted or scene.slip is not None else each
        return (each + LIFT_OF_SAMPLE * samples * lifted) / sqrt(parallel.processes())

    contact, flow = of_contact(samples), of_flow(samples, rtol)
    stages = {"contact": contact}
    if scene.solves_flow:
        stages["flow and lift" if lifted else "flow"] = flow
    if scene.needs_leak_rate:
        if scene.lift == "range":
            stages["range"] = contact + flow
        if by_area:
            stages["contact area"] = OF_CONTACT * contact + OF_LIFT * flow * lifted
        coarse = half(shape) if estimates_grid_error(scene) else None
        if coarse is not None:
            both = of_contact(prod(coarse)) + of_flow(prod(coarse), min(LOOSER * rtol, LOOSEST))
            during = flow if pays_in_worker(samples, lifted) else 0.0
            if scene.flow.representation == "constant":
                both += flow  # of the gap that is linear between the samples
            stages["contact grid"] = max(both - during, 0.0)
            if scene.lift == "range":
                stages["range"] += both
    if "conductivity_tensor" in scene.output.products:
        stages["tensor"] = 2 * flow  # along x and along y
    return stages


def _seal_patch(
    scene: Scene, surface: GridField, samples: float, channels: float
) -> tuple[float, float]:
    """CPU time [s] of one patch of a seal under all its loads, and memory [bytes] of its flows."""
    seal, map_ = present(scene.seal, "[seal]"), scene.measured_map
    loads = loads_of(scene, surface)
    seconds = NEXT_CONTACT * contact_seconds(samples) + EACH_LOAD
    if map_ is not None and map_.make_periodic == "mirror":
        # The flow of a mirrored map is that of a quarter of it.
        samples, channels = samples / 4, channels / 4 ** (OF_WAVES / 2)
    # The more loads, the looser are most of their flows, and the nearer the meshes on which these
    # begin: they take the time of flows whose tolerance falls as the cube root of seal.rtol.
    rtol = USUAL_RTOL * (seal.rtol / USUAL_RTOL) ** (1 / 3)
    seconds += OF_LOAD * flow_seconds(samples, channels, rtol / 2)
    unknowns = unknowns_of(channels, seal.rtol / 2)
    kept = min(loads, KEPT / samples) * (KEPT_OF_UNKNOWN * unknowns + KEPT_OF_SAMPLE * samples)
    return loads * seconds, BYTES_OF_UNKNOWN * unknowns + kept


def _grid(scene: Scene, field: GridField | None) -> tuple[tuple[int, int], float]:
    """Samples of the scene's grid, and a measure of the number of channels in its gap.

    `field` holds heights or gaps, which a `SelfAffine` surface does without.
    """
    known = scene.surface
    if isinstance(known, SelfAffine):
        shape, side = known.shape, sqrt(prod(known.size))
        long = side / known.long_wavelength
        waves = min(side / known.short_wavelength, sqrt(prod(shape)) / 2)
    else:
        field = present(field, "heights or gaps")
        shape, long = field.shape, USUAL_WAVES
        waves = sqrt(prod(shape)) / _shortest(field)
    return shape, waves**OF_WAVES * sqrt(long / USUAL_WAVES)


def _shortest(field: GridField) -> float:
    """Shortest wavelength of heights in samples, from rms curvature over rms slope.

    At H = 0.8 that is 0.41 of the largest wave number.
    """
    slope, curvature = (
        sqrt(sum(float(np.mean(np.square(step))) for step in steps if step.size))
        for steps in ([np.diff(field.values, n, axis) for axis in (0, 1)] for n in (1, 2))
    )
    return max(2.0, 0.41 * 2 * pi * slope / curvature) if curvature else 2.0


@cache
def _pace() -> float:
    """CPU time on this machine over that of the laws."""
    least, end = inf, thread_time() + COMPILED_SECONDS
    while (start := thread_time()) < end:
        compile(STATEMENTS, "statements", "exec")
        least = min(least, thread_time() - start)
    return least / COMPILE


def _advice(scene: Scene, seconds: float, memory: float) -> str:
    """What makes a long or large run shorter, else ""."""
    if seconds < LONG_SECONDS and memory < MEMORY_SHARE * available_memory():
        return ""
    ways = [] if scene.gap is not None else ["fewer samples (surface.shape, or crop of a map)"]
    if scene.seal is not None:
        ways += ["fewer seal.patches", "a larger seal.rtol"]
    elif scene.total_error is not None:
        ways.append("a larger accuracy.total")
    elif scene.solves_flow and scene.flow.method != "finite-difference":
        ways.append("a larger flow.rtol")
    return f"to see something sooner: {', '.join(ways)}" if ways else ""


def contact_seconds(samples: float) -> float:
    """CPU time of an elastic contact: iterations, each of 2.5 pairs of FFTs."""
    iterations = 4 + 0.6 * samples**0.25
    # Arrays that leave the cache of the processor cost more.
    out_of_cache = 1 + 0.22 * max(0.0, log2(samples / 2**20))
    return 0.067e-6 * out_of_cache * iterations * samples


def flow_seconds(samples: float, channels: float, rtol: float) -> float:
    """CPU time of a flow, from its channels and the width of its bounds."""
    return 46e-6 * unknowns_of(channels, rtol) + 0.4e-6 * samples


def loads_of(scene: Scene, surface: GridField) -> float:
    """Net loads of a patch of a seal: those that its leak rate needs with a K of the usual fall."""
    seal, (profile, path, ends) = present(scene.seal, "[seal]"), leak_path_of(scene)
    decisive = profile.highest - ends.inlet
    if decisive <= 0:
        return 1.0
    sealing = SEALING * present(scene.solid, "[solid]").E_star * surface.slope_between_samples()
    # A patch that is sealed takes no load, and the others leak.
    sealing = max(sealing, LEAST_SEALING * decisive)
    left = np.geomspace(1, 1e-3, MODEL_LOADS)
    table = ConductivityTable(sealing * (1 - left), left**EXPONENT, left**EXPONENT)
    flow = seal_flow(table, profile, path, ends, cells=MODEL_CELLS)
    return min(
        1 + OF_DEMAND * intervals_needed(table, flow, (1 - OF_FLOWS) * seal.rtol), seal.max_loads
    )


def unknowns_of(channels: float, rtol: float) -> float:
    """Unknowns of the last mesh of a flow."""
    return 154 * channels * rtol**-0.43
