"""Patch: from a scene to the leak rate of one patch of rough contact, step by step on demand."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial, wraps
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fem_seal import parallel
from fem_seal.contact.settings import Load
from fem_seal.contact.state import ContactState, GapState
from fem_seal.error_budget import Uncertainty
from fem_seal.errors import Inconsistent, InvalidInput, narrowed, present
from fem_seal.flow_settings import FlowSettings
from fem_seal.fluid import pressure_of
from fem_seal.gap_file import load_gap
from fem_seal.grid import GridField
from fem_seal.leak_rate import FlowState, LeakRate
from fem_seal.progress import Report, silent
from fem_seal.scene import FileSurface, ProfileSurface, Scene, SelfAffine
from fem_seal.scene.scene import require_scene
from fem_seal.scene.section import Lift
from fem_seal.scene.shape import MeshFile
from fem_seal.scene_steps import CONTACTS, FLOWS, elastic_contact, spectrum_of_profiles
from fem_seal.surface import PreparedSurface, gaussian_surface, measured_surface, self_affine

if TYPE_CHECKING:
    from fem_seal.coupling import LiftedState
    from fem_seal.film import GridFilm, MeshFilm
    from fem_seal.sensitivity import Sensitivity

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Given:
    """What a patch takes in place of what its scene says, or of what it would compute."""

    surface: GridField | None = None  #: heights [m], such as the same surface on another grid
    contact: GapState | None = None  #: dry contact of the surface, if it is known already
    #: (nx, ny), first guess of the contact pressure [Pa]; a good one saves iterations
    contact_start: np.ndarray | None = None
    load: Load | None = None  #: of the contact
    lift: Lift | None = None  #: in place of `flow.lift`
    flow_settings: FlowSettings | None = None
    #: what a finer grid changes, in place of what half of the samples tell
    grid_error: "Callable[[Patch], Uncertainty] | None" = None


class Patch:
    """The steps of a scene: surface, contact, film, sealed, leak_rate.

    With flow.lift = "resolved" the fluid lifts the solid: `contact` is the dry contact and `lifted`
    the equilibrium of contact and fluid; film and leak rate are those of the equilibrium.

    Each step is computed once, when it or a later step is first read, and imports only what it
    needs: the contact works without FEniCSx, and a sealed film is never meshed.

    Under mpirun all processes must read the same steps: the first computes surface and contact and
    gives them to the others, and the flow is solved by all.

    Parameters
    ----------
    scene
        With `accuracy.total` its contact needs the `surface` on a chosen grid: `chosen_patch` of
        `accuracy` tries some.
    report
        Called with stage and detail.
    given
        What replaces or precedes the scene's own, such as another surface.
    trust
        Whether gmsh may run a .geo file that is not the package's own, with your rights.
    comm
        The processes that read the steps together; all of this run if left out. With MPI.COMM_SELF
        each process solves a patch of its own.

    Raises
    ------
    InvalidInput
        If `scene` is not a Scene, or names a .geo file that gmsh may not run.
    """

    def __init__(
        self,
        scene: Scene,
        report: Report = silent,
        *,
        given: Given | None = None,
        trust: bool = False,
        comm: parallel.Comm = None,
    ):
        require_scene(scene)
        require_trusted(scene, trust)
        parallel.start_petsc(comm)
        self.scene, self.report, self.trust, self.comm = scene, report, trust, comm
        self.seconds: dict[str, float] = {}
        self.given = given or Given()
        self._values: dict[Callable[[Patch], Any], Any] = {}  # of functions `once`

    def __repr__(self) -> str:
        """The scene, and the steps that have been computed."""
        steps = ("surface", "contact", "lifted", "film", "leak_rate")
        computed = ", ".join(name for name in steps if name in vars(self)) or "nothing"
        return f"<Patch with {computed} computed, of {self.scene}>"

    @cached_property
    def load(self) -> Load:
        """Load of the contact."""
        return self.given.load or self.scene.load

    @property
    def lift(self) -> Lift:
        """How the pressure of the fluid counts for the contact, as `flow.lift` says."""
        return self.given.lift or self.scene.lift

    @cached_property
    def flow_settings(self) -> FlowSettings:
        """Settings of the flow; for scenes that need it."""
        return self.given.flow_settings or self.scene.flow_settings

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Report a stage and add its duration [s] to `seconds`."""
        self.report(stage, "")
        start = perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - start

    def timed_on_root(self, stage: str, compute: Callable[[], T]) -> T:
        """Value that the first process computes for all; a stage, as of `timed`."""
        with self.timed(stage):
            return parallel.on_root(compute, self.comm)

    def keep(self, function: "Callable[[Patch], T]", value: T) -> None:
        """Give a function `once` its value for this patch, before it is computed."""
        if function in self._values:
            raise Inconsistent(f"{function.__name__} of this patch is computed already")
        self._values[function] = value

    def solve_contact(self) -> None:
        """Solve the dry contact on all processes."""
        _ = self.contact  # it is kept

    def solve_film(self) -> None:
        """Solve contact and film on all processes; what follows may run on the first one alone."""
        self.solve_contact()
        _ = self.film  # it is kept

    @property
    def state(self) -> FlowState:
        """Whether fluid flows through the patch."""
        return "lifted off" if self.lifted_off else "sealed" if self.sealed else "leaking"

    @cached_property
    def surface(self) -> GridField | None:
        """Heights [m] of the rough face; None if the scene gives a gap instead."""
        section, given = self.scene.surface, self.given.surface
        if given is not None or section is None:
            return given
        return SURFACES[section.kind](self, section)

    @property
    def _pressed(self) -> GridField:
        """The surface on the grid of the contact."""
        if self.scene.total_error is not None and self.given.surface is None:
            raise InvalidInput(
                "a scene with accuracy.total has no contact grid yet: fem_seal.solve(scene) tries "
                "some and makes the Patch of the chosen one"
            )
        return present(self.surface, "surface")

    @cached_property
    def prepared(self) -> PreparedSurface | None:
        """Heights from a file and the steps that prepared them; None if not from a file."""
        map_, seal = self.scene.measured_map, self.scene.seal
        if map_ is None:
            return None
        preparation = map_.preparation
        if seal is not None and seal.window is not None:
            preparation = replace(preparation, crop=map_.window((0, 0), seal.window))
        read = partial(measured_surface, map_.path, map_.stated, preparation)
        return self.timed_on_root("surface", read)

    def with_(self, given: Given) -> "Patch":
        """Patch of the same scene that is given something else.

        Surface, load, lift and settings of the flow stay where `given` has None; what has been
        solved does not, nor does a first guess.
        """
        own = self.given
        kept = replace(own, surface=self.surface, contact=None, contact_start=None, grid_error=None)
        named = {name: value for name, value in vars(given).items() if value is not None}
        given = replace(kept, **named)
        return Patch(self.scene, self.report, given=given, trust=self.trust, comm=self.comm)

    def pressed_by(self, pressure: float, lift: Lift = "none") -> "Patch":
        """Same surface and settings under another mean pressure [Pa]; dry if not said otherwise."""
        start = self.elastic_state.pressure.values
        return self.with_(Given(contact_start=start, load=Load("pressure", pressure), lift=lift))

    @cached_property
    def contact(self) -> GapState | None:
        """Gap, pressure and residual of the dry contact; None if the scene gives a gap instead."""
        given, section = self.given, self.scene.contact
        if given.contact is not None or section is None:
            return given.contact
        press = CONTACTS[section.model]
        arguments = self.scene, self._pressed, given.contact_start, self.load, self.report
        return self.timed_on_root("contact", partial(press, *arguments))

    @property
    def elastic_state(self) -> ContactState:
        """State of an elastic contact; InvalidInput for scenes without one."""
        return _elastic(self.contact)

    @cached_property
    def lifted(self) -> "LiftedState | None":
        """Contact and flow in one equilibrium; None unless the scene resolves the lift."""
        if self.lift != "resolved":
            return None
        from fem_seal.coupling import lifted_state
        from fem_seal.lifting import lifting_problem

        problem = lifting_problem(
            self.scene, self.load, self.flow_settings, self._pressed, self.report, self.comm
        )
        # One start is the contact with the outlet's pressure everywhere: the dry contact if that
        # pressure is the ambient one.
        dry = self.elastic_state if problem.load is None or problem.outlet == 0 else None
        with self.timed("lift"):
            return lifted_state(problem, dry=dry)

    @cached_property
    def sensitivity(self) -> "Sensitivity | None":
        """Derivatives of ln Q; None where nothing leaks, or the lift has not settled or floats."""
        lifted = self.lifted
        if self.state != "leaking":
            return None
        if lifted is not None and (lifted.floats or not lifted.converged):
            return None
        from fem_seal.sensitivity import sensitivity

        elastic = _elastic(self.film_contact)
        arguments = self.scene, self.load, self._pressed, elastic, lifted
        return self.timed_on_root("sensitivity", partial(sensitivity, *arguments))

    @property
    def lifted_off(self) -> bool:
        """Whether the fluid presses harder than the load, so that nothing limits the leak rate."""
        return self.lifted is not None and self.lifted.state == "lifted off"

    @cached_property
    def film_contact(self) -> GapState | None:
        """Contact whose gap is the film: lifted if the lift is resolved, otherwise dry.

        If the fluid lifts the solid off: the contact without load.
        """
        if self.lifted is None:
            return self.contact
        if not self.lifted_off:
            return self.lifted.contact
        # No gap is that of the film then: area and mean gap of the result are those of first touch.
        arguments = self.scene, self._pressed, None, Load("pressure", 0.0)
        return parallel.on_root(lambda: elastic_contact(*arguments), self.comm)

    @property
    def carried_load(self) -> float | None:
        """Load per area carried by solid and fluid [Pa]; None without an elastic contact."""
        contact = self.film_contact
        if not isinstance(contact, ContactState):
            return None
        if self.lifted is None:
            return contact.mean_pressure
        if self.load.kind == "pressure":
            return self.load.value
        return contact.mean_pressure + self.lifted.fluid_load

    @cached_property
    def film(self) -> "GridFilm | MeshFilm":
        """Domain of the fluid: the gap with its sides, on its grid or on the mesh of a shape."""
        shape = self.scene.shape
        if shape is None:
            return self.film_of(self.grid_gap)
        from fem_seal.shaped import shaped_film

        grid = None if shape.own_gap else self.grid_gap
        return self.timed_on_root("shape", partial(shaped_film, shape, grid, trust=self.trust))

    def film_of(self, gap: GridField) -> "GridFilm | MeshFilm":
        """The film of another gap [m] on the same grid, such as that of another load."""
        shape = self.scene.shape
        if shape is None:
            return self.scene.flow.film_of(gap)
        from fem_seal.film import MeshFilm
        from fem_seal.shaped import gap_source

        mesh = narrowed(self.film, MeshFilm, "mesh").mesh
        return MeshFilm(mesh, gap_source(shape, gap)(mesh.xy))

    @cached_property
    def grid_gap(self) -> GridField:
        """Gap [m] on its grid; not for scenes whose shape gives the gap itself."""
        contact = self.film_contact
        if contact is not None:
            return contact.gap
        source = self.scene.gap
        if source is None:
            raise InvalidInput("[shape] gives the gap itself, which has no grid")
        read = partial(load_gap, source.path, source.stated, source.contact_below)
        return self.timed_on_root("gap", read)

    @cached_property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet."""
        film = self.film
        with self.timed("topology"):
            return film.sealed

    @cached_property
    def leak_rate(self) -> LeakRate:
        """Volume per second through the gap, with bounds if the method has them.

        The volume of a gas is stated at the reference conditions of the fluid.
        """
        method = self.flow_settings.method
        if self.lifted_off:
            return LeakRate.lifted_off(method)
        if self.lifted is not None:
            leak = present(self.lifted.leak_rate, "leak rate")
            reason = "; ".join(filter(None, (leak.reason, self.lifted.reason)))
            leak = replace(leak, reason=reason)
        elif self.sealed:
            return LeakRate.sealed(method)
        else:
            with self.timed("flow"):
                leak = FLOWS[method](self.flow_settings, self.film, self.report, self.comm)
        if leak.field is None:
            return leak
        # A gas is solved in a potential, in which the flow is linear; pictures show its pressure.
        critical = present(self.film.constriction, "constriction").gap
        pressure = pressure_of(leak.field.pressure, self.scene.drive, self.scene.slip, critical)
        return replace(leak, field=replace(leak.field, pressure=pressure))


def _elastic(contact: GapState | None) -> ContactState:
    """The contact; InvalidInput if it is not elastic."""
    if not isinstance(contact, ContactState):
        raise InvalidInput("an elastic contact is needed: contact.model = 'gfmd'")
    return contact


def once(function: Callable[[Patch], T]) -> Callable[[Patch], T]:
    """Let a function of a patch be computed once for each, which keeps the value."""

    @wraps(function)
    def kept(patch: Patch) -> T:
        if kept not in patch._values:
            patch._values[kept] = function(patch)
        value: T = patch._values[kept]
        return value

    return kept


def _self_affine(patch: Patch, section: SelfAffine) -> GridField:
    made = partial(
        self_affine,
        section.spectrum,
        section.shape,
        section.size,
        rms_height=section.rms_height,
        rms_slope=section.rms_slope,
        scaling=section.scaling,
        seed=section.seed,
    )
    return patch.timed_on_root("surface", made)


def _of_profiles(patch: Patch, section: ProfileSurface) -> GridField:
    def made() -> GridField:
        spectrum = spectrum_of_profiles(section)
        return gaussian_surface(spectrum, section.shape, section.size, seed=section.seed)

    return patch.timed_on_root("surface", made)


def _measured(patch: Patch, section: FileSurface) -> GridField:
    prepared, contact = present(patch.prepared, "prepared heights"), patch.scene.contact
    if contact is not None and contact.is_elastic:
        prepared.require_cell(f"heights in {section.path}")
    return prepared.field


SURFACES: dict[str, Callable[[Patch, Any], GridField]] = {
    "self-affine": _self_affine,
    "profiles": _of_profiles,
    "file": _measured,
}


def require_trusted(scene: Scene, trust: bool) -> None:
    """Raise InvalidInput if a scene names a .geo file that gmsh may not run without trust."""
    if isinstance(scene.shape, MeshFile) and scene.shape.needs_gmsh:
        from fem_seal.mesh.geometry import require_trust

        require_trust(scene.shape.path, trust)
