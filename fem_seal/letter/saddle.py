"""The leak rate of one saddle of an elastic contact as it closes.

The last channel of a seal closes at a saddle point of the gap, between two contact patches that are
about to meet. For a hard wall without adhesion Q ∝ (p_c - p)^(69/20), according to W. B. Dapp and
M. H. Müser, EPL 109, 44001 (2015). The surface is their square lattice,

    h = H (cos 2πy/λ - cos 2πx/λ),

with one saddle a period along the flow, at its middle; all others lie behind contact.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from fem_seal.contact import solve
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.parallel import Comm
from fem_seal.points import Chain, RecordFolder, Task, Work, compute_study
from fem_seal.progress import Report, silent
from fem_seal.tables import shown_as

EXPONENT = 69 / 20
# Lengths in λ, heights in H, pressures in E* H/λ, leak rates in H³ Δp/(12 η).
CONTACT_MODULUS = 1.0
TOLERANCE = 1e-10
# Pressures of a leaking and a sealed contact. Contact is full at 2π and seals well below π.
OPEN, SHUT = 0.5, np.pi
SIDES = "periodic"
# Distances (p_c - p)/p_c from closing; at the smallest one 1024 samples just resolve the saddle.
DISTANCES = tuple(0.32 * 10 ** (-k / 4) for k in range(9))
# On 16 samples the saddle is a single sample wide at most distances: Q is then the cube of a gap
# that falls linearly, and its exponent 3.
LEAST_SAMPLES = 32
# Largest difference of a local exponent between two grids; exponents that differ more are not used.
TRUSTED = 0.05


@dataclass(frozen=True)
class Closing:
    """Bracket of the closing pressure.

    Attributes
    ----------
    samples : int
        Samples along a period.
    leaking, sealed : float
        Pressures [E* H/λ] at which the contact leaks and is sealed.
    """

    samples: int
    leaking: float
    sealed: float

    @property
    def pressure(self) -> float:
        """Closing pressure p_c, the middle of the two."""
        return 0.5 * (self.leaking + self.sealed)


@dataclass(frozen=True)
class SaddlePoint:
    """A contact near closing, and its leak rate.

    Attributes
    ----------
    samples : int
        Samples along a period.
    distance : float
        (p_c - p) / p_c, with the closing pressure p_c of the same grid.
    area : float
        A/A0.
    gap : float
        Gap at the saddle [H].
    lower, upper : float
        Bounds of the leak rate [H³ Δp/(12 η)].
    """

    samples: int
    distance: float
    area: float
    gap: float
    lower: float
    upper: float

    @property
    def leak_rate(self) -> float:
        """√(lower upper)."""
        return float(np.sqrt(self.lower * self.upper))


@dataclass(frozen=True)
class LocalExponent:
    """d ln Q / d ln(p_c - p) between two distances.

    Attributes
    ----------
    distance : float
        Geometric mean of the two distances.
    value : float
        Exponent of the leak rate.
    error : float
        Half-width of the exponent, from the brackets of the leak rates.
    gap : float
        Exponent of the gap at the saddle.
    """

    distance: float = field(metadata=shown_as("(p_c - p)/p_c"))
    value: float = field(metadata=shown_as("d ln Q/d ln(p_c - p)"))
    error: float = field(metadata=shown_as("±"))
    gap: float = field(metadata=shown_as("d ln gap/d ln(p_c - p)"))


def surface(samples: int) -> GridField:
    """One period of the lattice, the saddle in the middle."""
    wave = np.cos(2 * np.pi * np.arange(samples) / samples)
    return GridField(wave[None, :] - wave[:, None], (1 / samples, 1 / samples), periodic=True)


def pressed(samples: int, pressure: float) -> ContactState:
    """Contact of the lattice under a mean pressure [E* H/λ]."""
    return solve(surface(samples), CONTACT_MODULUS, pressure=pressure, tolerance=TOLERANCE)


def closing_pressure(samples: int, rtol: float = 1e-6) -> Closing:
    """Bisect the pressure at which the last open path closes.

    Parameters
    ----------
    samples : samples along a period; even, so that one lies on the saddle
    rtol : width of the bracket over the pressure

    Raises
    ------
    InvalidInput
        For an odd number of samples.
    NotConverged
        If a contact does not reach its tolerance.
    """
    if samples % 2:
        raise InvalidInput(f"samples must be even to meet the saddle, got {samples}")
    leaking, sealed = OPEN, SHUT
    while sealed - leaking > rtol * leaking:
        middle = 0.5 * (leaking + sealed)
        if GridFilm(pressed(samples, middle).gap, SIDES).sealed:
            sealed = middle
        else:
            leaking = middle
    return Closing(samples, leaking, sealed)


def close_saddle(
    closing: Closing,
    distances: Sequence[float] = DISTANCES,
    rtol: float = 0.01,
    report: Report = silent,
) -> tuple[SaddlePoint, ...]:
    """Leak rates at several distances from closing.

    Parameters
    ----------
    closing : closing pressure on the grid
    distances : (p_c - p) / p_c, falling
    rtol : relative width of the bounds of the leak rates
    report : called with each point

    Raises
    ------
    NotConverged
        If a contact or the linear solver fails.
    """
    from fem_seal.flow import leak_rate

    points = []
    for distance in distances:
        report(f"saddle on {closing.samples}", f"{distance:.2g} from closing")
        state = pressed(closing.samples, closing.pressure * (1 - distance))
        leak = leak_rate(
            GridFilm(state.gap, sides=SIDES), viscosity=1 / 12, pressure_drop=1.0, rtol=rtol
        )
        middle = closing.samples // 2
        lower, upper = leak.bounds
        points.append(
            SaddlePoint(
                samples=closing.samples,
                distance=distance,
                area=state.contact_area_fraction,
                gap=float(state.gap.values[middle, middle]),
                lower=lower,
                upper=upper,
            )
        )
    return tuple(points)


@dataclass(frozen=True)
class SaddleSeries:
    """A saddle that closes, on one grid; the content of a file of points/.

    Attributes
    ----------
    closing : Closing
        Bracket of the closing pressure.
    points : tuple[SaddlePoint, ...]
        Leak rates at falling distances from it.
    """

    closing: Closing
    points: tuple[SaddlePoint, ...]


@dataclass(frozen=True)
class SeriesTask(Task[SaddleSeries]):
    """The saddle on one grid.

    Attributes
    ----------
    samples : int
        Samples along a period.
    """

    samples: int

    def compute(self, handed_on: None, report: Report, comm: Comm) -> SaddleSeries:
        """Bisect the closing pressure, then close the saddle."""
        report("closing pressure", "")
        closing = closing_pressure(self.samples)
        return SaddleSeries(closing, close_saddle(closing, report=report))


def saddle_series(
    samples: Sequence[int], out: Path, work: Work | None = None, report: Report = silent
) -> list[SaddleSeries] | None:
    """Close the saddle on several grids.

    Parameters
    ----------
    samples : samples along a period, for each grid
    out : folder of points/, with a file for each grid
    work : how the grids are shared among workers; one after the other if left out
    report : called with each point

    Returns
    -------
    Series in the order of the grids; None if some are left to other parts of the study.

    Raises
    ------
    NotConverged
        If a contact or the linear solver fails.
    """
    folder = RecordFolder(out / "points", SaddleSeries)
    tasks = [SeriesTask(f"saddle-{n}", f"{n} samples", n) for n in samples]
    # The finest grid, which takes longest, comes first.
    chains = [Chain(folder, (task,)) for task in reversed(tasks)]
    if compute_study(chains, work, report).missing:
        return None
    stored = (folder.point(task.name) for task in tasks)
    return [point for point in stored if point is not None]


def local_exponents(points: Sequence[SaddlePoint]) -> tuple[LocalExponent, ...]:
    """Local exponents between neighbouring points, all of which must leak."""
    return tuple(_between(far, near) for far, near in pairwise(points))


def _between(far: SaddlePoint, near: SaddlePoint) -> LocalExponent:
    step = np.log(far.distance / near.distance)
    half_widths = [0.5 * np.log(point.upper / point.lower) for point in (far, near)]
    return LocalExponent(
        distance=float(np.sqrt(far.distance * near.distance)),
        value=float(np.log(far.leak_rate / near.leak_rate) / step),
        error=float(sum(half_widths) / step),
        gap=float(np.log(far.gap / near.gap) / step),
    )


@dataclass(frozen=True)
class Limit:
    """Limit of the local exponents at closing, value + amplitude × distance^power.

    Attributes
    ----------
    value, error : float
        Limit and its error.
    amplitude, power : float
        Correction at a distance from closing: amplitude × distance^power.
    """

    value: float
    error: float
    amplitude: float
    power: float


def limiting_exponent(
    coarse: Sequence[LocalExponent], fine: Sequence[LocalExponent], trusted: float = TRUSTED
) -> Limit:
    """Extrapolate local exponents to ever finer grids, and then to closing.

    Parameters
    ----------
    coarse, fine : exponents on n and 2n samples, at the same distances
    trusted : exponents that differ more on the two grids are left out

    Returns
    -------
    Limit; the squares of the standard error of the fit and of the change by the extrapolation in n
    add up to that of its error.

    Raises
    ------
    InvalidInput
        If fewer than four pairs are left.
    """
    pairs = [(c, f) for c, f in zip(coarse, fine, strict=True) if abs(c.value - f.value) < trusted]
    if len(pairs) < 4:
        raise InvalidInput(
            f"a limit needs four distances at which both grids agree to {trusted:g}, got "
            f"{len(pairs)}; take more samples"
        )
    distance = np.array([f.distance for _, f in pairs])
    on_fine = np.array([f.value for _, f in pairs])
    change = np.array([f.value - c.value for c, f in pairs])
    (fine_value, *_), _ = _fit(distance, on_fine)
    # First order in the spacing: the same change again from 2n samples to infinitely many.
    (value, amplitude, power), spread = _fit(distance, on_fine + change)
    return Limit(value, float(np.hypot(spread, value - fine_value)), amplitude, power)


def _fit(distance: np.ndarray, exponent: np.ndarray) -> tuple[tuple[float, ...], float]:
    """Least squares fit of β + a distance^ω: (β, a, ω), and the standard error of β."""
    from scipy.optimize import curve_fit

    parameters, covariance = curve_fit(
        lambda x, limit, amplitude, power: limit + amplitude * x**power,
        distance,
        exponent,
        p0=(exponent[-1], 1.0, 0.5),
    )
    return tuple(map(float, parameters)), float(np.sqrt(covariance[0, 0]))
