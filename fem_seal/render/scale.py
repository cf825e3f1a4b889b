"""Colour scale of a quantity, for the field and for its colour bar."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fem_seal.digits import readable
from fem_seal.render.colours import colour_map

if TYPE_CHECKING:
    from matplotlib.colors import Normalize


PRESSURE_COLOURS = "pressure"


@dataclass(frozen=True)
class Scale:
    """Colour scale; values beyond an end have the colour of that end."""

    label: str  #: quantity and unit, "gap [µm]"
    low: float  #: values at the ends of the bar, in that unit
    high: float
    logarithmic: bool = False  #: whether the colour depends on the logarithm of the value
    colours: str = "viridis"  #: name of a map of `fem_seal.render.colours`
    #: "neither", "min", "max" or "both": ends of the bar beyond which there are values
    beyond: str = "neither"
    lines: tuple[float, ...] = ()  #: values of the isolines in the picture and in the bar
    per_si: float = 1.0  #: number of the unit in one SI unit, in which fields are given

    @property
    def norm(self) -> "Normalize":
        """Map of matplotlib from values to 0..1."""
        from matplotlib.colors import LogNorm, Normalize

        return (LogNorm if self.logarithmic else Normalize)(self.low, self.high, clip=True)

    def paint(
        self, values: np.ndarray, shown: np.ndarray, rest: tuple[int, int, int]
    ) -> np.ndarray:
        """Colours (..., 4) uint8 of values in SI units; those that are not shown have another."""
        numbers = np.where(shown, self.per_si * values, self.high)
        colours = colour_map(self.colours)(np.asarray(self.norm(numbers)), bytes=True)
        colours[~shown] = (*rest, 255)
        return colours


def logarithmic_scale(
    label: str, values: np.ndarray, decades: int, colours: str, per_si: float = 1.0
) -> Scale:
    """Logarithmic scale of positive values [SI] whose ends are 1, 2 or 5 times a power of ten.

    Its length is at most `decades`, shorter if no value is that small, but one decade at least.
    """
    least, peak = per_si * float(values.min()), per_si * float(values.max())
    high = step_above(peak)
    low = high / 10.0**decades
    if least > low:
        low = min(1 / step_above(1 / least), high / 10.0)
    beyond = "min" if least < low else "neither"
    return Scale(label, low, high, True, colours, beyond, per_si=per_si)


def pressure_scale(label: str, pressure: np.ndarray) -> Scale:
    """Linear scale of a pressure [Pa] in a readable unit, with its isobars."""
    factor, unit = readable(float(np.abs(pressure).max()), "Pa")
    low, high = factor * float(pressure.min()), factor * float(pressure.max())
    if not high > low:
        low, high = low - 0.5, high + 0.5
    lines = isoline_levels(low, high)
    return Scale(
        f"{label} [{unit}]", low, high, colours=PRESSURE_COLOURS, lines=lines, per_si=factor
    )


def step_above(number: float) -> float:
    """Smallest 1, 2 or 5 times a power of ten that is not below a positive number."""
    decade = 10.0 ** np.floor(np.log10(number))
    return next(step * decade for step in (1, 2, 5, 10) if number <= step * decade * (1 + 1e-9))


def isoline_levels(low: float, high: float) -> tuple[float, ...]:
    """About ten round values between two."""
    from matplotlib.ticker import MaxNLocator

    ticks = MaxNLocator(10, steps=[1, 2, 5, 10]).tick_values(low, high)
    margin = 1e-9 * (high - low)
    return tuple(float(tick) for tick in ticks if low + margin < tick < high - margin)
