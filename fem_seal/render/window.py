"""Rectangle of the seal that a picture shows, and the colour scale of a quantity."""

from dataclasses import dataclass

import numpy as np

from fem_seal.errors import InvalidInput

LONG_SIDE = 1200  # length of the longer side [pixel]
SHORT_SIDE = 240  # least length of the shorter side [pixel]; narrower strips are stretched to it


@dataclass(frozen=True)
class Window:
    """The rectangle of the seal that a picture shows."""

    x0: float  #: ends along the flow [m], x0 < x1
    x1: float
    y0: float  #: ends across the flow [m], y0 < y1
    y1: float

    def __post_init__(self) -> None:
        if not (self.x0 < self.x1 and self.y0 < self.y1):
            raise InvalidInput(
                f"a picture needs a window with x0 < x1 and y0 < y1 [m], got x {self.x0:g} to "
                f"{self.x1:g} and y {self.y0:g} to {self.y1:g}"
            )

    def pixels(self, long_side: int = LONG_SIDE) -> tuple[int, int]:
        """Width and height of the picture, to scale unless one side is very short."""
        width, height = self.x1 - self.x0, self.y1 - self.y0
        scale = long_side / max(width, height)
        shortest = min(SHORT_SIDE, long_side)
        return max(shortest, round(width * scale)), max(shortest, round(height * scale))


@dataclass(frozen=True)
class Scale:
    """Colour scale of a quantity, for the field and for its colour bar."""

    label: str  #: quantity and unit, "gap [µm]"
    low: float  #: values at the ends of the bar. Values beyond an end have the colour of that end
    high: float
    logarithmic: bool = False  #: whether the colour depends on the logarithm of the value
    colours: str = "viridis"  #: name of a map of `fem_seal.render.colours`
    #: "neither", "min", "max" or "both": ends of the bar beyond which there are values
    beyond: str = "neither"
    lines: tuple[float, ...] = ()  #: values of the isolines in the picture and in the bar

    def __post_init__(self) -> None:
        least = 0.0 if self.logarithmic else -np.inf
        if not (np.isfinite([self.low, self.high]).all() and least < self.low < self.high):
            kind = "0 < low < high" if self.logarithmic else "low < high"
            raise InvalidInput(
                f"the colour scale of {self.label!r} runs from {self.low:g} to {self.high:g}; "
                f"it needs finite limits with {kind}"
            )

    def position(self, values: np.ndarray) -> np.ndarray:
        """Position of values on the bar, 0 at its lower and 1 at its upper end."""
        low, high = self.low, self.high
        if self.logarithmic:
            return np.log(np.maximum(values, low) / low) / np.log(high / low)
        return (values - low) / (high - low)


def logarithmic_scale(label: str, least: float, peak: float, decades: int, colours: str) -> Scale:
    """Logarithmic scale whose ends are 1, 2 or 5 times a power of ten.

    Parameters
    ----------
    label : quantity and unit
    least, peak : smallest and largest value, peak > 0
    decades : largest length of the bar; it is shorter if no value is that small, but one decade at
        least
    colours : name of a map of `fem_seal.render.colours`
    """
    high = step_above(peak)
    low = high / 10.0**decades
    if least > low:
        low = min(1 / step_above(1 / least), high / 10.0)
    return Scale(label, low, high, True, colours, "min" if least < low else "neither")


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
