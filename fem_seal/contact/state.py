"""Result of a contact calculation: the gap and, for an elastic contact, how exact it is."""

from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from fem_seal.arguments import require_positive
from fem_seal.errors import Inconsistent
from fem_seal.grid import GridField

# V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribol. Int. 114, 161 (2017), arXiv:1701.02727.
PERIMETER_FACTOR = (np.pi - 1 + np.log(2)) / 24


@dataclass(frozen=True, eq=False)
class GapState:
    """A gap and the contact in it."""

    gap: GridField  #: [m] >= 0, periodic if elastic; **contact is where it is exactly 0**

    def __post_init__(self) -> None:
        if self.gap.values.min() < 0:
            raise Inconsistent(f"the gap of a contact is negative: {self.gap.values.min():g} m")

    @cached_property
    def contact(self) -> np.ndarray:
        """(nx, ny) bool: where the gap is exactly zero."""
        return self.gap.values == 0

    @cached_property
    def contact_area_fraction(self) -> float:
        """Share of the samples that touch, A/A0 (raw)."""
        return float(np.count_nonzero(self.contact) / self.contact.size)

    @cached_property
    def contact_area_corrected(self) -> float:
        """A/A0 less the area that pixels add along the contact's edge: A - (π - 1 + ln 2)/24 S dx.

        S is the perimeter, counted along the edges of the pixels (Yastrebov, Anciaux, Molinari,
        Tribol. Int. 114, 161 (2017), arXiv:1701.02727).
        """
        (nx, ny), touches = self.gap.shape, self.gap.vertices() == 0
        changes = np.diff(touches[:, :ny], axis=0), np.diff(touches[:nx], axis=1)
        edges = sum(map(np.count_nonzero, changes))
        return self.contact_area_fraction - PERIMETER_FACTOR * edges / self.contact.size

    @cached_property
    def mean_gap(self) -> float:
        """Mean of the gap over all samples, contact included [m]."""
        return float(self.gap.values.mean())


@dataclass(frozen=True, eq=False)
class BearingState(GapState):
    """The bearing ("cutting") model: the counter-face moved by `shift` and cut at the plane."""

    shift: float  #: approach of the surfaces from first touch [m]


@dataclass(frozen=True, eq=False)
class ContactState(GapState):
    """An elastic contact in equilibrium, with measures of its accuracy.

    The computed gap is g = S p - h, less its mean weighted with the pressure, or at the prescribed
    mean gap. Where the pressure is positive, ``|g|`` is at most `pressed_gap`, and the gap of the
    state is exactly 0. Elsewhere the gap is g, clipped at 0: samples that overlap, by at most
    `penetration`, touch as well.
    """

    pressure: GridField  #: [Pa] >= 0, on the same grid
    contact_modulus: float  #: E* [Pa]
    #: duality gap of the returned pressure, Σ p (g - min g) / (h_rms Σ p), computed from this
    #: pressure alone in float64. It proves that the energy per area lies within certificate × mean
    #: pressure × h_rms above the minimum. Under a prescribed mean gap it is at least
    #: ``|Σ p g|`` / (h_rms Σ p), and proves this up to the factor 2 r - 1, with r >= 1 the ratio of
    #: the exact mean pressure to this one; inf if nobody measured this state, as the next two
    certificate: float = inf
    #: largest ``|g|`` of the computed gap where the pressure is positive, in units of h_rms
    pressed_gap: float = inf
    penetration: float = inf  #: deepest overlap of the computed gap, in units of h_rms
    iterations: int = 0
    fft_pairs: float = 0.0  #: forward and backward transforms spent, start and certificate included
    #: certificate at each iteration for which it was computed (damped and fista: every 20)
    residuals: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        pressure = self.pressure.values
        if pressure.shape != self.gap.shape:
            raise Inconsistent(
                f"gap and pressure of a contact have {self.gap.shape} and {pressure.shape} samples"
            )
        if self.pressure.spacing != self.gap.spacing:
            raise Inconsistent("gap and pressure of a contact are on grids of another spacing")
        require_positive(contact_modulus=self.contact_modulus)
        if pressure.min() < 0:
            raise Inconsistent(f"the pressure of a contact is negative: {pressure.min():g} Pa")
        if ((pressure > 0) & (self.gap.values > 0)).any():
            raise Inconsistent("a contact has pressure where its gap is open")

    @classmethod
    def without_load(cls, gap: GridField, contact_modulus: float) -> "ContactState":
        """Exact state of a surface on which the counter-face presses nowhere."""
        none = GridField(np.zeros_like(gap.values), gap.spacing, gap.periodic)
        return cls(gap, none, contact_modulus, certificate=0.0, pressed_gap=0.0, penetration=0.0)

    @cached_property
    def mean_pressure(self) -> float:
        """Load per nominal area [Pa]."""
        return float(self.pressure.values.mean())
