"""Seal: from a scene to its leak rate, each step computed when it is first asked for."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from fem_seal import parallel
from fem_seal.errors import InvalidInput
from fem_seal.gap_file import load_gap
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.progress import Report, silent
from fem_seal.scene import FileSurface, Scene
from fem_seal.scene.shape import MeshFile
from fem_seal.steps import CONTACTS, FLOWS, made_surface, prepared_surface

if TYPE_CHECKING:
    from fem_seal.accuracy import Choice
    from fem_seal.contact.state import GapState
    from fem_seal.film import GridFilm, MeshFilm
    from fem_seal.surface import PreparedSurface


class Seal:
    """The steps of a scene: surface, contact, film, sealed, leak_rate.

    Each is computed once, when it or a later step is first read, and imports only what it needs:
    the contact works without FEniCSx, and a sealed gap is never meshed.

    Under mpirun all processes must read the same steps: the first computes surface and contact
    and gives them to the others, and the flow is solved by all.

    Parameters
    ----------
    scene : what is to be computed
    report : called with the stage and its latest news
    trust : whether gmsh may run a .geo file that is not the package's own

    Raises
    ------
    InvalidInput
        If the scene names such a file without `trust`, or is no Scene.
    """

    contact_start: np.ndarray | None = None  # a pressure [Pa] near the contact's saves iterations

    def __init__(self, scene: Scene, report: Report = silent, *, trust: bool = False):
        if not isinstance(scene, Scene):
            raise InvalidInput(
                f"a Seal is made of a Scene, not of a {type(scene).__name__}; "
                "Scene.from_file(path) reads one"
            )
        if isinstance(scene.shape, MeshFile) and scene.shape.needs_gmsh:
            from fem_seal.mesh.geometry import require_trust

            require_trust(scene.shape.path, trust)
        self.scene = scene
        self.report = report
        self.trust = trust
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Report a stage and add its duration [s] to `seconds`."""
        self.report(stage, "")
        start = perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - start

    @cached_property
    def surface(self) -> GridField | None:
        """Heights [m] of the rough face; None if the scene gives a gap instead."""
        if self.choice is not None:
            return self.choice.surface
        return self.given_surface()

    @cached_property
    def prepared(self) -> "PreparedSurface | None":
        """Heights of a file and the steps that prepared them; None for any other surface."""
        surface = self.scene.surface
        if not isinstance(surface, FileSurface):
            return None
        with self.timed("surface"):
            return parallel.on_root(lambda: prepared_surface(surface))

    @cached_property
    def choice(self) -> "Choice | None":
        """Contact grid and flow tolerance that keep accuracy.total; None if the scene has none."""
        wanted = self.scene.accuracy
        if wanted is None:
            return None
        from fem_seal.accuracy import choose

        with self.timed("accuracy"):
            return choose(
                wanted.total,
                self.given_surface(),
                self._on_grid,
                max_refinement=wanted.max_refinement,
                report=self.report,
            )

    def given_surface(self) -> GridField | None:
        """Heights [m] as the scene gives them, whatever contact grid is chosen."""
        if self.prepared is not None:
            contact = self.scene.contact
            if contact is not None and contact.model == "gfmd":
                self.prepared.require_cell(f"heights in {self.scene.surface.path}")
            return self.prepared.field
        surface = self.scene.surface
        if surface is None:
            return None
        with self.timed("surface"):
            return parallel.on_root(lambda: made_surface(surface))

    def _on_grid(
        self, surface: GridField, rtol: float, contact: "GapState | None" = None
    ) -> "Seal":
        """Same scene on another grid of the surface, with a tolerance of the flow alone."""
        seal = Seal(self.scene.with_tolerance(rtol), self.report, trust=self.trust)
        seal.surface = surface
        if contact is not None:
            seal.contact = contact
        return seal

    def pressed_by(self, pressure: float) -> "Seal":
        """Same surface, contact grid and tolerance of the flow under another mean pressure [Pa]."""
        rtol = self.scene.flow.rtol if self.choice is None else self.choice.rtol
        contact = self.scene.contact.model_copy(update={"pressure": pressure})
        scene = self.scene.with_tolerance(rtol).model_copy(update={"contact": contact})
        other = Seal(scene, self.report, trust=self.trust)
        other.surface = self.surface
        other.contact_start = self.contact.pressure.values
        return other

    @cached_property
    def contact(self) -> "GapState | None":
        """Gap, pressure and residual of the contact; None if the scene gives a gap instead."""
        if self.choice is not None:
            return self.choice.contact
        if self.surface is None:
            return None
        press = CONTACTS[self.scene.contact.model]
        with self.timed("contact"):
            return parallel.on_root(
                lambda: press(self.scene, self.surface, self.contact_start, self.report)
            )

    @cached_property
    def film(self) -> "GridFilm | MeshFilm":
        """The domain of the fluid: the gap with its sides, on its grid or on the mesh of a shape."""
        from fem_seal.film import GridFilm

        shape, flow = self.scene.shape, self.scene.flow
        if shape is None:
            gap = self.grid_gap
            return GridFilm(gap, flow.sides, flow.representation)
        from fem_seal.film.shaped import shaped_film

        grid = None if shape.own_gap else self.grid_gap
        with self.timed("shape"):
            return parallel.on_root(lambda: shaped_film(shape, grid, trust=self.trust))

    def film_of(self, gap: GridField) -> "GridFilm | MeshFilm":
        """The film of another gap [m] on the same grid, such as that of another load."""
        from fem_seal.film import GridFilm, MeshFilm

        shape, flow = self.scene.shape, self.scene.flow
        if shape is None:
            return GridFilm(gap, flow.sides, flow.representation)
        from fem_seal.film.shaped import gap_source

        mesh = self.film.mesh
        return MeshFilm(mesh, gap_source(shape, gap)(mesh.xy))

    @cached_property
    def grid_gap(self) -> GridField:
        """Gap [m] on its grid; not for scenes whose shape gives the gap itself."""
        if self.contact is not None:
            return self.contact.gap
        given = self.scene.gap
        with self.timed("gap"):
            return parallel.on_root(lambda: load_gap(given.path, given.stated, given.contact_below))

    @cached_property
    def sealed(self) -> bool:
        """Whether no open path joins inlet and outlet."""
        film = self.film
        with self.timed("topology"):
            return film.sealed

    @cached_property
    def leak_rate(self) -> LeakRate:
        """Volume per second through the gap, with bounds where the method has them.

        That of a gas is counted at the reference conditions of the fluid.
        """
        if self.choice is not None:
            return self.choice.leak_rate
        method = self.scene.flow.method
        if self.sealed:
            return LeakRate.sealed(method)
        with self.timed("flow"):
            leak = FLOWS[method](self.scene, self.film, self.report)
        if leak.field is None:
            return leak
        pressure = self.scene.drive.pressure(leak.field.pressure)
        return replace(leak, field=replace(leak.field, pressure=pressure))

    def leak_rate_of(self, film: "GridFilm | MeshFilm") -> LeakRate:
        """Leak rate of another film under the scene's pressures, to the scene's tolerance."""
        scene = self.scene.model_copy(update={"limit": None})
        return FLOWS[scene.flow.method](scene, film, self.report)
