"""The letter's surfaces and its two models of contact."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField

if TYPE_CHECKING:
    from fem_seal.contact.state import ContactState, GapState

# All results are ratios, in which these values cancel.
PITCH = 1e-6  # distance of samples [m]
SLOPE = 0.1  # rms slope
CONTACT_MODULUS = 10e6  # [Pa]
VISCOSITY = 1e-3  # [Pa s]
PRESSURE_DROP = 1e5  # [Pa]

# The certificate bounds the error of the energy, not of the contact set. With smaller tolerances
# the contact set was seen to change by a few samples at most.
CONTACT_TOLERANCE = 1e-6

# Largest ratio of two areas for which the second contact starts from the first. The areas of Fig. 3
# on 512² then take 543 pairs of transforms, without such starts 632; starts from all areas take
# more.
NEAR = 1.2


@dataclass(frozen=True)
class RoughCase:
    """An ensemble of self-affine surfaces on n x n samples.

    Parameters
    ----------
    n : int
        Samples along a side.
    hurst : float
        Hurst exponent.
    short : float
        Short cut-off λ_s in samples; 1 in the letter.
    long : float
        Long cut-off λ_l in fractions of the side; 1/8 in the letter.
    """

    n: int
    hurst: float = 0.8
    short: float = 1.0
    long: float = 0.125

    def __post_init__(self) -> None:
        if not self.n >= 8:
            raise InvalidInput(f"the side must have at least 8 samples, got {self.n}")
        if not 1 <= self.short < self.long * self.n <= self.n:
            raise InvalidInput(
                "cut-offs must satisfy 1 sample <= short < long <= side, got "
                f"{self.short} and {self.long * self.n} of {self.n} samples"
            )

    @property
    def name(self) -> str:
        """Name for files and tables."""
        return f"n{self.n}-H{self.hurst:g}-short{self.short:g}-long{self.long * self.n:g}"

    def surface(self, seed: int) -> GridField:
        """Heights [m] of one member, with the rms slope SLOPE to rounding."""
        from fem_seal.surface import Spectrum, self_affine

        side = self.n * PITCH
        spectrum = Spectrum(self.hurst, self.long * side, self.short * PITCH)
        shape, size = (self.n, self.n), (side, side)
        return self_affine(spectrum, shape, size, rms_slope=SLOPE, seed=seed)


@dataclass(frozen=True)
class Model:
    """A model of contact; the contact area grows with the load.

    Attributes
    ----------
    press : Callable[[GridField, float, 'array or None', int], 'GapState']
        Function (surface, load, initial pressure or None, threads) -> state.
    low, high : float
        First guess of a bracket of the load at which contact percolates.
    limit : float
        Largest load.
    """

    press: Callable[[GridField, float, "np.ndarray | None", int], "GapState"]
    low: float
    high: float
    limit: float


def _press_bearing(
    surface: GridField, load: float, start: np.ndarray | None, threads: int
) -> "GapState":
    """Cut the surface; the load is the contact area fraction."""
    from fem_seal.contact import bearing

    return bearing(surface, area_fraction=load)


def _press_elastic(
    surface: GridField, load: float, start: np.ndarray | None, threads: int
) -> "GapState":
    """Elastic contact; the load is the mean pressure in units of E* h'rms."""
    from fem_seal.contact import solve

    pressure = load * CONTACT_MODULUS * SLOPE
    return solve(
        surface,
        CONTACT_MODULUS,
        pressure=pressure,
        tolerance=CONTACT_TOLERANCE,
        start=start,
        threads=threads,
    )


# At elastic loads of 0.1 and 0.35, A/A0 is about 0.23 and 0.62.
MODELS = {
    "bearing": Model(_press_bearing, 0.3, 0.7, 0.99),
    "elastic": Model(_press_elastic, 0.1, 0.35, 10.0),
}


def at_area(
    surface: GridField,
    model: str,
    area_fraction: float,
    threads: int = 1,
    start: np.ndarray | None = None,
) -> "GapState":
    """Contact of a model at a contact area fraction; 0 is first contact.

    Parameters
    ----------
    surface : GridField
        Heights [m].
    model : str
        "bearing" or "elastic".
    area_fraction : float
        A/A0.
    threads : int
        Threads of an elastic contact.
    start : (n, n) float, optional
        Pressure to start an elastic contact from [Pa].

    Raises
    ------
    InvalidInput
        For an unknown model or an area outside [0, 1).
    NotConverged
        If the contact does not converge.
    """
    from fem_seal.contact import bearing
    from fem_seal.registry import choose

    if choose(MODELS, model, "model") is MODELS["bearing"]:
        return bearing(surface, area_fraction=area_fraction)
    return elastic_at_area(surface, area_fraction, threads, start)


class PressedSurface:
    """A surface under one model, pressed to one area after the other.

    An elastic contact starts from the extrapolation of the last two if its area is near the last
    one. It reaches its area within the same tolerance from any start.

    Parameters
    ----------
    case : RoughCase
        Ensemble of surfaces.
    model : str
        "bearing" or "elastic".
    seed : int
        Seed of the surface.
    threads : int
        Threads of an elastic contact.
    """

    def __init__(self, case: RoughCase, model: str, seed: int, threads: int = 1):
        from fem_seal.contact.load_path import Predictor

        self.case, self.model, self.seed, self.threads = case, model, seed, threads
        self._predictor, self._last = Predictor(), 0.0

    @cached_property
    def surface(self) -> GridField:
        """Heights [m]."""
        return self.case.surface(self.seed)

    def at_area(self, area_fraction: float) -> "GapState":
        """Press to a contact area fraction; as the function `at_area`."""
        from fem_seal.contact.settings import Load
        from fem_seal.contact.state import ContactState

        load = Load("area_fraction", area_fraction)
        near = self._last < area_fraction <= NEAR * self._last
        start = self._predictor.start(load) if near else None
        state = at_area(self.surface, self.model, area_fraction, self.threads, start)
        if isinstance(state, ContactState) and area_fraction > 0:
            self._predictor.remember(load, state)
            self._last = area_fraction
        return state


def elastic_at_area(
    surface: GridField, area_fraction: float, threads: int = 1, start: np.ndarray | None = None
) -> "ContactState":
    """Elastic contact at a contact area fraction; see `at_area`."""
    from fem_seal.contact import solve

    return solve(
        surface,
        CONTACT_MODULUS,
        area_fraction=area_fraction,
        tolerance=CONTACT_TOLERANCE,
        start=start,
        threads=threads,
    )
