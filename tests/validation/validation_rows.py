"""The numbers of docs/validation.md, where their claims and sources stand.

    python tests/validation/validation_rows.py [NAME ...]      # compute rows and print them

Each row is a short function on the public interface. It is computed twice: for the page, and with
fewer seeds or samples in the tests. Its two numbers have errors of their own: bounds of the flow
(guaranteed), the change on a grid of half the spacing, the scatter over seeds, or what the source
states.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from math import inf, log10, pi, prod, sqrt
from pathlib import Path

import numpy as np
from scipy.integrate import quad

from fem_seal import Patch, Scene
from fem_seal import solve as solve_scene
from fem_seal.contact import ElasticSolid, Load, press
from fem_seal.film import GridFilm
from fem_seal.flow import FlowSettings, leak_rate
from fem_seal.grid import GridField
from fem_seal.leak_rate import LeakRate
from fem_seal.patch import Given
from fem_seal.surface import Spectrum, rms_slope, self_affine
from fem_seal.threshold import threshold
from fem_seal.verification.cross_validation import StudiedGap, compare
from fem_seal.verification.exact_cases import CASES

sys.path.extend(str(Path(__file__).parents[1] / name) for name in ("", "benchmarks"))

from known_answers import Wave, area_by_law
from peer_codes import (
    CONTACT_PYTHON,
    FLOW_PYTHON,
    contact,
    flow,
    gap_of,
    linear_samples,
)

UNIT = {"viscosity": 1 / 12, "pressure_drop": 1.0}  # K = g³


@dataclass(frozen=True)
class Number:
    """A number and the interval in which it is known to lie, or said to."""

    value: float
    lower: float
    upper: float

    @classmethod
    def exact(cls, value: float) -> "Number":
        """A number without an error that counts."""
        return cls(value, value, value)

    @classmethod
    def within(cls, value: float, error: float) -> "Number":
        """value ± error."""
        return cls(value, value - abs(error), value + abs(error))

    @classmethod
    def of_seeds(cls, values: Sequence[float], error: float = 0.0) -> "Number":
        """Mean over seeds, ± two standard errors and a further error."""
        scatter = 2 * np.std(values, ddof=1) / sqrt(len(values))
        return cls.within(float(np.mean(values)), scatter + error)

    @property
    def half(self) -> float:
        """Half the width of the interval."""
        return (self.upper - self.lower) / 2

    def __str__(self) -> str:
        size = max(abs(self.lower), abs(self.upper)) if self.upper < inf else abs(self.value)
        if self.upper == inf:
            return f"above {self.lower:.4g}"
        part = 2 * self.half / size if size else 0.0
        digits = min(7, max(3, 2 - round(log10(part)))) if part > 0 else 6
        if self.half == 0:
            return f"{self.value:.{digits}g}"
        return f"{self.value:.{digits}g} ({self.lower:.{digits}g} to {self.upper:.{digits}g})"


@dataclass(frozen=True)
class Row:
    """The two numbers of a claim."""

    ours: Number
    reference: Number

    @property
    def least_shown(self) -> str:
        """Sum of both errors over the reference: a smaller deviation would not show."""
        if self.reference.upper == inf:
            return "its sign"
        both = self.ours.half + self.reference.half
        return f"{100 * both / abs(self.reference.value):.2g} %"

    @property
    def distance(self) -> float:
        """Distance of the two intervals' middles in units of the sum of their half-widths.

        The intervals overlap if it lies between -1 and 1. A reference without an upper end counts
        from its lower one: 0 above it, infinite below.
        """
        if self.reference.upper == inf:
            return 0.0 if self.ours.lower >= self.reference.lower else -inf
        ours, theirs = self.ours, self.reference
        apart = (ours.lower + ours.upper - theirs.lower - theirs.upper) / 2
        both = self.ours.half + self.reference.half
        # Two numbers without errors agree if they are the same to rounding.
        return apart / max(both, 1e-12 * abs(self.reference.value))


def of_bounds(leak: LeakRate) -> Number:
    """Leak rate with its guaranteed bounds."""
    lower, upper = leak.bounds
    return Number(leak.value, lower, upper)


def on_squares(name: str, squares: int, rtol: float) -> Number:
    """Leak rate of an exact case: geometric mean over its films, and of their bounds."""
    leaks = [
        leak_rate(film, FlowSettings(rtol=rtol, **UNIT)) for film in CASES[name].films(squares)
    ]
    ends = zip(*((leak.value, *leak.bounds) for leak in leaks), strict=True)
    return Number(*(prod(values) ** (1 / len(leaks)) for values in ends))


def represented(name: str, page: bool) -> Number:
    """Leak rate of a gap that its samples represent exactly: the bounds must enclose the answer."""
    return on_squares(name, 16, 0.003 if page else 0.03)


def sampled(name: str, page: bool, order: int) -> Number:
    """Leak rate of a gap interpolated between samples, whose error falls with a known order.

    From the grid before to this one the error falls by (2^order - 1) times what is left. Steps of a
    round edge make that irregular: the larger of two such falls counts, three times.
    """
    n, rtol = (128, 0.003) if page else (32, 0.03)
    first, second, fine = (on_squares(name, n // part, rtol) for part in (4, 2, 1))
    falls = abs(second.value - first.value) / 2**order, abs(fine.value - second.value)
    left = 3 * max(falls) / (2**order - 1)
    return Number(fine.value, fine.lower - left, fine.upper + left)


def closed_form(name: str, order: int | None, page: bool) -> Row:
    """An exact case; `order` is that of sampling, if the samples are not exact."""
    ours = represented(name, page) if order is None else sampled(name, page, order)
    return Row(ours, Number.exact(CASES[name].exact))


def rough_film(n: int, area: float, seed: int = 3) -> GridFilm:
    """Elastic contact, shortest wavelength eight samples."""
    heights = self_affine(Spectrum(0.8, n / 2, 8), (n, n), (n, n), rms_slope=0.1, seed=seed)
    gap = press(heights, SOLID, Load("area_fraction", area)).gap
    return GridFilm(GridField(gap.values / gap.values.max(), gap.spacing, True), "periodic")


def finite_differences(page: bool) -> Row:
    """A network of resistors, whose error is its change from the grid before."""
    film = rough_film(64, 0.2)
    setting = FlowSettings(**UNIT, rtol=0.02 if page else 0.1)
    rows, bracket = compare([StudiedGap.of_film(film, setting)], ("linear-gap", "adaptive"))[0]
    theirs = [row for row in rows if row.method == "FD linear-gap"][-1]
    return Row(
        Number(bracket.value, bracket.lower, bracket.upper),
        Number.within(theirs.value, theirs.band * theirs.value),
    )


SOLID, UNIT_WAVE = ElasticSolid(1.0), Wave(1.0, 1.0, 1.0)  # p* = π


def wave(n: int) -> GridField:
    """Heights cos(2πy), one sample along the flow for each across."""
    return GridField(np.tile(np.cos(2 * np.pi * np.arange(n) / n), (8, 1)), (1 / n, 1 / n), True)


def westergaard_area(page: bool) -> Row:
    """sin²(π a/λ) = p/p*, p* = π E* Δ/λ, contact half-width a."""
    n, load = 512 if page else 128, 0.35
    state = press(wave(n), SOLID, Load("pressure", load * pi))
    return Row(
        Number.within(state.contact_area_fraction, 1.3 / n),
        Number.exact(UNIT_WAVE.area(load * UNIT_WAVE.full)),
    )


def westergaard_leak(page: bool) -> Row:
    """Flow in the valleys of a wave."""
    n, load = 256 if page else 64, 0.35

    def leak(samples: int) -> Number:
        gap = press(wave(samples), SOLID, Load("pressure", load * pi)).gap
        leak = leak_rate(GridFilm(gap, "periodic"), FlowSettings(rtol=0.01, **UNIT))
        of_a_square = gap.size[0] / gap.size[1]
        return Number(*(of_a_square * end for end in (leak.value, *leak.bounds)))

    coarse, fine = leak(n), leak(2 * n)
    change = abs(fine.value - coarse.value)
    return Row(
        Number(fine.value, fine.lower - change, fine.upper + change),
        # Over K of a channel of height 1, 1/(12 η).
        Number.exact(UNIT_WAVE.conductivity(load * UNIT_WAVE.full, 1 / 12)),
    )


def hertz(page: bool) -> Row:
    """a³ = 3 F R/(4 E*)."""
    n, radius = (192, 24) if page else (96, 12)
    centred = np.arange(n) - n // 2
    sphere = GridField(-np.add.outer(centred**2, centred**2) / 2e4, (1, 1), True)
    load = 4 * radius**3 / (3 * 1e4)
    state = press(sphere, SOLID, Load("pressure", load / n**2))
    return Row(
        Number.within(sqrt(state.contact.sum() / pi) / radius, 0.5 / radius), Number.exact(1.0)
    )


SAMPLES, SIZE = 512, 100e-6  # of the Contact Mechanics Challenge


@cache
def twins(seeds: int) -> list[GridField]:
    """Surfaces with the challenge's spectrum, on every fourth of 2048 samples.

    The rms height, which scatters by a tenth, is that of the real surface on 512² samples.
    """
    spectrum = Spectrum(0.8, SIZE, 0.1e-6, rolloff_wavelength=20e-6)
    surfaces = []
    for seed in range(1, seeds + 1):
        fine = self_affine(spectrum, (2048, 2048), (SIZE, SIZE), rms_slope=1.0, seed=seed)
        values = fine.values[::4, ::4]
        values = values * (0.7621658676e-6 / values.std())
        surfaces.append(GridField(values, (SIZE / SAMPLES, SIZE / SAMPLES), True))
    return surfaces


def mean_curvature(surface: GridField) -> float:
    """Rms of half the five-point Laplacian."""
    v, d = surface.values, surface.spacing[0]
    around = sum(np.roll(v, step, axis) for step in (1, -1) for axis in (0, 1))
    return float(np.sqrt(np.mean((around - 4 * v) ** 2)) / (2 * d**2))


def full_contact(surface: GridField) -> float:
    """Σ q |h_q|²: the energy of full contact is E*/4 of it for each area."""
    n, d = surface.shape[0], surface.spacing[0]
    q = 2 * pi * np.hypot(np.fft.fftfreq(n, d)[:, None], np.fft.fftfreq(n, d)[None, :])
    return float(np.sum(q * np.abs(np.fft.fft2(surface.values) / n**2) ** 2))


def kappa(surface: GridField) -> float:
    """(A/A₀) E* h'rms/p under 0.25 MPa, E* = 25 MPa."""
    state = press(surface, ElasticSolid(25e6), Load("pressure", 0.25e6))
    return state.contact_area_fraction * surface.slope_between_samples() * 100


def challenge(measure: Callable[[GridField], float], theirs: Number, page: bool) -> Row:
    """A number of the challenge's surface, one of all with this spectrum."""
    values = [measure(surface) for surface in twins(6 if page else 3)]
    ours = Number.within(float(np.mean(values)), 2 * float(np.std(values, ddof=1)))
    return Row(ours, theirs)


def gap_exponent(page: bool) -> Row:
    """At an edge of contact g ~ x^(3/2), so that the density of small gaps goes as g^(-1/3)."""
    seeds, slope = range(1, 5 if page else 3), 0.1

    def exponent(short: int, seed: int) -> float:
        spectrum = Spectrum(0.8, 256, short)
        heights = self_affine(spectrum, (512, 512), (512, 512), rms_slope=slope, seed=seed)
        gaps = np.sort(press(heights, SOLID, Load("pressure", 0.1 * slope)).gap.values, axis=None)
        # Numbers of gaps in two decades' halves, in units of slope × shortest wavelength.
        ends = np.searchsorted(gaps, np.array([1e-3, sqrt(1e-5), 1e-2]) * slope * short)
        first, second = np.diff(ends)
        return np.log(second / first) / np.log(sqrt(10)) - 1

    fine, coarse = ([exponent(short, seed) for seed in seeds] for short in (64, 32))
    return Row(Number.of_seeds(fine, abs(np.mean(fine) - np.mean(coarse))), Number.exact(-1 / 3))


def area_per_load(page: bool) -> Row:
    """κ = (A/A₀) E* h'rms/p of the area corrected for its perimeter, at light load."""
    values = []
    for seed in range(1, 7 if page else 4):
        heights = self_affine(Spectrum(0.8, 64, 8), (256, 256), (256, 256), rms_slope=1, seed=seed)
        state = press(heights, SOLID, Load("pressure", 0.03 * rms_slope(heights)))
        values.append(state.contact_area_corrected / 0.03)
    return Row(Number.of_seeds(values), Number(2.0, sqrt(8 / pi), sqrt(2 * pi)))


def persson_area(page: bool) -> Row:
    """Corrected area over the area of Wang and Müser's theory at A/A₀ of about 0.25."""
    ratios, load = [], 0.13
    for seed in range(1, 5 if page else 3):
        heights = self_affine(Spectrum(0.8, 64, 8), (256, 256), (256, 256), rms_slope=1, seed=seed)
        state = press(heights, SOLID, Load("pressure", load))
        ratios.append(state.contact_area_corrected)
    theory = [area_by_law(load, 1.0, law) for law in ("wang-mueser", "persson")]
    return Row(Number.of_seeds(ratios), Number(theory[0], min(theory), max(theory)))


def patch(**sections: dict | None) -> Patch:
    """A patch of rubber under water; sections replace those below, None leaves one out."""
    mapping = {
        "solid": {"contact_modulus": 1e7},
        "contact": {"pressure": 1.5e5},
        "fluid": {"viscosity": 1e-3},
        "flow": {"pressure_drop": 1e5, "sides": "periodic", "lift": "none", "rtol": 0.05},
        "output": {"products": ["leak_rate"]},
        **sections,
    }
    return Patch(
        Scene.from_mapping({name: fields for name, fields in mapping.items() if fields is not None})
    )


def roughness(n: int, seed: int, **fields: object) -> dict:
    """A [surface] of 0.1 mm with n samples a side, eight longest and n/4 shortest wavelengths."""
    return {
        **{"kind": "self-affine", "shape": [n, n], "size": [1e-4, 1e-4], "hurst": 0.8},
        **{"long_wavelength": 1e-4 / 8, "short_wavelength": 4e-4 / n, "rms_slope": 0.1},
        **{"seed": seed, **fields},
    }


def threshold_area(model: str, theirs: Number, page: bool) -> Row:
    """The contact area at which a model seals."""
    contacts = {"bearing": {"model": "bearing", "area_fraction": 0.4}, "gfmd": {"pressure": 1.5e5}}
    solid = {"contact_modulus": 1e7} if model == "gfmd" else None
    areas = []
    for seed in range(1, 9 if page else 4):
        surface = roughness(256 if page else 128, seed)
        found = threshold(patch(surface=surface, contact=contacts[model], solid=solid))
        areas.append((found.area_leaking + found.area_sealed) / 2)
    return Row(Number.of_seeds(areas), theirs)


def skewness(page: bool) -> Row:
    """Heights h and -h have one spectrum; peaks keep the faces further apart than pits."""
    n, load = 128, 0.05
    waves = self_affine(Spectrum(0.8, n / 2, 8), (n, n), (n, n), rms_height=1, seed=1).values
    peaks = waves + 0.3 * (waves**2 - 1)
    leaks = []
    for sign in (1, -1):
        heights = GridField(sign * (peaks - peaks.mean()), (1, 1), True)
        film = GridFilm(
            press(heights, SOLID, Load("pressure", load * rms_slope(heights))).gap,
            "periodic",
        )
        leaks.append(of_bounds(leak_rate(film, FlowSettings(rtol=0.05 if page else 0.3, **UNIT))))
    up, down = leaks
    return Row(
        Number(up.value / down.value, up.lower / down.upper, up.upper / down.lower),
        Number(inf, 1.0, inf),
    )


def helium_over_air(height: float, inlet: float, theirs: float, page: bool) -> Row:
    """Ratio of two gases from `inlet` [Pa] into a vacuum, with slip of first order."""
    leaks = []
    for viscosity, mass in ((19.6e-6, 4.0026e-3), (18.2e-6, 28.96e-3)):
        fluid = {"kind": "gas", "viscosity": viscosity, "molar_mass": mass, "temperature": 293}
        surface = roughness(64, 1, long_wavelength=2.5e-5, short_wavelength=6.25e-6)
        surface.pop("rms_slope")
        gas = patch(
            surface={**surface, "rms_height": height},
            solid=None,
            contact={"model": "bearing", "area_fraction": 0.2},
            fluid={**fluid, "slip": "first-order"},
            flow={
                **{"inlet_pressure": inlet, "outlet_pressure": 0.0, "sides": "periodic"},
                "rtol": 0.02 if page else 0.1,
            },
        )
        leaks.append(of_bounds(gas.leak_rate))
    helium, air = leaks
    return Row(
        Number(helium.value / air.value, helium.lower / air.upper, helium.upper / air.lower),
        Number.exact(theirs),
    )


WAVE, VALLEY = 1e-7, 1e-5  # Δ and λ [m] of waves along the flow
FULL = pi * 1e7 * WAVE / VALLEY  # pressure that flattens them, p* = π E* Δ/λ


def channel(
    load: float, ends: tuple[float, float], shape: tuple[int, int], lift: str = "resolved"
) -> Patch:
    """Waves along the flow, 64 wavelengths long; pressures over p*, ambient 0."""
    nx, ny = shape
    heights = np.tile(WAVE * np.cos(2 * pi * np.arange(ny) / ny), (nx, 1))
    surface = GridField(heights, (64 * VALLEY / nx, VALLEY / ny), True)
    flow = {"inlet_pressure": ends[0] * FULL, "outlet_pressure": ends[1] * FULL, "rtol": 0.02}
    flow |= {"ambient_pressure": 0.0, "sides": "periodic", "lift": lift}
    scene = patch(surface=roughness(64, 1), contact={"pressure": load * FULL}, flow=flow).scene
    return Patch(scene, given=Given(surface=surface))


def sealing_load(page: bool) -> Row:
    """A wavy channel closes at p_in + p*, whatever the pressure at the outlet."""
    leaking, sealed = [], []
    for ends in [(0.2, 0.1), (0.7, 0.6), (0.7, 0.5)][: 3 if page else 1]:
        tried = {k: channel(ends[0] + k, ends, (64, 32)) for k in (0.85, 1.03)}
        states = {k: found.leak_rate.value == 0 for k, found in tried.items()}
        leaking.append(max((k for k, closed in states.items() if not closed), default=0.0))
        sealed.append(min((k for k, closed in states.items() if closed), default=inf))
    return Row(
        Number((min(leaking) + max(sealed)) / 2, min(leaking), max(sealed)), Number.exact(1.0)
    )


def lifted_channel(page: bool) -> Row:
    """Q = (W/L) ∫ K(P₀ - p) dp over its value without lift, K(P₀) p_in; K by Westergaard."""
    load, inlet = 0.5, 0.4

    def gain(n: int) -> Number:
        ends = (inlet, 0.0)
        lifted, dry = (channel(load, ends, (4 * n, n), kind) for kind in ("resolved", "none"))
        (low, high), (least, most) = lifted.leak_rate.bounds, dry.leak_rate.bounds
        claimed = lifted.lifted.error
        value = lifted.leak_rate.value / dry.leak_rate.value
        return Number(value, low / most * (1 - claimed), high / least * (1 + claimed))

    coarse, fine = gain(16), gain(32)
    change = abs(fine.value - coarse.value)
    total, _ = quad(lambda p: UNIT_WAVE.conductivity((load - p) * pi, 1 / 12), 0, inlet)
    return Row(
        Number(fine.value, fine.lower - change, fine.upper + change),
        Number.exact(total / (inlet * UNIT_WAVE.conductivity(load * pi, 1 / 12))),
    )


def loses_contact(patch_under: Callable[[float], Patch], tried: Sequence[float]) -> Number:
    """Inlet pressure over load between the last with contact and the first without."""
    states = {drop: patch_under(drop).lifted for drop in tried}
    touches = {drop: s.contact is not None and not s.floats for drop, s in states.items()}
    last = max((drop for drop, there in touches.items() if there), default=0.0)
    first = min((drop for drop, there in touches.items() if not there), default=inf)
    return Number((last + first) / 2, last, first)


def stiff_wedge(page: bool) -> Row:
    """A gap falling from g to g/2 along the flow, a peak that touches: p_f is 2/3 of p_in."""
    n, load = 64 if page else 32, 1e5

    def under(drop: float) -> Patch:
        values = -np.repeat(1e-5 * (1 - np.arange(n) / (2 * n)), n).reshape(n, n)
        values[n // 2, n // 2] = 0.0
        flow = {"pressure_drop": drop * load, "sides": "periodic", "lift": "resolved", "rtol": 0.1}
        solid, contact = {"contact_modulus": 1e12}, {"pressure": load}
        scene = patch(surface=roughness(64, 1), solid=solid, contact=contact, flow=flow).scene
        return Patch(scene, given=Given(surface=GridField(values, (1e-3 / n, 1e-3 / n), True)))

    return Row(loses_contact(under, (0.99, 1.3, 1.47, 1.53, 1.7)), Number.exact(1.5))


def lift_off(page: bool) -> Row:
    """Inlet pressure over the load, outlet ambient, at which a rough patch loses contact."""

    def of_seed(seed: int) -> Number:
        def under(drop: float) -> Patch:
            flow = {"pressure_drop": drop * 1e5, "sides": "periodic", "lift": "resolved"}
            surface = roughness(32, seed, long_wavelength=5e-5)
            contact, flow = {"pressure": 1e5}, {**flow, "rtol": 0.2}
            return patch(surface=surface, contact=contact, flow=flow)

        return loses_contact(under, (0.99, 1.3, 1.6, 1.99))

    found = [of_seed(seed) for seed in range(1, 4 if page else 2)]
    lower, upper = min(n.lower for n in found), max(n.upper for n in found)
    return Row(Number((lower + upper) / 2, lower, upper), Number(1.0, 1.0, 2.0))


def lifted_rate(n: int) -> Number:
    """Leak rate [10⁻¹⁵ m³/s] of one lifted patch on n² samples, with all counted errors."""
    surface = roughness(n, 1, long_wavelength=5e-5, short_wavelength=1e-5)
    flow = {"pressure_drop": 1e5, "sides": "periodic", "lift": "resolved", "rtol": 0.05}
    headline = solve_scene(patch(surface=surface, flow=flow).scene).headline
    return Number(*(1e15 * end for end in (headline.value, headline.lower, headline.upper)))


def lifted_grids(page: bool) -> Row:
    """The same lifted patch on more samples; errors are those that each claims."""
    coarse, fine = lifted_rate(64), lifted_rate(256 if page else 128)
    return Row(coarse, fine)


def peer_contact(code: str, page: bool) -> Row:
    """A contact that another code solves as well; both pressures are judged alike."""
    n, load = 256, 0.1
    heights = self_affine(Spectrum(0.8, n / 4, 8), (n, n), (n, n), rms_slope=1, seed=1)

    def area(pressure: np.ndarray) -> Number:
        gap, _ = gap_of(pressure, heights, load)
        near = float(np.mean(gap < 1e-4 * heights.values.std()))
        pressed = float(np.mean(pressure > 0))
        return Number(pressed, min(pressed, near), max(pressed, near))

    ours = press(heights, SOLID, Load("pressure", load)).pressure.values
    return Row(area(ours), area(contact(code, heights, load)[0]))


def peer_flow(page: bool) -> Row:
    """reynoldsflow on its own grids of the same gap; its error is the change from half of them."""
    film = rough_film(64, 0.2)
    leak = leak_rate(film, FlowSettings(rtol=0.02 if page else 0.1, **UNIT))
    coarse, fine = (flow(linear_samples(film.gap.values, k))["value"] for k in (4, 8))
    return Row(of_bounds(leak), Number.within(fine, fine - coarse))


# Exact cases of the flow; the order of sampling where their samples are not exact.
EXACT = {
    **dict.fromkeys(("checkerboard", "four-phases", "duality")),
    **dict.fromkeys(("cosine-across", "cosine-along", "smooth-checkerboard"), 2),
    "discs": 1,
}
ROWS: dict[str, Callable[[bool], Row]] = {
    "channel": partial(closed_form, "series-channel", None),
    **{name: partial(closed_form, name, order) for name, order in EXACT.items()},
    "finite-differences": finite_differences,
    "westergaard-area": westergaard_area,
    "westergaard-leak": westergaard_leak,
    "hertz": hertz,
    "challenge-slope": partial(challenge, GridField.slope_between_samples, Number.exact(0.7336383)),
    "challenge-curvature": partial(
        challenge, lambda surface: 1e6 / mean_curvature(surface), Number.exact(0.39854)
    ),
    "challenge-energy": partial(
        challenge,
        lambda surface: 1e6 * full_contact(surface),
        Number.exact(4e6 * 39.13343569623426 * 0.05 / 25e6),
    ),
    "challenge-kappa": partial(challenge, kappa, Number.within(2.34, 0.07)),
    "gap-exponent": gap_exponent,
    "area-per-load": area_per_load,
    "persson-area": persson_area,
    "bearing-threshold": partial(threshold_area, "bearing", Number.within(0.5, 0.02)),
    "elastic-threshold": partial(threshold_area, "gfmd", Number.within(0.42, 0.05)),
    "skewness": skewness,
    "helium-molecular": partial(helium_over_air, 5e-7, 1.0, sqrt(28.96 / 4.0026)),
    "helium-viscous": partial(helium_over_air, 5e-4, 1e5, 18.2 / 19.6),
    "sealing-load": sealing_load,
    "lifted-channel": lifted_channel,
    "stiff-wedge": stiff_wedge,
    "lift-off": lift_off,
    "lifted-grids": lifted_grids,
}
PEER_ROWS: dict[str, Callable[[bool], Row]] = {
    "tamaas": partial(peer_contact, "tamaas"),
    "contact-mechanics": partial(peer_contact, "contact-mechanics"),
    "reynoldsflow": peer_flow,
}
if CONTACT_PYTHON.exists() and FLOW_PYTHON.exists():
    ROWS |= PEER_ROWS


def main(names: list[str]) -> None:
    """Print some rows, or all."""
    for name in names or ROWS:
        row = ROWS[name](True)
        print(f"{name}: {row.ours} | {row.reference} | {row.distance:+.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
