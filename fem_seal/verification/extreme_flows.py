"""Sizes, fluids and contrasts at the ends of what can be asked for, each with its proof."""

import numpy as np

from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.finite_difference import solve
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.verification.finding import Outcome, limited, refusal, right, wrong
from fem_seal.verification.probe import ROUNDING, deviation_of, encloses, flow, rough, told


def gap_sizes() -> Outcome:
    """Gaps from 1e-12 m to 1 m, all else equal."""
    scales = [10.0**power for power in range(0, -13, -3)]
    base = rough((16, 16), 0.3)
    leaks = [flow(GridField(base.values * s, (1e-6, 1e-6), True)) for s in scales]
    return _neutral(leaks, [s**3 for s in scales])


def viscosities() -> Outcome:
    """Viscosities from 1e-10 to 1e10 Pa s."""
    values = [10.0**power for power in (-10, -5, 0, 5, 10)]
    leaks = [flow(rough((16, 16), 0.3), viscosity=eta) for eta in values]
    return _neutral(leaks, [1 / eta for eta in values])


def pressure_drops() -> Outcome:
    """Pressure drops from 1e-10 to 1e10 Pa."""
    values = [10.0**power for power in (-10, -5, 0, 5, 10)]
    leaks = [flow(rough((16, 16), 0.3), pressure_drop=drop) for drop in values]
    return _neutral(leaks, values)


def _neutral(leaks: list[LeakRate], factors: list[float]) -> Outcome:
    deviation = deviation_of(leaks, factors)
    told = f"bounds scale as they must to {deviation:.0e}"
    return right(told) if deviation < ROUNDING else wrong(told)


def _stripes(contrast: float, along: bool) -> tuple[LeakRate, float]:
    """Two conductivities, 1 and 1/contrast, in stripes along or across the flow."""
    low = contrast ** (-1 / 3)
    stripes = np.where(np.arange(8) % 4 < 2, 1.0, low)
    values = np.repeat(stripes[None], 8, 0) if along else np.repeat(stripes[:, None], 8, 1)
    exact = (1 + 1 / contrast) / 2 if along else 2 / (1 + contrast)
    return flow(GridField(values, (1.0, 1.0)), representation="constant"), exact


def contrast_along() -> Outcome:
    """Conductivity contrast from 1e3 to 1e300, side by side."""
    return _up_to_contrast(True)


def contrast_across() -> Outcome:
    """Conductivity contrast from 1e3 to 1e300, in series."""
    return _up_to_contrast(False)


def _up_to_contrast(along: bool) -> Outcome:
    proved = "the closed form lies inside the bounds"
    reached = 1
    for power in (3, 6, 9, 12, 15, 30, 60, 120, 180, 300):
        try:
            leak, exact = _stripes(10.0**power, along)
        except (InvalidInput, NotConverged) as error:
            return limited(f"{proved} up to 1e{reached}; at 1e{power}: {error}")
        if not (leak.converged and encloses(leak, exact)):
            return wrong(f"contrast 1e{power}: {told(leak)}, exactly {exact:.3e}")
        reached = power
    return right(proved)


def checkerboard_contrast() -> Outcome:
    """A checkerboard of contrast 1e2 to 1e30: all the flow passes corners."""
    reached = 0.0
    for power in (2, 6, 12, 30):
        low = 10.0 ** (-power / 3)
        gap = GridField(np.array([[1.0, low], [low, 1.0]]), (0.5, 0.5))
        leak = flow(gap, representation="constant", unknowns=3000)
        if not encloses(leak, 10.0 ** (-power / 2)):
            return wrong(f"√(K1 K2) outside {told(leak)} at contrast 1e{power}")
        if not leak.converged and not reached:
            reached = 10.0**power
    return limited(
        f"√(K1 K2) lies inside the bounds at every contrast; within 3000 unknowns they meet to 5 % "
        f"below a contrast of {reached:.0e}, and say that they do not from there on"
    )


def finite_difference_contrast() -> Outcome:
    """Finite differences at contrast 1e3 to 1e300, stripes across the flow."""
    reached = 1
    for power in (3, 15, 60, 120, 250, 300):
        low = 10.0 ** (-power / 3)
        stripes = np.where(np.arange(8) % 4 < 2, 1.0, low)
        gap = GridField(np.repeat(stripes[:, None], 8, 1), (1.0, 1.0))
        leak = solve(
            gap,
            viscosity=1 / 12,
            pressure_drop=1.0,
            sides="wall",
            representation="constant",
            links="harmonic",
        )
        error = abs(leak.value * (1 + 10.0**power) / 2 - 1)
        if error > 1e-3:
            return wrong(f"contrast 1e{power}: {leak.value:.6e}, {error:.0e} off")
        if error > ROUNDING:
            return limited(
                f"the closed form to rounding up to 1e{reached}; at 1e{power} double precision "
                f"runs out of exponents and costs {error:.0e}"
            )
        reached = power
    return right("elimination gives the closed form to rounding")


def gaps_beyond_double_precision() -> Outcome:
    """Gaps of 1e-310 m (denormal), 1e-120 m and 1e120 m, whose cube no number can hold."""
    texts = []
    for size in (1e-310, 1e-120, 1e120):
        gap = GridField(np.full((4, 4), size), (1.0, 1.0))
        for method in (flow, _eliminated):
            text = refusal(lambda gap=gap, method=method: method(gap))
            if text is None:
                leak = method(gap)
                return wrong(f"gap {size:g} m: {leak.state}, {leak.value:g}")
            texts.append(text)
    return Outcome("refused", texts[0])


def _eliminated(gap: GridField) -> LeakRate:
    return solve(gap, viscosity=1 / 12, pressure_drop=1.0, sides="wall")
