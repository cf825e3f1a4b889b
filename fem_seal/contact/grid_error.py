"""Error of the contact grid: the same surface under the same load on finer and finer grids."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.methods import ContactStopping
from fem_seal.contact.settings import Load, one_load
from fem_seal.contact.solve import load_to
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField
from fem_seal.surface.resampling import resample


def on_finer_grids(
    height: GridField,
    contact_modulus: float,
    *,
    pressure: float | None = None,
    area_fraction: float | None = None,
    mean_gap: float | None = None,
    factors: Sequence[float] = (0.5, 1, 2, 4),
    tolerance: float = 1e-6,
    threads: int | None = None,
) -> Iterator[ContactState]:
    """Yield the contact of Fourier-resampled heights on one grid after the other.

    Each solve starts from the pressure on the coarser grid, repeated on the finer samples.

    Parameters
    ----------
    height, contact_modulus, pressure, area_fraction, mean_gap, tolerance, threads : as in `solve`
    factors : multiples of the number of samples: increasing, and such that the numbers are whole;
        with a factor below 1 the surface loses the waves that the coarse grid cannot represent
    """
    load = one_load(pressure=pressure, area_fraction=area_fraction, mean_gap=mean_gap)
    shapes = [_shape(height.shape, factor) for factor in factors]
    if any(finer <= coarser for coarser, finer in pairwise(factors)):
        raise InvalidInput(f"factors must increase, got {tuple(factors)}")
    stopping = ContactStopping(tolerance=tolerance)
    first = ContactPair.prepared(resample(height, shapes[0]), contact_modulus, threads=threads)
    return _states(height, first, shapes, load, stopping)


def _states(
    height: GridField,
    pair: ContactPair,
    shapes: list[tuple[int, int]],
    load: Load,
    stopping: ContactStopping,
) -> Iterator[ContactState]:
    state = load_to(pair, load, stopping, None)
    yield state
    for shape in shapes[1:]:
        pair = pair.on(resample(height, shape))
        state = load_to(pair, load, stopping, _repeated(state.pressure, shape))
        yield state


@dataclass(frozen=True)
class GridError:
    """Estimate of what a finer grid of the contact may change."""

    lower: float | None  #: least true over computed leak rate; None if it is not known
    upper: float | None  #: largest true over computed leak rate; None if it is not known
    sentence: str  #: where the estimate comes from

    @property
    def part(self) -> float:
        """Largest |ln| of true over computed leak rate; infinite if a side is open."""
        if self.lower is None or self.upper is None:
            return np.inf
        return max(-np.log(self.lower), np.log(self.upper))


@dataclass(frozen=True)
class Extrapolation:
    """Limit of a sequence on finer and finer grids."""

    limit: float
    error: float  #: distance of the finest value from the limit
    order: float  #: observed order in the spacing; nan where the sequence is not monotone


def extrapolate(values: Sequence[float], refinement: float = 2.0) -> Extrapolation:
    """Richardson's extrapolation of the last three values with their observed order.

    The values are those on grids each of half the spacing of the one before. If they do not
    converge monotonically, no order can be observed: the limit is then the last value, and the
    error the larger of the two changes.
    """
    if len(values) < 3:
        raise InvalidInput(f"an extrapolation needs three grids, got {len(values)}")
    coarse, middle, fine = (float(value) for value in values[-3:])
    first, second = middle - coarse, fine - middle
    if second == 0:
        return Extrapolation(fine, 0.0, np.inf)
    if first / second <= 1:
        return Extrapolation(fine, max(abs(first), abs(second)), np.nan)
    limit = fine + second**2 / (first - second)
    return Extrapolation(
        limit, abs(limit - fine), float(np.log(first / second) / np.log(refinement))
    )


def _shape(shape: tuple[int, int], factor: float) -> tuple[int, int]:
    ratio = Fraction(factor).limit_denominator(1024)
    nx, ny = shape[0] * ratio, shape[1] * ratio
    if ratio <= 0 or any(n.denominator != 1 for n in (nx, ny)):
        raise InvalidInput(
            f"factor {factor} does not give a whole number of samples on a grid of {shape}"
        )
    return int(nx), int(ny)


def _repeated(pressure: GridField, shape: tuple[int, int]) -> np.ndarray:
    """Pressure of the nearest coarse sample; Fourier interpolation would oscillate at edges."""
    values = pressure.values
    for axis, n in enumerate(shape):
        nearest = np.rint(np.arange(n) * values.shape[axis] / n).astype(int) % values.shape[axis]
        values = values.take(nearest, axis)
    return values
