"""A rough surface against an elastic solid: units, and states at one pressure or mean gap."""

import numpy as np

from fem_seal.contact.halfspace import HalfSpace
from fem_seal.contact.methods import ContactStopping, converge
from fem_seal.contact.problem import Problem
from fem_seal.contact.settings import USUAL_ARITHMETIC, Arithmetic, ElasticSolid
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput, present
from fem_seal.grid import GridField, require_grid_field

LEAST_SPAN = 1e-100  # [m]; below it, or above its inverse, squares of heights leave float64


class ContactPair:
    """A counter-face [m] and a solid, ready to be loaded again and again."""

    def __init__(
        self, height: GridField, solid: ElasticSolid, arithmetic: Arithmetic = USUAL_ARITHMETIC
    ):
        require_grid_field(height, "surface")
        if not height.periodic:
            raise InvalidInput(
                "elastic contact needs a periodic surface (the FFT repeats it); mark it periodic, "
                "or make it so (make_periodic = 'mirror', 'tukey', 'hann' or 'cut' in a scene)"
            )
        if height.values.size == 1:
            raise InvalidInput("elastic contact needs more than one sample: a single one is rigid")
        with np.errstate(over="ignore"):
            span = float(np.ptp(height.values))
        if span > 0 and not LEAST_SPAN < span < 1 / LEAST_SPAN:
            raise InvalidInput(
                f"heights of the surface differ by {span:.1e} m; allowed is {LEAST_SPAN:.0e} m to "
                f"{1 / LEAST_SPAN:.0e} m: check their unit, rms height or slope"
            )
        self.height, self.solid, self.arithmetic = height, solid, arithmetic
        length = (height.spacing[0] * height.spacing[1]) ** 0.5
        heights = height.values - height.values.mean()
        #: [m] unit of length of the normalised problem: the rms height, or a sample's spacing where
        #: the surface is flat
        self.unit_height = float(heights.std()) if span > 0 else length
        heights /= self.unit_height
        self.scaled_heights = heights  #: (nx, ny), in `unit_height`, zero mean, unit rms
        #: [Pa], unit of pressure of the normalised problem
        self.unit_pressure = solid.contact_modulus * self.unit_height / (2 * length)
        self.half_space = HalfSpace(
            height.shape, height.spacing, solid.layer, arithmetic.threads, arithmetic.precision
        )

    def complementary(self, start: np.ndarray) -> np.ndarray:
        """Pressure [Pa], set to zero where the gap that it causes is open.

        A sample counts as touching where p > k g, with k the stiffness of one sample. This is
        needed for the mean of two states: its certificate is near zero, but it presses on every
        sample that touches in either of them.
        """
        if not start.any():
            return start
        pressure = start / self.unit_pressure
        gap = self.half_space.displacement(pressure) - self.scaled_heights
        gap -= np.vdot(pressure, gap) / pressure.sum()
        return np.where(pressure > self.half_space.point_stiffness * gap, start, 0.0)

    def under_pressure(
        self, mean_pressure: float, stopping: ContactStopping, start: np.ndarray | None = None
    ) -> ContactState:
        """Contact under a mean pressure [Pa] > 0, from a uniform or another pressure [Pa]."""
        return self._converged(*self.loaded(mean_pressure, start), stopping)

    def loaded(self, mean_pressure: float, start: np.ndarray | None) -> tuple[Problem, np.ndarray]:
        """Problem under a mean pressure [Pa] > 0, and its first pressure: both without units."""
        load = mean_pressure / self.unit_pressure
        pressure = np.ones(self.height.shape)
        if start is not None and start.any():
            pressure[...] = start
        pressure *= load / pressure.mean()
        return Problem(self.scaled_heights, self.half_space, mean_pressure=load), pressure

    def at_mean_gap(
        self, mean_gap: float, stopping: ContactStopping, start: np.ndarray | None = None
    ) -> ContactState:
        """Contact at a mean gap [m] > 0, from no pressure or another pressure [Pa]."""
        held = mean_gap / self.unit_height
        if held >= self.scaled_heights.max():
            gap = np.maximum(held - self.scaled_heights, 0)
            return self._open(gap * self.unit_height)
        pressure = np.zeros(self.height.shape) if start is None else start / self.unit_pressure
        problem = Problem(self.scaled_heights, self.half_space, mean_gap=held)
        return self._converged(problem, pressure, stopping)

    def touching(self) -> ContactState:
        """First touch, without load."""
        return self._open(self.height.values.max() - self.height.values)

    def _open(self, gap: np.ndarray) -> ContactState:
        """Exact state of a surface that carries no load."""
        return ContactState.without_load(self._field(gap), self.solid.contact_modulus)

    def _converged(
        self, problem: Problem, pressure: np.ndarray, stopping: ContactStopping
    ) -> ContactState:
        """Solve, and make the state of the accepted pressure and the gap that it causes."""
        iterate, measures, residuals = converge(problem, pressure, stopping)
        pressure, gap = iterate.pressure, present(iterate.gap, "gap of an iterate")
        gap = np.maximum(gap - problem.offset(pressure, gap), 0)
        gap[pressure > 0] = 0
        return ContactState(
            gap=self._field(gap * self.unit_height),
            pressure=self._field(pressure * self.unit_pressure),
            contact_modulus=self.solid.contact_modulus,
            certificate=measures.certificate,
            pressed_gap=measures.pressed_gap,
            penetration=measures.penetration,
            iterations=iterate.iteration,
            residuals=residuals,
        )

    def _field(self, values: np.ndarray) -> GridField:
        return GridField(values, self.height.spacing, periodic=True)
