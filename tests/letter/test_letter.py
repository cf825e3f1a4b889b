"""The letter's figures: known limits of what they plot, and runs that can resume."""

import json
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from fem_seal.cli import main, parser
from fem_seal.cli.letter import plan_of
from fem_seal.contact import solve
from fem_seal.film import GridFilm
from fem_seal.finite_difference.cascade import first_guess, initial_error
from fem_seal.finite_difference.relaxation import energy, relax
from fem_seal.finite_difference.stencil import flow_grid
from fem_seal.letter import campaign, rows
from fem_seal.letter.campaign import AREAS, Plan, letter
from fem_seal.letter.cascade_start import cascade_start
from fem_seal.letter.flow_points import (
    LINKS,
    GapDistribution,
    GridPoint,
    certified,
    flow_point,
    grid_point,
)
from fem_seal.letter.page import page
from fem_seal.letter.persson_curve import SampledSpectrum, persson_curve
from fem_seal.letter.pictures import FlowMeasures, decades, flow_picture_data
from fem_seal.letter.seed_thresholds import Search
from fem_seal.letter.surfaces import (
    CONTACT_MODULUS,
    MODELS,
    PITCH,
    PRESSURE_DROP,
    SLOPE,
    VISCOSITY,
    PressedSurface,
    RoughCase,
    at_area,
)
from fem_seal.points import Work
from fem_seal.surface import Spectrum, rms_slope
from fem_seal.theory.persson import contact_area, gap_distribution, persson_state
from fem_seal.theory.quadrature import log_grid

# Waves of 8 samples and more: finite differences and linear elements resolve the same gap.
SMOOTH = RoughCase(64, short=8, long=0.25)
RTOL = 0.1


@cache
def point(model, area, seed=1):
    return flow_point(SMOOTH, model, seed, area, rtol=RTOL)


def test_first_contact_is_the_same_for_both_models():
    """No load, no deformation: both gaps are h_max - h."""
    surface = SMOOTH.surface(1)
    cut, pressed = (at_area(surface, model, 0.0).gap.values for model in MODELS)
    np.testing.assert_allclose(cut, pressed, rtol=0, atol=1e-12 * cut.max())


@pytest.mark.parametrize("model", MODELS)
def test_leak_falls_as_contact_grows(model):
    """A gap that is nowhere wider leaks no more: the brackets must fall in order."""
    points = [point(model, area) for area in (0.0, 0.1, 0.2, 0.3)]
    for light, heavy in pairwise(points):
        assert heavy.lower < light.upper
        assert heavy.value < light.value
    assert all(p.lower <= p.upper <= p.lower * (1 + 1.1 * RTOL) for p in points)


def test_elastic_contact_leaks_less_than_a_cut_of_the_same_area():
    """The letter's finding far from percolation, beyond both brackets."""
    for area in (0.1, 0.2, 0.3):
        assert point("elastic", area).upper < point("bearing", area).lower


@pytest.mark.parametrize("area", [0.0, 0.1, 0.2])
def test_finite_differences_and_finite_elements_agree_within_both_bands(area):
    """Links enclose each other on every edge, so their leak rates do; that band meets the bracket.

    On this smooth gap, away from percolation; harmonic <= linear-gap <= arithmetic is Rayleigh's
    monotonicity and always true.
    """
    for model in MODELS:
        flow = point(model, area)
        low, middle, high = (flow.finite_difference[links] for links in LINKS)
        assert low <= middle * (1 + 1e-12) <= high * (1 + 1e-12)
        assert low <= flow.upper
        assert high >= flow.lower


def test_bruggeman_describes_the_cut():
    """Exact to second order in the gap's fluctuation: good to a factor of two at small area.

    The letter calls it very accurate; one surface of 64² has a spread of its own, which the
    other seeds show: the factor holds for each of three.
    """
    for seed in (1, 2, 3):
        flow = point("bearing", 0.1, seed)
        assert 0.5 < flow.gaps.leak_rate(2.0) / flow.value < 2


def test_bins_do_not_matter():
    """Bruggeman of the binned gaps against that of all samples.

    Bins are 7 % wide in g, 21 % in g³; a mean of g³ in each leaves an error of the second order,
    at most (0.21)²/12 = 0.4 %.
    """
    from fem_seal.theory.bruggeman import leak_rate

    gap = at_area(SMOOTH.surface(1), "elastic", 0.2).gap
    binned = GapDistribution.of(gap)
    assert sum(binned.weights) + binned.contact == pytest.approx(1)
    for dimension in (2.0, 1.8):
        exact = leak_rate(
            gap, viscosity=VISCOSITY, pressure_drop=PRESSURE_DROP, dimension=dimension
        )
        assert binned.leak_rate(dimension) == pytest.approx(exact, rel=4e-3, abs=0)


# Persson's curve.


@pytest.mark.parametrize(("short", "hurst"), [(1.0, 0.8), (1.0, 0.4), (1.5, 0.8), (4.0, 0.8)])
def test_sampled_spectrum_is_that_of_the_grid(short, hurst):
    """Its <h²>/<h'²> is the sum over the grid's own wave vectors.

    The sum is a midpoint rule over cells of 2π/L; it stands for the integral to the part of the
    cells that the two circles and the square cut, about 1/(q_l L/2π) = 1/8 of the longest waves
    for <h²> and 1 % for the slope. Tested: the slope.
    """
    case = RoughCase(256, hurst, short)
    spectrum = SampledSpectrum(case)
    k = np.fft.fftfreq(case.n, PITCH) * 2 * np.pi
    q = np.hypot(k[:, None], k[None, :])[np.abs(k) < 3.1 / PITCH][:, np.abs(k) < 3.1 / PITCH]
    step = 2 * np.pi / (case.n * PITCH)
    density = Spectrum(hurst, case.long * case.n * PITCH, short * PITCH).density(q)
    summed = np.sum(q**2 * density) * step**2
    # The last waves below Nyquist (3.1 of π) are left out of the sum: another 2 %.
    assert spectrum.mean_square_slope == pytest.approx(summed, rel=0.05)


def test_sampled_spectrum_of_a_resolved_surface_is_the_spectrum():
    case = RoughCase(256, short=4)
    whole = Spectrum(case.hurst, case.long * case.n * PITCH, case.short * PITCH)
    assert SampledSpectrum(case).mean_square_slope == pytest.approx(whole.moment(2), rel=1e-6)
    scaled = SampledSpectrum(case).scaled(SLOPE)
    assert scaled.mean_square_slope == pytest.approx(SLOPE**2)
    assert rms_slope(case.surface(1)) == pytest.approx(SLOPE)


def test_persson_area_is_an_error_function():
    """A/A0 = erf(√2 p/(E* h'rms)), and no leak from the threshold on."""
    from scipy.special import erf

    spectrum = SampledSpectrum(RoughCase(256, short=4))
    curve = persson_curve(spectrum, threshold=0.42, loads=(0.05, 0.1, 0.6))
    for state in curve:
        assert state.area == pytest.approx(erf(2**0.5 * state.load), rel=1e-6)
    assert curve[0].leak_rate > curve[1].leak_rate > 0
    assert curve[2].leak_rate == 0


def test_a_surface_has_its_own_spectrum():
    """Rms height of the surface to rounding; its slope to the width of the rings.

    Within a ring, a third of an octave, the power is distributed as in the ensemble: another
    distribution, by at most 10 % from one end to the other, moves the slope by under 1 %.
    """
    case = RoughCase(256, short=4)
    heights = set()
    for seed in (1, 2, 3):
        surface = case.surface(seed)
        spectrum = SampledSpectrum.of(case, surface)
        grid = log_grid(spectrum.wavenumbers, 12)
        square = grid.cumulative(lambda q, own=spectrum: 2 * np.pi * q * own.density(q))
        assert square.at_edges[-1] ** 0.5 == pytest.approx(surface.values.std(), rel=1e-5)
        assert spectrum.mean_square_slope**0.5 == pytest.approx(rms_slope(surface), rel=0.01)
        heights.add(round(float(surface.values.std()) * 1e9))
    assert len(heights) == 3


@cache
def letters_contact(load, seed=1):
    """Elastic contact of the letter's kind, λ_s = 1 sample, on 256² under a load."""
    return MODELS["elastic"].press(RoughCase(256).surface(seed), load, None, 1)


def test_area_against_load_is_that_of_the_continuum():
    """κ = (A/A0) E* h'rms/p: 2.0 to 2.2 of continuum treatments for the corrected area.

    They find 2.0 to 2.3 at light load, falling with it; counted samples lie well above.
    """
    for load in (0.03, 0.06, 0.09):
        state = letters_contact(load)
        assert 1.95 < state.contact_area_corrected / load < 2.3
        assert state.contact_area_fraction / load > 2.3


def test_the_reduced_energy_gives_the_area_of_the_continuum():
    """Wang and Müser's area against the simulated one: 7 %, where Persson's is 22 to 30 % low."""
    for load in (0.01, 0.03, 0.06, 0.09, 0.13):
        simulated = letters_contact(load).contact_area_corrected
        persson, reduced = (
            contact_area(load, 1.0, 1.0, law=law) for law in ("persson", "wang-mueser")
        )
        assert reduced == pytest.approx(simulated, rel=0.08)
        assert persson < 0.85 * simulated


def test_persson_leaks_on_the_corrected_area_what_the_flow_does():
    """With the surface's own spectrum and A* = 0.40: within a factor 1.5 over two decades.

    On counted area it would be too low by 4 and more at a load of 0.13.
    """
    case = RoughCase(256)
    loads = np.geomspace(0.02, 0.3, 12)
    curve = persson_curve(SampledSpectrum.of(case, case.surface(1)), loads=loads)
    leaking = [point for point in curve if point.leak_rate > 0]
    areas, logs = zip(*((p.area, np.log(p.leak_rate)) for p in leaking), strict=True)
    for load in (0.03, 0.06, 0.09, 0.13):
        state = letters_contact(load)
        certified_rate = certified(state.gap, 0.1).value

        def ratio(area, rate=certified_rate):
            return np.exp(np.interp(area, areas, logs)) / rate

        assert 1 / 1.6 < ratio(state.contact_area_corrected) < 1.6
    assert ratio(state.contact_area_fraction) < 1 / 4


def test_a_sealed_contact_is_compared_with_no_theory():
    first, leaking, sealed = (point("elastic", area) for area in (0.0, 0.2, 0.8))
    assert sealed.state == "sealed"
    curve = persson_curve(SampledSpectrum.of(SMOOTH, SMOOTH.surface(1)), loads=(0.05, 0.2))
    ratios = rows.persson_rows("persson", 1, curve, first.value)
    compared = rows.theory_rows([first, leaking, sealed], ratios)
    assert [row.area for row in compared] == [leaking.area]


def test_relative_to_its_mean_the_theory_has_the_broader_gaps():
    """Coefficient of variation of the open gaps, theory against simulation, load 0.06."""
    case = RoughCase(256)
    scaled = SampledSpectrum.of(case, case.surface(1)).scaled(SLOPE)
    state = persson_state(scaled, pressure=0.06 * SLOPE, contact_modulus=1.0)
    gap = np.linspace(1e-9, 3e-6, 6000)
    density = gap_distribution(state, gap)
    mass, mean = (float(np.sum(density * gap**k)) for k in (0, 1))
    mean /= mass
    theory = np.sqrt(float(np.sum(density * gap**2)) / mass - mean**2) / mean
    open_ = letters_contact(0.06).gap.values
    open_ = open_[open_ > 0]
    assert theory > open_.std() / open_.mean()


# The error of the contact grid, and the cascade.


def test_relaxation_takes_steps_as_the_root_of_the_side():
    """The letter's damped dynamics on 64² to 256² at λ_s = 1: exponent 1/2.

    A certificate is computed every 20 steps of about 115 to 225, so that the exponent between
    the ends is known to 2 × 20/115/ln 4 = 0.25 at worst, for each of two seeds.
    """
    for seed in (1, 2):
        steps = [
            solve(
                RoughCase(n).surface(seed),
                CONTACT_MODULUS,
                pressure=0.09 * CONTACT_MODULUS * SLOPE,
                solver="damped",
                tolerance=1e-6,
            ).iterations
            for n in (64, 256)
        ]
        assert np.log(steps[1] / steps[0]) / np.log(4) == pytest.approx(0.5, abs=0.25)


def test_warm_contacts_are_those_of_cold_ones():
    """The area to its tolerance of 1e-3, the pressure to what that leaves open: κ is near 2.2."""
    path = PressedSurface(RoughCase(64), "elastic", 1)
    for area in (0.0, 0.1, 0.15, 0.2):
        warm = path.at_area(area)
        cold = at_area(path.surface, "elastic", area)
        assert warm.contact_area_fraction == pytest.approx(area, abs=1e-3 * area + 1 / 64**2)
        assert warm.mean_pressure == pytest.approx(cold.mean_pressure, rel=3e-3)


def test_fig_2_as_numbers():
    """Total of the flow field against the certified leak rate; flow passes open parts alone.

    Elastic channels are narrower: they lie on a smaller part of the cell, and carry less.
    """
    flows = {}
    for model in MODELS:
        picture = flow_picture_data(SMOOTH, model, RTOL)
        measures = flows[model] = FlowMeasures.of(picture)
        leak = certified(picture.gap, RTOL)
        assert measures.total * SMOOTH.n * PITCH == pytest.approx(leak.value, rel=RTOL)
        assert measures.total < measures.body <= measures.peak
        assert min(measures.participation, measures.half) > 0
        assert max(measures.participation, measures.half) < 1 - measures.area
        assert measures.area == pytest.approx(0.2, abs=2e-3)
    cut, pressed = flows["bearing"], flows["elastic"]
    assert pressed.participation < cut.participation
    assert pressed.half < cut.half
    assert decades(flows, "total") > 0


def test_elastic_flow_is_reduced_in_total_most_of_all():
    """Elastic flow is more concentrated: its total falls most, its quantile less, its peak least.

    At the letter's λ_s = 1 and 256², with λ_l = L/8 and L/2: log10 of the ratios grows with the
    width of the spectrum. Brackets of 20 % leave 0.2/ln 10 = 0.09 of each.
    """
    reduced, narrower = {}, {}
    for long in (0.125, 0.5):
        case = RoughCase(256, long=long)
        flows = {m: FlowMeasures.of(flow_picture_data(case, m, 0.2)) for m in MODELS}
        total, body, peak = (decades(flows, name) for name in ("total", "body", "peak"))
        assert total > body > peak > 0
        reduced[long], narrower[long] = total, decades(flows, "participation")
    assert reduced[0.125] == pytest.approx(0.82, abs=0.1)
    assert reduced[0.5] > reduced[0.125] + 0.5
    assert narrower[0.5] > narrower[0.125] > 0.2


def test_the_cascade_gains_an_order_on_256_samples():
    """Energy of the start at A/A0 = 0.2, elastic: 9 times nearer there, 24 times on 512²."""
    start = cascade_start(RoughCase(256), "elastic", 0.2)
    assert 8 < start.energy_reduction < 12


def test_the_cascades_energy_needs_no_relaxed_pressure():
    """Excess over the elimination's leak rate is that over the relaxed energy, to 1e-12 of it."""
    gap = at_area(SMOOTH.surface(1), "elastic", 0.1).gap
    grid = flow_grid(GridFilm(gap, "periodic"), VISCOSITY, "linear-gap")
    quick, slow = initial_error(grid, pressure=False), initial_error(grid)
    guess = first_guess(grid)
    relaxed = relax(grid.network, grid.carrying, guess, tol=1e-12)
    excess = energy(grid.network, guess, grid.carrying) / relaxed.energy - 1
    assert quick.cascade_energy == slow.cascade_energy == pytest.approx(excess, rel=1e-9)
    assert quick.rms_reduction is None
    assert slow.rms_reduction > 1


def test_contact_grid_error_is_that_of_one_pressure():
    """Area and leak rate on n and 2n under one pressure; the raw area falls as samples shrink."""
    refined = grid_point(SMOOTH, 1, 0.2, rtol=0.2)
    assert refined.areas[0] == pytest.approx(0.2, rel=2e-3)
    assert refined.areas[1] < refined.areas[0]
    # A tenth of the raw change is left after the perimeter correction (docs/theory/contact.md).
    raw, corrected = (abs(a[1] - a[0]) for a in (refined.areas, refined.corrected))
    assert corrected < 0.5 * raw
    assert 0 < refined.contact_grid_error < 0.5


def test_three_contact_grids():
    """n, 2n and 4n under one pressure: changes fall by 2 or more, and add up with their signs."""
    refined = grid_point(SMOOTH, 1, 0.2, rtol=0.1, factors=(1, 2, 4))
    first, second, third = refined.values
    assert refined.contact_grid_error == pytest.approx(abs(np.log(third / first)), rel=1e-12)
    assert refined.last_change == pytest.approx(abs(np.log(third / second)), rel=1e-12)
    areas = np.diff(refined.areas)
    assert 2 * abs(areas[1]) < abs(areas[0])
    # The flow of each is known to a bracket of 10 %; the remaining error of the contact is smaller.
    assert refined.last_change < 0.1
    (row,) = rows.error_rows([refined], {1: first})
    assert (row.finest_factor, row.last_change) == (4, refined.last_change)
    assert row.current == 1


def test_a_grid_that_seals_has_no_finite_error():
    sealed = GridPoint(SMOOTH, 1, 0.4, 0.1, (1, 2), 1.0, (0.4, 0.4), (0.3, 0.3), (1, 0), (1, 0))
    assert sealed.contact_grid_error == np.inf
    (row,) = rows.error_rows([sealed], {1: 2.0})
    assert row.contact_grid is None
    assert row.last_change is None
    assert row.current == 0.5


def test_the_cascade_starts_better_than_the_mean_field():
    """At first contact, 8 samples a wave: bilinear interpolation is of second order, (2π/8)²/8."""
    start = cascade_start(SMOOTH, "elastic", 0.0)
    assert start.energy_reduction > 1 / (2 * np.pi / 8) ** 2
    assert start.rms_reduction > 1


# The whole run.

TINY = Plan(
    RoughCase(32, short=4, long=0.5),
    seeds=1,
    rtol=0.5,
    search=Search(resolution=0.02, edges=("open",), flow=False),
    areas={"bearing": (0.1, 0.2), "elastic": (0.1, 0.2)},
    refined=(0.1,),
    loads=(0.05, 0.1),
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("letter")
    return out, *letter(TINY, out)


def test_run_leaves_data_beside_every_figure(finished):
    out, result, data = finished
    names = {path.name for path in out.iterdir()}
    expected = {"letter.json", "fig3.csv", "fig3-persson.csv", "errors.csv", "percolation.csv"}
    assert expected <= names
    assert len([name for name in names if name.startswith(("fig1-", "fig2-"))]) == 4
    assert json.loads((out / "letter.json").read_text())["decades"] == result.decades
    assert len(data.currents) == 4


def test_numbers_are_over_first_contact(finished):
    """Normalised currents lie between 0 and 1: every contact leaks less than the first."""
    _, result, data = finished
    assert all(0 <= row.lower <= row.value <= row.upper < 1 for row in data.currents)
    assert result.agreement.compared == sum(row.value > 0 for row in data.currents)
    assert result.flows["bearing"].peak > 0


def test_page_says_what_the_record_says(finished):
    _, result, _ = finished
    text = page(result)
    bearing = next(row for row in result.thresholds if row.pair == "triangulation")
    assert f"| A*/A0, bearing | 0.50 ± 0.02 | {bearing.threshold:.3f} |" in text
    assert f"peak 10^{result.decades['peak']:.2f}" in text
    for row in result.differences:
        assert f"{row.difference:.3f}" in text
    assert {row.law for row in result.theory} == {"persson", "wang-mueser"}


def test_a_finished_run_computes_nothing_again(finished, monkeypatch):
    out, result, _ = finished

    def again(*args, **kwargs):
        pytest.fail("computed again")

    for name in ("flow_point", "grid_point", "cascade_start"):
        monkeypatch.setattr(campaign, name, again)
    monkeypatch.setattr(campaign.pictures, "certified", again)
    monkeypatch.setattr("fem_seal.letter.percolation.seed_thresholds", again)
    repeated, _ = letter(TINY, out)
    assert repeated.agreement == result.agreement
    assert repeated.thresholds == result.thresholds


def test_two_jobs_give_the_same_letter(tmp_path):
    """To the last digit: elastic points are a chain, whose warm starts one process makes."""
    swift = replace(TINY, refined=(), cascade=False, differences=False)
    one, two = (letter(swift, tmp_path / f"{n}", work=Work(jobs=n)) for n in (1, 2))
    assert one[0].thresholds == two[0].thresholds
    assert one[0].theory == two[0].theory
    assert one[1].currents == two[1].currents


def test_only_the_missing_point_is_computed(finished, monkeypatch):
    out, *_ = finished
    missing = out / "points" / f"flow-bearing-{TINY.case.name}-seed1-A0.2.json"
    before = json.loads(missing.read_text())
    missing.unlink()
    computed = []
    real = campaign.flow_point

    def counted(case, model, seed, area, **options):
        computed.append((model, area))
        return real(case, model, seed, area, **options)

    monkeypatch.setattr(campaign, "flow_point", counted)
    letter(TINY, out)
    assert computed == [("bearing", 0.2)]
    after = json.loads(missing.read_text())
    # Leak rates are of the order of 1e-15 m³/s: no absolute tolerance. The mesh may differ in the
    # last digits of its indicators, the bounds then by less than the bracket.
    assert after["lower"] == pytest.approx(before["lower"], rel=1e-3, abs=0)
    assert after["area"] == before["area"]


def test_parts_left_out_come_with_a_later_run(finished, tmp_path):
    """Without refined grids and cascade: the same letter but for these; then they are added."""
    _, result, _ = finished
    short = replace(TINY, refined=(), cascade=False)
    bare, data = letter(short, tmp_path)
    assert bare.errors == bare.cascade == data.errors == []
    assert not (tmp_path / "errors.csv").exists()
    assert "cascade" not in page(bare)
    # Without finite differences the points go by another name, and all are computed.
    swift, _ = letter(replace(short, differences=False), tmp_path)
    assert swift.agreement.compared == 0
    assert "finite differences" not in page(swift)
    assert swift.thresholds == bare.thresholds
    assert bare.thresholds == result.thresholds
    whole, _ = letter(TINY, tmp_path)
    assert len(whole.cascade) == 3
    assert (tmp_path / "errors.csv").exists()


@pytest.mark.render
def test_figures_are_written(finished, tmp_path):
    from fem_seal.render import letter as figures

    _, _, data = finished
    paths = [
        *figures.contact_figure(data.contacts, tmp_path, panel_side=120),
        *figures.flow_figure(data.flows, tmp_path, panel_side=120),
        *figures.current_figure(data.currents, data.persson, tmp_path),
        *figures.error_figure(data.errors, tmp_path),
    ]
    refined = [replace(row, finest_factor=4) for row in data.errors]
    (tmp_path / "refined").mkdir()
    paths += figures.error_figure(refined, tmp_path / "refined")
    assert {path.suffix for path in paths} == {".png", ".pdf"}
    assert all(path.stat().st_size > 1000 for path in paths)


def test_points_and_edges_are_chosen():
    """The parts of the run at 2048², whose other points are those of any run."""
    command = "letter --bearing-areas 0.05,0.1 --edges open --no-flow --skip grids cascade"
    plan = plan_of(parser().parse_args(command.split()))
    assert plan.areas == {"bearing": (0.05, 0.1), "elastic": AREAS["elastic"]}
    assert plan.search == Search(edges=("open",), flow=False)
    assert (plan.refined, plan.cascade) == ((), False)
    usual = plan_of(parser().parse_args(["letter"]))
    assert usual == Plan(usual.case)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--seeds 0", "seeds"),
        ("--size 4", "at least 8"),
        ("--short 300", "cut-offs"),
        ("--rtol -1", "rtol"),
        ("--elastic-areas 0.2,1.5", "elastic areas must lie in (0, 1)"),
        ("--bearing-areas 0.4", "the least at most at 0.3"),
        ("--edges closed", "closed"),
    ],
)
def test_bad_input_is_one_line(options, message, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["letter", *options.split(), "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.exists()


@pytest.mark.slow
def test_the_letter_at_a_quarter_of_a_thousand(tmp_path):
    """n = 256 (minutes): four decades, thresholds in order, Bruggeman's media within a factor.

    Factors: the letter's "very accurate" for cuts is taken as 2, "very good over several decades"
    for the modified medium as 4, up to 0.8 of the thresholds.
    """
    result, _ = letter(Plan(RoughCase(256, short=4.0), seeds=2), tmp_path)
    reference = {
        row.model: row
        for row in result.thresholds
        if (row.pair, row.edges) == ("triangulation", "open")
    }
    assert reference["bearing"].threshold == pytest.approx(0.5, abs=0.04)
    assert reference["elastic"].threshold < reference["bearing"].threshold - 0.03
    assert result.agreement.decades > 4
    assert result.agreement.bruggeman_bearing < 2
    assert result.agreement.modified_measured_elastic < 4
