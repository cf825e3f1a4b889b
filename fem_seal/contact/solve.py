"""From a surface and a load to the elastic contact."""

from dataclasses import replace

import numpy as np

from fem_seal.contact.area_control import contact_of_area
from fem_seal.contact.contact_pair import ContactPair
from fem_seal.contact.halfspace import Layer
from fem_seal.contact.methods import CONTACT_METHODS, ContactStopping, Progress
from fem_seal.contact.settings import Arithmetic, ElasticSolid, Load, one_load
from fem_seal.contact.state import ContactState
from fem_seal.errors import InvalidInput
from fem_seal.grid import GridField

FirstGuess = np.ndarray | GridField | ContactState
# Contact area below which a coarse start pays. Measured at 512² and 1024²: it saves a quarter of
# the CPU time at 1 % of contact, a few percent at 5 %, and nothing at 20 %, where the remaining
# error is local.
LIGHT = 0.06
COARSEST = 128  # fewest samples along a side of a coarse grid
# A more accurate coarse solution does not make a better start.
ROUGHLY = ContactStopping(tolerance=0.3, gap_tolerance=float("inf"))


def press(
    height: GridField,
    contact_modulus: float,
    *,
    pressure: float | None = None,
    area_fraction: float | None = None,
    mean_gap: float | None = None,
    tolerance: float = 1e-6,
    solver: str = "free-set-cg",
    start: FirstGuess | None = None,
    layer: Layer | None = None,
    threads: int | None = None,
    precision: str = "mixed",
    max_iterations: int | None = None,
    progress: Progress | None = None,
) -> ContactState:
    """Dry contact of a rough face with an elastic half-space; `fem_seal.solve` adds the fluid.

    Without friction and adhesion. The fluid's pressure, which lifts the solid in a scene
    (`flow.lift`), is not in it.
    Minimises ``V = (A0/4) E* Σ q |ũ(q)|²`` under a load and u >= h (Dapp et al., Phys. Rev. Lett.
    108, 244301 (2012)), small slopes, periodic.

    Parameters
    ----------
    height
        Heights [m], periodic; the highest points touch first.
    contact_modulus
        E* [Pa], 1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2.
    pressure
        Nominal (mean) pressure [Pa] >= 0; 0 is first touch.
    area_fraction
        Raw contact area fraction in [0, 1), reached to 1 part in 1000 or half a sample or, where
        equal heights touch together, to the nearer side of the jump; 0 is first touch.
    mean_gap
        [m], > 0, reached to 1 part in 10 000. Exactly one of the three loads.
    tolerance
        Tolerance of the certificate, see `ContactState`. At every tolerance pressed samples touch
        to 1e-4 of the rms height.
    solver
        "free-set-cg" (fastest), "polonsky-keer", "fista", or "damped": the letter's dynamics.
    start
        Pressure [Pa] to start from, an array, a field or the state of another load; it is set to
        zero on samples that it leaves open.
    layer
        A solid of finite thickness in place of the half-space.
    threads
        Threads of the FFTs and of the passes over the arrays; the cores of this process on large
        grids if left out.
    precision
        "double", or "mixed": search directions, and on large grids all arrays, in single precision
        until the certificate comes near the tolerance; the result is double.
    max_iterations
        Largest number of iterations of a solve; the default depends on the solver.
    progress
        Called with iteration and residual after each iteration (damped, fista: every 20).

    Raises
    ------
    InvalidInput
        If no load or more than one is given, or one of the arguments is out of its range.
    NotConverged
        If the certificate does not reach the tolerance, if pressed samples do not touch or samples
        overlap by more than 1e-4 of the rms height, or if the mean gap is not the prescribed one.
    """
    load = one_load(pressure=pressure, area_fraction=area_fraction, mean_gap=mean_gap)
    stopping = ContactStopping(solver, tolerance, max_iterations, progress)
    arithmetic = Arithmetic(threads, precision)
    return contact_under(
        height, ElasticSolid(contact_modulus, layer), load, stopping, arithmetic, start
    )


def contact_under(
    height: GridField,
    solid: ElasticSolid,
    load: Load,
    stopping: ContactStopping,
    arithmetic: Arithmetic,
    start: FirstGuess | None = None,
) -> ContactState:
    """The contact of `press`, with its settings as objects; `start` is a pressure [Pa]."""
    pair = ContactPair.prepared(height, solid, arithmetic)
    first = start_pressure(start, height.shape)
    if first is not None:
        first = pair.complementary(first)
    state = load_to(pair, load, stopping, first)
    return replace(state, fft_pairs=pair.half_space.fft_pairs)


def load_to(
    pair: ContactPair, load: Load, stopping: ContactStopping, start: np.ndarray | None
) -> ContactState:
    """Contact under one load; the caller counts the transforms."""
    if load.value == 0:
        return pair.touching()
    reach = {
        "pressure": pair.under_pressure,
        "mean_gap": pair.at_mean_gap,
        "area_fraction": lambda *args: contact_of_area(pair, *args),
    }[load.kind]
    if start is None and load.kind == "pressure" and CONTACT_METHODS[stopping.solver].starts_coarse:
        start = coarse_start(pair, load.value)
    return reach(load.value, stopping, start)


def coarse_start(pair: ContactPair, mean_pressure: float) -> np.ndarray | None:
    """Pressure [Pa] of the 2 × 2 means of the heights, repeated on the fine grid.

    The coarse problem is started in the same way, recursively. None where a coarse start would not
    pay: on small or odd grids, and unless Persson's area √(8/π) p / (E* h'rms) is below `LIGHT`,
    with the slope from differences of neighbours.
    """
    heights, spacing = pair.height.values, pair.height.spacing
    nx, ny = heights.shape
    if min(nx, ny) < 2 * COARSEST or nx % 2 or ny % 2:
        return None
    slope = pair.height.slope_between_samples()
    if (8 / np.pi) ** 0.5 * mean_pressure >= LIGHT * pair.solid.contact_modulus * slope:
        return None
    means = heights.reshape(nx // 2, 2, ny // 2, 2).mean(axis=(1, 3))
    height = GridField(means, (2 * spacing[0], 2 * spacing[1]), periodic=True)
    coarse = ContactPair.prepared(height, pair.solid, pair.arithmetic)
    start = coarse_start(coarse, mean_pressure)
    state = coarse.under_pressure(mean_pressure, ROUGHLY, start)
    pair.half_space.fft_pairs += coarse.half_space.fft_pairs / 4
    return state.pressure.values.repeat(2, axis=0).repeat(2, axis=1)


def start_pressure(start: FirstGuess | None, shape: tuple[int, int]) -> np.ndarray | None:
    """Pressure to start from as an array [Pa]."""
    if start is None:
        return None
    field = start.pressure if isinstance(start, ContactState) else start
    values = np.asarray(field.values if isinstance(field, GridField) else field, dtype=float)
    if values.shape != shape or not np.isfinite(values).all() or values.min() < 0:
        raise InvalidInput(
            f"start must be a finite pressure >= 0 of shape {shape}, got shape {values.shape}"
        )
    return values
