"""Gaps, fluids and grids at the ends of what can be asked for, each with what proves the answer."""

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.finite_difference import solve
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.study.finding import Outcome, limited, refusal, right, wrong

ROUNDING = 1e-9  # of bounds in other units: rounding of the input times the contrast CG sees
MOST_UNKNOWNS = 6000


def flow(
    gap: GridField,
    *,
    representation: str = "linear",
    sides: str = "wall",
    rtol: float = 0.05,
    viscosity: float = 1 / 12,
    pressure_drop: float = 1.0,
    unknowns: int = MOST_UNKNOWNS,
) -> LeakRate:
    """Adaptive bracket; the fluid is such that the film conductivity is the cubed gap."""
    from fem_seal.flow import Limits, leak_rate

    return leak_rate(
        gap,
        viscosity=viscosity,
        pressure_drop=pressure_drop,
        representation=representation,
        sides=sides,
        rtol=rtol,
        limits=Limits(unknowns=unknowns),
    )


def rough(shape: tuple[int, int], contact: float, seed: int = 4) -> GridField:
    """Random samples averaged over their neighbours, cut off at a contact area; maximum 1."""
    noise = np.random.default_rng(seed).normal(size=shape)
    smooth = sum(np.roll(noise, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1))
    values = np.maximum(0.0, smooth - np.quantile(smooth, contact))
    return GridField(values / values.max(), (1.0, 1.0), periodic=True)


def _encloses(leak: LeakRate, exact: float) -> bool:
    return all(level.lower <= exact <= level.upper for level in leak.levels)


def _deviation(leaks: list[LeakRate], factors: list[float]) -> float:
    """Largest relative deviation of bounds from the first ones times known factors."""
    first = np.array([leaks[0].lower, leaks[0].upper]) / factors[0]
    others = zip(leaks, factors, strict=True)
    scaled = [np.array([leak.lower, leak.upper]) / factor for leak, factor in others]
    return float(np.abs(np.array(scaled) / first - 1).max())


def _neutral(leaks: list[LeakRate], factors: list[float]) -> Outcome:
    deviation = _deviation(leaks, factors)
    told = f"bounds scale as they must to {deviation:.0e}"
    return right(told) if deviation < ROUNDING else wrong(told)


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
    for power in (3, 6, 9, 12, 15, 30, 60, 120, 300):
        try:
            leak, exact = _stripes(10.0**power, along)
        except NotConverged as error:
            return limited(f"{proved} up to 1e{reached}; at 1e{power} the solver says: {error}")
        if not (leak.converged and _encloses(leak, exact)):
            return wrong(f"contrast 1e{power}: {_told(leak)}, exactly {exact:.3e}")
        reached = power
    return right(proved)


def _told(leak: LeakRate) -> str:
    return f"[{leak.lower:.6e}, {leak.upper:.6e}], converged {leak.converged}"


def checkerboard_contrast() -> Outcome:
    """A checkerboard of contrast 1e2 to 1e30: all the flow passes corners."""
    reached = 0.0
    for power in (2, 6, 12, 30):
        low = 10.0 ** (-power / 3)
        gap = GridField(np.array([[1.0, low], [low, 1.0]]), (0.5, 0.5))
        leak = flow(gap, representation="constant", unknowns=3000)
        if not _encloses(leak, 10.0 ** (-power / 2)):
            return wrong(f"√(K1 K2) outside {_told(leak)} at contrast 1e{power}")
        if not leak.converged and not reached:
            reached = 10.0**power
    return limited(
        f"√(K1 K2) lies inside the bounds at every contrast; within 3000 unknowns they meet to 5 % "
        f"below a contrast of {reached:.0e}, and say that they do not from there on"
    )


def no_contact() -> Outcome:
    """No contact at all: a uniform gap."""
    leak = flow(GridField(np.full((9, 5), 2.0), (0.5, 0.5)))
    exact = 2.0**3 / 2
    close = abs(leak.value / exact - 1) < ROUNDING and leak.converged
    return right("exact on the first mesh") if close else wrong(_told(leak))


def nearly_all_contact() -> Outcome:
    """Contact everywhere, and everywhere but in one sample."""
    values = np.zeros((9, 9))
    states = [flow(GridField(values, (1.0, 1.0))).state]
    values[4, 4] = 1.0
    states += [
        flow(GridField(values, (1.0, 1.0)), representation=representation).state
        for representation in ("linear", "constant")
    ]
    told = f"states {', '.join(states)}"
    return right("sealed, without a solve") if set(states) == {"sealed"} else wrong(told)


def one_pixel_channel() -> Outcome:
    """A straight channel one pixel wide through contact, and one that turns twice."""
    straight = np.zeros((9, 9))
    straight[:, 4] = 0.3
    leak = flow(GridField(straight, (1.0, 1.0)), representation="constant")
    exact = 0.3**3 / 9
    if not (_encloses(leak, exact) and leak.converged):
        return wrong(f"{_told(leak)}, exactly {exact:.6e}")
    bent = np.zeros((9, 9))
    bent[:5, 2] = bent[4, 2:7] = bent[4:, 6] = 0.3
    turned = flow(GridField(bent, (1.0, 1.0)), representation="constant")
    # Thirteen squares in a row, of which two corners count 0.559 (conformal map, as in sheet
    # resistance: F. W. Grover's corner square).
    squares = 11 + 2 * 0.5590
    inside = turned.lower * 0.999 <= 0.3**3 / squares <= turned.upper * 1.001
    if not (inside and turned.converged):
        return wrong(f"{_told(turned)}, exactly {0.3**3 / squares:.6e}")
    return right("w g³/L, and 0.559 squares for each corner, inside the bounds")


def one_pixel_wall() -> Outcome:
    """A wall of contact one sample thick, then with ever smaller holes of one sample."""
    for representation in ("linear", "constant"):
        values = np.ones((9, 9))
        values[4] = 0.0
        if flow(GridField(values, (1.0, 1.0)), representation=representation).state != "sealed":
            return wrong(f"{representation}: a closed wall leaks")
    reached = 1.0
    for hole in (0.3, 0.1, 0.03, 0.01, 1e-3):
        values[4, 3] = hole
        leak = flow(GridField(values, (1.0, 1.0)))
        if leak.state != "leaking" or (leak.converged and not leak.lower > 0):
            return wrong(f"hole {hole:g}: {leak.state}, {_told(leak)}")
        if not leak.converged:
            return limited(
                f"sealed without a solve; with a hole of a linear gap {MOST_UNKNOWNS} unknowns "
                f"reach 5 % down to {reached:g} of the gap around, at {hole:g} they do not and "
                "say so"
            )
        reached = hole
    return right("sealed without a solve; with the hole a leak rate with both bounds")


def corner_contacts() -> Outcome:
    """Open only through a corner: two open blocks that share one point."""
    shapes = {}
    for parity in (0, 1):
        values = np.zeros((6, 6))
        values[:3, : 3 - parity] = values[3:, 3 - parity :] = 1.0
        gap = GridField(values, (1.0, 1.0))
        for representation in ("linear", "constant"):
            leak = flow(gap, representation=representation)
            decided = leak.state == "sealed" or (leak.lower > 0 and leak.converged)
            if not decided:
                return wrong(f"{representation}, parity {parity}: {_told(leak)}")
            shapes[representation, parity] = leak.state
    # Pixel (i, j) has the rising diagonal if i + j is even: it joins the blocks in one case only.
    expected = {("linear", 0): "leaking", ("linear", 1): "sealed"}
    expected |= {("constant", 0): "sealed", ("constant", 1): "sealed"}
    if shapes != expected:
        return wrong(f"{shapes}")
    return right("constant: sealed; linear: as the diagonal there says; never undecided")


def percolation() -> Outcome:
    """Just below percolation: the critical constriction a thousandth of itself and less, then 0."""
    from fem_seal.topology.constriction import critical_constriction

    gap = rough((24, 24), 0.3, seed=1)
    width = critical_constriction(gap, "periodic", "linear").gap
    limits: list[str] = []
    # Lowered until the critical constriction is all but shut, then shut.
    for remains in (0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-12, 0.0):
        values = np.maximum(0.0, gap.values - width)
        values[gap.values == width] = remains * width
        try:
            leak = flow(GridField(values, gap.spacing, True), sides="periodic")
        except NotConverged as error:
            limits.append(f"at {remains:g} the solver says: {error}")
            break
        if leak.state != ("leaking" if remains else "sealed"):
            return wrong(f"constriction at {remains:g} of its gap: {leak.state}")
        if leak.converged and remains and not leak.lower > 0:
            return wrong(f"constriction at {remains:g} of its gap: {_told(leak)}")
        if not leak.converged and not limits:
            limits.append(f"at {remains:g}, {MOST_UNKNOWNS} unknowns do not reach 5 % and say so")
    if not limits:
        return right("leaking with both bounds down to 1e-12 of the constriction, sealed at 0")
    return limited(f"with that part of the constriction's gap left: {'; '.join(limits)}")


def pockets() -> Outcome:
    """A thousand pockets of trapped fluid beside a channel."""
    values = np.zeros((128, 64))
    values[:, 40:] = rough((128, 24), 0.0).values + 0.1
    without = flow(GridField(values, (1.0, 1.0)), rtol=0.2)
    values[1:-1:2, 1:38:2] = 1.0
    pocketed = flow(GridField(values, (1.0, 1.0)), rtol=0.2)
    count = np.count_nonzero(values[:, :39])
    same = _deviation([without, pocketed], [1.0, 1.0])
    if without.unknowns != pocketed.unknowns or same > ROUNDING:
        return wrong(
            f"unknowns {without.unknowns} and {pocketed.unknowns}, bounds differ {same:.0e}"
        )
    return right(f"{count} pockets: same unknowns, same bounds; they are not solved")


def slender() -> Outcome:
    """Cells of Lx/Ly = 1000 and 1/1000, of many pixels and of slender ones."""
    for shape, spacing in (((1000, 2), (1, 1)), ((2, 1000), (1, 1)), ((8, 8), (1000, 1))):
        f = 1 + np.random.default_rng(2).random(shape[0])
        gap = GridField(np.repeat(f[:, None], shape[1], 1), tuple(map(float, spacing)))
        exact = gap.spacing[1] * shape[1] / np.sum(gap.spacing[0] / f**3)
        leak = flow(gap, representation="constant")
        if not (leak.converged and abs(leak.value / exact - 1) < 1e-6):
            return wrong(f"{shape} pixels of {spacing}: {_told(leak)}, exactly {exact:.6e}")
    return right("Ly / ∫dx/K to 1e-6 on the first mesh")


def small_grids() -> Outcome:
    """Grids of 1 × n, 2 × 2, 3 × 3 and primes."""
    for shape in ((1, 7), (7, 1), (2, 2), (3, 3), (31, 37)):
        gap = GridField(0.5 + np.random.default_rng(3).random(shape), (1.0, 1.0))
        leak = flow(gap, representation="constant", rtol=0.2)
        K = gap.values**3
        series, parallel = 1 / np.sum(1 / K.sum(axis=1)), np.sum(1 / np.sum(1 / K, axis=0))
        if not (leak.converged and leak.lower <= series and parallel <= leak.upper):
            return wrong(f"{shape}: {_told(leak)} outside [{parallel:.4e}, {series:.4e}]")
    text = refusal(lambda: flow(GridField(np.ones((1, 7)), (1.0, 1.0))))
    if text is None:
        return wrong("a linear gap of one row was not refused")
    return right("between layers in series and side by side; a linear gap of one row is refused")


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
