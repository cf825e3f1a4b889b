"""The coupled problem of contact and flow."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import numpy as np
from scipy.ndimage import affine_transform

from fem_seal import parallel
from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.settings import Arithmetic, ElasticSolid, Load
from fem_seal.contact.state import ContactState
from fem_seal.coupling.state import LARGEST_CHANGE, SETTLED
from fem_seal.errors import Inconsistent
from fem_seal.film import GridFilm
from fem_seal.flow_settings import FlowSettings
from fem_seal.fluid import Drive, pressure_of
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.network.film_pressure import FilmPressure, Solver
from fem_seal.network.network import STEP, Network
from fem_seal.progress import Report

# Samples of the first contact, and nodes of the first network, but every fourth sample at least:
# little compared with one contact.
FIRST_NODES = 30_000
# Relative rounding of the mean of a pressure: of a load below it nothing is left to the solid.
LOAD_ROUNDING = 1e-12


Press = Callable[[GridField, ContactState | np.ndarray | None, Load], ContactState]


@dataclass(frozen=True, eq=False, kw_only=True)
class LiftProblem:
    """Contact and flow; pressures are above ambient.

    `fem_seal.lifting.lifting_problem` makes one of a scene.
    """

    height: GridField  #: counter-face h [m]
    solid: ElasticSolid
    arithmetic: Arithmetic  #: of the contact
    prescribed: Load  #: pressure P₀ of solid and fluid, contact area or mean gap
    settings: FlowSettings  #: a limit of time ends the stages, which then have not settled
    drive: Drive
    inlet: float  #: fluid pressure at the inlet [Pa], the higher one
    outlet: float  #: fluid pressure at the outlet [Pa]
    press: Press  #: contact of heights, from a first guess, under the load that the solid carries
    film: Callable[[GridField], GridFilm]  #: film of a gap
    #: leak rate of a film, by all processes together
    leak_rate: Callable[[FlowSettings, GridFilm], LeakRate]
    solver: Solver  #: of the network's matrix
    most_nodes: int  #: of a network that the solver can solve
    report: Report  #: called with each step
    comm: parallel.Comm = None  #: the processes that solve together; all of this run if None
    began: float = field(default_factory=perf_counter)  #: when a limit of time began to count

    def __post_init__(self) -> None:
        if not self.inlet > self.outlet:
            raise Inconsistent(f"pressures of a lift: {self.inlet} Pa to {self.outlet} Pa")

    @property
    def load(self) -> float | None:
        """P₀ [Pa]; None if area or mean gap is prescribed, which the fluid does not change."""
        return self.prescribed.value if self.prescribed.kind == "pressure" else None

    @property
    def allowed(self) -> float:
        """Error of ln Q at which the search for an equilibrium ends."""
        return SETTLED * min(self.settings.rtol, LARGEST_CHANGE)

    @property
    def negligible(self) -> float:
        """`FlowSettings.negligible` as a conductance [m³], that of `FilmPressure`."""
        settings = self.settings
        return 12 * settings.viscosity * settings.negligible / settings.pressure_drop

    def flow(self, film: GridFilm, error: float) -> LeakRate:
        """Leak rate of a film; a decision against a limit counts the lift's error of ln Q."""
        margin = 0.0 if self.settings.decide is None else error
        return self.leak_rate(replace(self.settings, margin=margin), film)

    def cubes(self, gap: np.ndarray) -> np.ndarray:
        """Cubes [m³] of the gaps that conduct without slip as much as gaps (nx, ny) [m] do."""
        slip = self.settings.slip
        return gap**3 if slip is None else gap**2 * slip.per_square_gap(gap)

    def pressure_of(self, u: np.ndarray, critical: float) -> np.ndarray:
        """Fluid pressure [Pa] where the linear problem has the solution u between 0 and 1.

        Under slip it depends on the gap of the critical constriction [m].
        """
        both = np.append(u.ravel(), 0.0) * self.drive.pressure_drop
        absolute = pressure_of(both, self.drive, self.settings.slip, critical)
        return self.outlet + (absolute[:-1] - absolute[-1]).reshape(u.shape)

    @cached_property
    def half_space(self) -> HalfSpace:
        """Half-space on the grid of the contact.

        Made when it is first asked for: in `on_root` it has the threads of all processes.
        """
        shape, spacing, arithmetic = self.height.shape, self.height.spacing, self.arithmetic
        return HalfSpace(shape, spacing, self.solid.layer, arithmetic.threads, arithmetic.precision)

    @property
    def stiffness(self) -> float:
        """Pressure that the unit of `half_space.pressure` stands for, per displacement [Pa/m]."""
        dx, dy = self.height.spacing
        return self.solid.contact_modulus / (2 * (dx * dy) ** 0.5)

    @cached_property
    def roughness(self) -> float:
        """Length [m] to which gaps are compared: the rms height.

        Of a flat counter-face it is the rms displacement under the pressure in a uniform film.
        """
        of_heights = float(self.height.values.std())
        return of_heights or float(self.displacement(self.uniform_pressure).std())

    @cached_property
    def uniform_pressure(self) -> np.ndarray:
        """Fluid pressure (nx, ny) [Pa] in a uniform film: its mean is the load that it carries."""
        (nx, ny), sites = self.height.shape, self.touching_film.sites
        u = 1 - (np.arange(nx) + sites.origin[0] / sites.spacing[0]) / nx
        # A flat face has no gap by which to judge the slip: the distance of its samples does.
        gap = float(np.ptp(self.height.values)) or min(self.height.spacing)
        pressure = self.pressure_of(u, gap)
        return np.repeat(pressure[:, None], ny, axis=1)

    def contact_under(
        self, pressure: np.ndarray, start: ContactState | np.ndarray | None = None
    ) -> ContactState:
        """Contact with a fluid pressure [Pa]: a dry one with heights h - S p_f."""
        carried = self.solid_load(pressure)
        load = self.prescribed if self.load is None else Load("pressure", carried)
        lowered = self.height.values - self.displacement(pressure)
        return self.press(self.field(lowered), start, load)

    def displacement(self, pressure: np.ndarray) -> np.ndarray:
        """Displacement [m] under a pressure (nx, ny) [Pa], of zero mean."""
        return self.half_space.displacement(pressure / self.stiffness).copy()

    def film_pressure(self, gap: np.ndarray, network: Network, epsilon: float) -> FilmPressure:
        """Pressure u between 1 and 0 in a film that conducts as g³ + ε³, with ε [m] everywhere."""
        conducting = np.cbrt(self.cubes(gap) + epsilon**3)
        slope = (self.cubes(gap * (1 + STEP)) - self.cubes(gap * (1 - STEP))) / (2 * STEP)
        slope = np.divide(slope, 3 * conducting**2 * gap, out=np.zeros_like(gap), where=gap > 0)
        return FilmPressure(network, conducting, slope, self.solver)

    def pressure_by(self, u: np.ndarray, critical: float) -> np.ndarray:
        """Derivative [Pa] of `pressure_of` by u."""
        ends = np.clip(u - STEP, 0.0, 1.0), np.clip(u + STEP, 0.0, 1.0)
        low, high = (self.pressure_of(end, critical) for end in ends)
        slope: np.ndarray = (high - low) / (ends[1] - ends[0])
        return slope

    def pressure_by_critical(self, u: np.ndarray, critical: float) -> np.ndarray:
        """Derivative [Pa/m] of `pressure_of` by the gap of the critical constriction."""
        wider, narrower = (self.pressure_of(u, critical * (1 + end)) for end in (STEP, -STEP))
        return (wider - narrower) / (2 * STEP * critical)

    @cached_property
    def _halvings(self) -> int:
        """How often every second sample along each side may be left out until few are left."""
        times, (nx, ny) = 0, self.height.shape
        while nx * ny > FIRST_NODES and nx % 2 == ny % 2 == 0:
            times, nx, ny = times + 1, nx // 2, ny // 2
        return times

    @property
    def doublings(self) -> int:
        """How often the triangles of the first network are doubled, from one sample on."""
        return min(self._halvings, 2)

    @cached_property
    def first_network(self) -> Network:
        """The coarsest network of the flow."""
        return Network.uniform(self.touching_film, 2**self.doublings)

    @cached_property
    def chain(self) -> "list[LiftProblem]":
        """Problems with every 2^k-th sample along each side, the fewest first, and this one.

        This one alone where the solid may float, whose separation takes all samples.
        """
        (dx, dy), chain = self.height.spacing, [self]
        halvings = 0 if self.may_float else self._halvings
        for k in range(1, 1 + halvings):
            every = self.height.values[:: 2**k, :: 2**k]
            height = GridField(every, (2**k * dx, 2**k * dy), self.height.periodic)
            chain.insert(0, replace(self, height=height))
        return chain

    def stride_of(self, values: np.ndarray) -> int:
        """Samples along a side for one of the values of a thinned problem."""
        return self.height.shape[0] // len(values)

    def interpolated(self, values: np.ndarray) -> np.ndarray:
        """Values of a thinned problem, interpolated linearly between its samples.

        Those after its last row repeat it: the fluid keeps its pressure up to narrow places, and a
        line to the outlet's pressure would be farther off.
        """
        step, shape = np.diag([1 / self.stride_of(values)] * 2), self.height.shape
        periodic = self.touching_film.sides == "periodic"
        last = values[:, :1] if periodic else values[:, -1:]
        between: np.ndarray = affine_transform(
            np.hstack([values, last]), step, output_shape=shape, order=1, mode="nearest"
        )
        return between

    @cached_property
    def touching_film(self) -> GridFilm:
        """Film of the gap of first touch."""
        return self.film(self.field(self.height.values.max() - self.height.values))

    def solid_load(self, pressure: np.ndarray) -> float:
        """Part of the load that a fluid pressure leaves to the solid [Pa]; infinite without one."""
        if self.load is None:
            return np.inf
        left = self.load - float(pressure.mean())
        return left if abs(left) > LOAD_ROUNDING * self.load else 0.0

    @property
    def may_float(self) -> bool:
        """Whether the fluid may carry the whole load."""
        return self.load is not None and self.load <= self.inlet

    @property
    def largest_start(self) -> float:
        """Uniform fluid pressure [Pa] of the second start: the inlet's, or less than the load."""
        return 0.95 * self.load if self.load is not None and self.may_float else self.inlet

    @cached_property
    def never_opens(self) -> bool:
        """Whether no pressure of the fluid opens the film, by the theorem on the order of gaps.

        On a half-space under a load a higher p_f nowhere makes the gap smaller: a film that is
        sealed with the inlet's pressure everywhere is sealed under any other. On a grid this is
        tested on rough surfaces, not proved. It does not hold for a layer, nor where an area or a
        mean gap is prescribed.
        """
        if self.load is None or self.may_float or self.half_space.layer is not None:
            return False
        everywhere = np.full(self.height.shape, self.inlet)
        return self.film(self.contact_under(everywhere).gap).sealed

    def highest_pressure(self, contact: ContactState) -> np.ndarray:
        """The inlet's pressure [Pa] wherever no open path of a contact leads to the outlet.

        A film that stays sealed under it is sealed, on a half-space, under every p_f that leaves
        drained what this contact drains. In another equilibrium a region that is drained here may
        hold fluid.
        """
        nx, ny = self.height.shape
        joined = self.film(contact.gap).joined_to_outlet[:nx, :ny]
        return np.where(joined, self.outlet, self.inlet)

    def field(self, values: np.ndarray) -> GridField:
        """Values (nx, ny) on the contact's grid."""
        return GridField(values, self.height.spacing, self.height.periodic)
