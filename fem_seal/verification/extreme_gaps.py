"""Contact and grids at the ends of what can be asked for, each with what proves the answer."""

import numpy as np

from fem_seal.errors import NotConverged
from fem_seal.grid import GridField
from fem_seal.verification.finding import Outcome, limited, refusal, right, wrong
from fem_seal.verification.probe import (
    MOST_UNKNOWNS,
    ROUNDING,
    deviation_of,
    encloses,
    flow,
    rough,
    told,
)


def no_contact() -> Outcome:
    """No contact at all: a uniform gap."""
    leak = flow(GridField(np.full((9, 5), 2.0), (0.5, 0.5)))
    exact = 2.0**3 / 2
    close = abs(leak.value / exact - 1) < ROUNDING and leak.converged
    return right("exact on the first mesh") if close else wrong(told(leak))


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
            return wrong(f"constriction at {remains:g} of its gap: {told(leak)}")
        if not leak.converged and not limits:
            limits.append(f"at {remains:g}, {MOST_UNKNOWNS} unknowns do not reach 5 % and say so")
    if not limits:
        return right("leaking with both bounds down to 1e-12 of the constriction, sealed at 0")
    return limited(f"with that part of the constriction's gap left: {'; '.join(limits)}")


def one_pixel_channel() -> Outcome:
    """A straight channel one pixel wide through contact, and one that turns twice."""
    straight = np.zeros((9, 9))
    straight[:, 4] = 0.3
    leak = flow(GridField(straight, (1.0, 1.0)), representation="constant")
    exact = 0.3**3 / 9
    if not (encloses(leak, exact) and leak.converged):
        return wrong(f"{told(leak)}, exactly {exact:.6e}")
    bent = np.zeros((9, 9))
    bent[:5, 2] = bent[4, 2:7] = bent[4:, 6] = 0.3
    turned = flow(GridField(bent, (1.0, 1.0)), representation="constant")
    # Thirteen squares in a row, of which two corners count 0.559 (conformal map, as in sheet
    # resistance: F. W. Grover's corner square).
    squares = 11 + 2 * 0.5590
    inside = turned.lower * 0.999 <= 0.3**3 / squares <= turned.upper * 1.001
    if not (inside and turned.converged):
        return wrong(f"{told(turned)}, exactly {0.3**3 / squares:.6e}")
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
            return wrong(f"hole {hole:g}: {leak.state}, {told(leak)}")
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
                return wrong(f"{representation}, parity {parity}: {told(leak)}")
            shapes[representation, parity] = leak.state
    # Pixel (i, j) has the rising diagonal if i + j is even: it joins the blocks in one case only.
    expected = {("linear", 0): "leaking", ("linear", 1): "sealed"}
    expected |= {("constant", 0): "sealed", ("constant", 1): "sealed"}
    if shapes != expected:
        return wrong(f"{shapes}")
    return right("constant: sealed; linear: as the diagonal there says; never undecided")


def pockets() -> Outcome:
    """A thousand pockets of trapped fluid beside a channel."""
    values = np.zeros((128, 64))
    values[:, 40:] = rough((128, 24), 0.0).values + 0.1
    without = flow(GridField(values, (1.0, 1.0)), rtol=0.2)
    values[1:-1:2, 1:38:2] = 1.0
    pocketed = flow(GridField(values, (1.0, 1.0)), rtol=0.2)
    count = np.count_nonzero(values[:, :39])
    same = deviation_of([without, pocketed], [1.0, 1.0])
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
            return wrong(f"{shape} pixels of {spacing}: {told(leak)}, exactly {exact:.6e}")
    return right("Ly / ∫dx/K to 1e-6 on the first mesh")


def small_grids() -> Outcome:
    """Grids of 1 × n, 2 × 2, 3 × 3 and primes."""
    for shape in ((1, 7), (7, 1), (2, 2), (3, 3), (31, 37)):
        gap = GridField(0.5 + np.random.default_rng(3).random(shape), (1.0, 1.0))
        leak = flow(gap, representation="constant", rtol=0.2)
        K = gap.values**3
        series, parallel = 1 / np.sum(1 / K.sum(axis=1)), np.sum(1 / np.sum(1 / K, axis=0))
        if not (leak.converged and leak.lower <= series and parallel <= leak.upper):
            return wrong(f"{shape}: {told(leak)} outside [{parallel:.4e}, {series:.4e}]")
    text = refusal(lambda: flow(GridField(np.ones((1, 7)), (1.0, 1.0))))
    if text is None:
        return wrong("a linear gap of one row was not refused")
    return right("between layers in series and side by side; a linear gap of one row is refused")
