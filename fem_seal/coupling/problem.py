"""The coupled problem of contact and flow: the steps of one pass, each as a function."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_seal import parallel
from fem_seal.contact.state import ContactState
from fem_seal.coupling.fluid_pressure import pressure_on_samples
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate


@dataclass(frozen=True, eq=False)
class LiftProblem:
    """The steps of one pass, each as a function.

    Attributes
    ----------
    height : GridField
        Counter-face h [m].
    displacement : callable
        (nx, ny) pressure [Pa] -> displacement S p [m], up to a constant.
    press : callable
        (heights, load left to the solid [Pa] or None, start, tolerance) -> ContactState. The load
        is None where an area or a mean gap is prescribed, which the fluid does not change. The
        contact is solved to the larger of this tolerance and that of the result.
    film : callable
        gap -> GridFilm
    flow : callable
        (film, tolerance, whether to begin with a new mesh) -> LeakRate with its field. Otherwise it
        begins with the mesh of the last film. Tolerance None: that of the result.
    flow_on_kept_mesh : callable or None
        film -> LeakRate with its field: one solve for the pressure on the mesh of the last flow.
        None for a method without a mesh, whose flow is the same at every tolerance.
    fluid_pressure : callable
        (film, leak rate) -> pressure above ambient [Pa] on the film's samples, NaN where the flow
        has none (contact, pockets).
    inlet, outlet : float
        Fluid pressures above ambient [Pa], the higher one at the inlet.
    load : float or None
        P₀ [Pa], which solid and fluid carry together; None if area or mean gap is prescribed.
    comm : MPI.Comm or None
        The processes that solve together; all of this run if None.
    """

    height: GridField
    displacement: Callable[[np.ndarray], np.ndarray]
    press: Callable[
        [GridField, float | None, ContactState | np.ndarray | None, float], ContactState
    ]
    film: Callable[[GridField], GridFilm]
    flow: Callable[[GridFilm, float | None, bool], LeakRate]
    flow_on_kept_mesh: Callable[[GridFilm], LeakRate] | None
    fluid_pressure: Callable[[GridFilm, LeakRate], np.ndarray]
    inlet: float
    outlet: float
    load: float | None
    comm: parallel.Comm = None

    def contact_under(
        self,
        pressure: np.ndarray,
        start: ContactState | np.ndarray | None = None,
        tolerance: float = 0.0,
    ) -> ContactState:
        """Contact with a fluid pressure [Pa]: a dry one with heights h - S p_f."""
        height = self.height
        load = None if self.load is None else left_of(self.load, pressure)
        lowered = height.values - self.displacement(pressure)
        heights = GridField(lowered, height.spacing, height.periodic)
        return self.press(heights, load, start, tolerance)

    def pressure_of_flow(self, film: GridFilm, leak: LeakRate) -> np.ndarray:
        """p_f (nx, ny) of the flow through a film [Pa]."""

        def read() -> np.ndarray:
            flowing = None if leak.state == "sealed" else self.fluid_pressure(film, leak)
            return pressure_on_samples(film, self.inlet, self.outlet, flowing)

        return parallel.on_root(read, self.comm)

    def carriable(self, pressure: np.ndarray, target: np.ndarray, least_part: float) -> np.ndarray:
        """Target fluid pressure, or one on the way to it that leaves a load to the solid.

        Parameters
        ----------
        pressure, target : (nx, ny) float
            p_f now, and next [Pa].
        least_part : float
            Least part of the solid's present load that remains.

        Returns
        -------
        (nx, ny) float [Pa]
        """
        if self.load is None:
            return target
        before, after = left_of(self.load, pressure), left_of(self.load, target)
        least = least_part * before
        if after >= least:
            return target
        return pressure + (before - least) / (before - after) * (target - pressure)

    def field(self, pressure: np.ndarray) -> GridField:
        """A pressure (nx, ny) on the contact's grid."""
        return GridField(pressure, self.height.spacing, self.height.periodic)


def left_of(load: float, pressure: np.ndarray) -> float:
    """Part of a load that a fluid pressure leaves to the solid [Pa]."""
    return load - float(pressure.mean())
