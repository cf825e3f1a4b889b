"""Surfaces and loads at the ends of what can be asked for, each with what proves the answer."""

import numpy as np

from fem_seal.contact import ContactState, bearing, solve
from fem_seal.grid import GridField
from fem_seal.surface import Spectrum, fitted_hurst, self_affine
from fem_seal.verification.finding import Outcome, limited, refusal, right, wrong

E_STAR = 1e7  # Pa
MICRON = 1e-6
TOLERANCE = 1e-6  # of the contact's certificate


def rough(shape: tuple[int, int] = (32, 32), hurst: float = 0.8, short: float = 4.0) -> GridField:
    """Self-affine heights, rms slope 0.1; wavelengths in samples, the long one half the side."""
    size = tuple(n * MICRON for n in shape)
    spectrum = Spectrum(hurst, max(size) / 2, short * MICRON)
    return self_affine(spectrum, shape, size, rms_slope=0.1, seed=1)


def _proved(state: ContactState, pressure: float | None = None) -> bool:
    """Certificate kept, and the load carried that was asked for."""
    carried = pressure is None or abs(state.mean_pressure / pressure - 1) < 1e-9
    return state.converged and state.certificate <= TOLERANCE and carried


def loads() -> Outcome:
    """Mean pressures from 1e-8 to 1e4 E*."""
    surface, areas = rough(), []
    for ratio in (1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4):
        state = solve(surface, E_STAR, pressure=ratio * E_STAR)
        if not _proved(state, ratio * E_STAR):
            return wrong(f"p/E* = {ratio:g}: certificate {state.certificate:.1e}")
        areas.append(state.contact_area_fraction)
    if areas != sorted(areas) or areas[-1] != 1:
        return wrong(f"contact areas {areas}")
    told = f"certificate kept, area grows from {areas[0]:.4f} to full contact"
    return right(f"{told}, load to 1e-9")


def contact_units() -> Outcome:
    """Heights, lengths and moduli in units 1e-12 to 1e12 of the first."""
    surface, areas = rough(), set()
    for unit in (1e-12, 1e-6, 1.0, 1e6, 1e12):
        scaled = GridField(surface.values * unit, tuple(s * unit for s in surface.spacing), True)
        state = solve(scaled, E_STAR / unit, pressure=0.005 * E_STAR / unit)
        if not _proved(state, 0.005 * E_STAR / unit):
            return wrong(f"unit {unit:g}: certificate {state.certificate:.1e}")
        areas.add(np.count_nonzero(state.contact))
    same = max(areas) - min(areas) <= 1
    return right("the same contact to the sample") if same else wrong(f"samples {areas}")


def flat_surface() -> Outcome:
    """A flat surface: everything touches at once."""
    flat = GridField(np.zeros((16, 16)), (MICRON, MICRON), periodic=True)
    said = refusal(lambda: solve(flat, E_STAR, pressure=1e3))
    if said is not None:
        return Outcome("refused", said)
    state = solve(flat, E_STAR, pressure=1e3)
    full = state.contact_area_fraction == 1 and np.allclose(state.pressure.values, 1e3, rtol=1e-12)
    return right("full contact, uniform pressure") if full else wrong(str(state))


def one_mode() -> Outcome:
    """A single wave, from a hair's load to full contact."""
    n = 256
    wave = np.cos(2 * np.pi * np.arange(n) / n)
    surface = GridField(np.repeat(wave[:, None], 4, 1) * MICRON, (MICRON, MICRON), periodic=True)
    full = np.pi * E_STAR * MICRON / (n * MICRON)
    for ratio in (1e-3, 0.1, 0.5, 0.9, 0.999, 1.001):
        area = solve(surface, E_STAR, pressure=ratio * full).contact_area_fraction
        exact = 2 / np.pi * np.arcsin(np.sqrt(min(1.0, ratio)))
        # Half a sample at each of the two edges.
        if abs(area - exact) > 1.01 / n:
            return wrong(f"p/p* = {ratio:g}: area {area:.4f}, exactly {exact:.4f}")
    return right("Westergaard's contact width to half a sample at every load")


def hurst_exponents() -> Outcome:
    """Hurst exponents 0.05 to 1, and beyond."""
    for hurst in (0.05, 0.3, 0.8, 1.0):
        surface = rough((128, 128), hurst)
        found = fitted_hurst(surface, 32 * MICRON, 5 * MICRON)
        if abs(found - hurst) > 0.15 or not _proved(solve(surface, E_STAR, pressure=5e4)):
            return wrong(f"H = {hurst}: the sample's spectrum has {found:.2f}")
    said = refusal(lambda: rough(hurst=1.2))
    if said is None:
        return wrong("H = 1.2 was not refused")
    return right(f"spectrum falls as asked, contact certified; H = 1.2: {said}")


def shortest_waves() -> Outcome:
    """Shortest wavelength one sample, and below."""
    state = solve(rough(short=1.0), E_STAR, pressure=5e4)
    said = refusal(lambda: rough(short=0.5))
    if not _proved(state):
        return wrong(f"certificate {state.certificate:.1e}")
    told = "below one sample: " + (said or "taken for what the grid holds")
    return right(f"certified at one sample; {told}")


def all_but_one() -> Outcome:
    """Contact areas 0 and 1 - one sample, elastic and bearing."""
    surface = rough()
    one = 1 / surface.values.size
    for area in (0.0, 1 - one):
        elastic = solve(surface, E_STAR, area_fraction=area).contact_area_fraction
        cut = bearing(surface, area_fraction=area).contact_area_fraction
        # The highest point always touches; the elastic area is reached to 1 part in 1000.
        if abs(elastic - area) > 1e-3 + one or abs(cut - area) > one:
            return wrong(f"asked for {area:.5f}: elastic {elastic:.5f}, bearing {cut:.5f}")
    return right("reached to one sample (bearing) and 1 part in 1000 (elastic)")


def odd_shapes() -> Outcome:
    """Surfaces of 3 × 3, of primes, and of Lx/Ly = 1000."""
    rng = np.random.default_rng(0)
    for shape in ((3, 3), (31, 37), (2000, 2), (1, 64)):
        surface = GridField(rng.normal(size=shape) * MICRON, (MICRON, MICRON), periodic=True)
        state = solve(surface, E_STAR, pressure=1e6)
        if not _proved(state, 1e6):
            return wrong(f"{shape}: certificate {state.certificate:.1e}")
    return right("certificate kept")


def iterations_too_few() -> Outcome:
    """A tolerance that one iteration cannot reach."""
    said = refusal(lambda: solve(rough(), E_STAR, pressure=5e4, max_iterations=1))
    return Outcome("refused", said) if said else wrong("an unconverged contact was returned")


def tolerance_below_rounding() -> Outcome:
    """Certificates of 1e-12, and of 1e-18, below the rounding of double precision."""
    surface, reached = rough(), 1.0
    for tolerance in (1e-9, 1e-12, 1e-15, 1e-18):
        said = refusal(
            lambda tolerance=tolerance: solve(surface, E_STAR, pressure=5e4, tolerance=tolerance)
        )
        if said is not None:
            return limited(f"reached down to {reached:g}; at {tolerance:g}: {said}")
        reached = tolerance
    return right(f"reached down to {reached:g}")
