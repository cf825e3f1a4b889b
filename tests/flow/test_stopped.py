"""How a refinement begins, steps and ends at a limit, and what it leaves for other films."""

import time
from dataclasses import replace

import numpy as np
import pytest
from gaps import bracketed, level_problem, represented, solved
from project import leak_rate
from sample_gaps import FLUID, rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.film import GridFilm
from fem_seal.film.law import leak_rate_of_square
from fem_seal.flow import Limits, Tuning
from fem_seal.grid import GridField
from fem_seal.leak_rate import relative_width


@pytest.mark.parametrize(
    ("opening", "representation", "sides"),
    [(1, "linear", "periodic"), (6, "linear", "wall"), (1, "constant", "wall")],
)
def test_the_regularised_dual_never_becomes_a_bound(opening, representation, sides):
    """A barrier with a narrow or a wide opening of a tenth of the gap, amid coarse cells,
    which are closed: the regularised dual that guides the refinement lets hundreds of times too
    much through them. Whoever stops there gets the true dual's bound, or none."""
    n = 33 if representation == "linear" else 32
    samples = np.ones((n, n))
    samples[13] = 0
    samples[13, 10 : 10 + opening] = 0.1
    film = GridFilm(GridField(samples, (1.0, 1.0)), sides, representation)
    truth = leak_rate(film, rtol=0.1, **FLUID)
    assert truth.converged
    assert truth.field is None
    for limits, words in (
        (Limits(seconds=0.0), "max_seconds = 0 s is used up"),
        (Limits(unknowns=40), "more than 40 unknowns"),
        (Limits(memory_bytes=1), "GB"),
    ):
        coarse = Tuning(coarsest=4)
        stopped = leak_rate(film, limits=limits, tuning=coarse, field=True, **FLUID)
        assert not stopped.converged
        assert words in stopped.reason
        assert "\n" not in stopped.reason
        assert stopped.field is not None
        assert len(stopped.levels) == 1 or stopped.unknowns <= 40
        assert 0 <= stopped.lower <= truth.upper
        assert truth.lower <= stopped.upper
        # On a mesh that sees little of the barrier: it takes 1.5 of 4 layers of pixels from a cell
        # of the correction, a triangle, and so 0.61 of its area at most.
        assert stopped.levels[-1].upper > 1 - 0.61 > truth.upper


def test_the_time_of_the_last_dual_counts():
    """Far from the tolerance it is solved only because the refinement ends."""
    gap = GridField(10 ** np.random.default_rng(0).uniform(-1, 0, (33, 33)), (1.0, 1.0))
    [level] = leak_rate(GridFilm(gap), rtol=1e-3, limits=Limits(seconds=0.0), **FLUID).levels
    assert level.lower > 0
    assert {"regularised dual", "dual", "correction"} <= level.seconds.keys()


@pytest.mark.parametrize(
    ("representation", "sides"), [("linear", "wall"), ("constant", "periodic")]
)
def test_pockets_beside_a_channel(representation, sides):
    """In squares of 16 samples, most of which hold a piece of both: no level knows of the pocket,
    in which nothing flows. 1e-7: two solves of one problem, 1e-8 each."""
    n = 65 if representation == "linear" else 64
    samples = np.zeros((n, n))
    samples[:, 20:26] = 1
    holed = samples.copy()
    holed[8:56, 28:34] = 0.8
    films = [GridFilm(GridField(v, (1.0, 1.0)), sides, representation) for v in (samples, holed)]
    first, second = (
        leak_rate(film, rtol=0.1, tuning=Tuning(coarsest=4), **FLUID) for film in films
    )
    assert [level.unknowns for level in first.levels] == [level.unknowns for level in second.levels]
    for one, other in zip(first.levels, second.levels, strict=True):
        assert one.upper == pytest.approx(other.upper, rel=1e-7)
        assert one.lower == pytest.approx(other.lower, rel=1e-7)


def test_no_level_begins_that_would_exceed_a_limit(monkeypatch):
    """Of 100 s, 50 are spent: a level of 20 s fits twice, one of 30 s does not. The memory of the
    machine is a limit in any case."""
    started, limits = time.perf_counter() - 50, Limits(seconds=100)
    assert not limits.why_exceeded(started, growth=2, last=20)
    assert "longer than max_seconds = 100 s" in limits.why_exceeded(started, growth=2, last=30)
    assert "is used up" in Limits(seconds=40).why_exceeded(started)
    monkeypatch.setattr("fem_seal.limits.available_memory", lambda: 1000)
    assert "more than the" in Limits().why_exceeded(started)


@pytest.mark.parametrize("ahead", [0, 4])
def test_a_limit_leaves_both_bounds(ahead):
    """Meshes that look ahead may be four times the last: each that might be the last before a limit
    gets a true dual, so that a run which ends there has a lower bound."""
    gap = rough_gap((64, 64), 0.0, 9, smooth=1)
    gap = GridField(gap.values + 0.3, gap.spacing, gap.periodic)
    for most in (124, 482, 1472):
        flow = leak_rate(
            GridFilm(gap, sides="periodic"),
            rtol=2e-3,
            limits=Limits(unknowns=most),
            tuning=Tuning(coarsest=8, ahead=ahead),
            **FLUID,
        )
        assert flow.lower > 0


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("height", [1.0, 1e12])
def test_a_start_of_any_energy(representation, height):
    """Noise has up to 1e24 times the energy of the minimum, far more than what double precision
    can tell from its neighbour: CG starts again from what is left of it. 2e-8 each, of minima from
    above: the energy is that of an admissible function."""
    gap = represented(rough_gap((12, 12), 0.2, 4), representation)
    problem = level_problem(gap, periodic_sides=True)
    pressure, stream = solved(problem)
    rng = np.random.default_rng(0)
    high = problem.pressure([height * rng.normal(size=problem.unknowns)])
    steep = problem.stream(height * rng.normal(size=(1, len(problem.mesh.xy))))
    assert high.energies == pytest.approx(pressure.energies, rel=4e-8)
    assert steep.conductance == pytest.approx(stream.conductance, rel=4e-8)


@pytest.mark.parametrize(
    ("representation", "sides"), [("linear", "periodic"), ("constant", "wall")]
)
def test_bounds_from_the_mesh_of_another_film(representation, sides):
    """Lifted by a few per cent of its largest gap: they overlap with those from the coarsest mesh,
    in fewer steps."""
    gap, flows = rough_gap((32, 32), 0.2, seed=3, smooth=2), []
    lifted = GridField(np.where(gap.values > 0, gap.values + 0.03, 0.0), gap.spacing, periodic=True)
    film, other = (GridFilm(field, sides, representation) for field in (gap, lifted))
    leak_rate(film, **FLUID, keep=flows.append)
    warm, cold = leak_rate(other, **FLUID, start=flows[0].start), leak_rate(other, **FLUID)
    assert warm.converged
    assert max(warm.lower, cold.lower) <= min(warm.upper, cold.upper)
    assert len(warm.levels) < len(cold.levels)


def test_a_step_near_the_tolerance_is_smaller():
    """From the same mesh: the nearer the bounds are to the tolerance, the fewer unknowns are added,
    and the tolerance is met all the same."""
    gap = rough_gap((32, 32), 0.3, 5)
    far = bracketed(GridFilm(gap), 0.01, unknowns=None).levels
    widths = [relative_width(level.lower, level.upper) for level in far]
    last = max(k for k, width in enumerate(widths) if width > 0.1)
    # Only this step is smaller: all before it are full ones with either tolerance.
    near = bracketed(GridFilm(gap), 0.8 * widths[last], unknowns=None)
    assert near.converged
    assert [level.unknowns for level in near.levels[: last + 1]] == [
        level.unknowns for level in far[: last + 1]
    ]
    assert near.levels[last + 1].unknowns < far[last + 1].unknowns


# --- bounds of other films on the same mesh (that they hold: tests/upscaling) ---------------------


@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_multiples_of_a_gap(sides):
    """For the film itself the bounds are those of its last level; for multiples of its gap, whose
    pressure is the same, those times the cube. Cells at contact resist by 1/ceiling³ more, of which
    a film 1/factor as high has a part (1/(factor ceiling))³ at most."""
    values = rough_gap((32, 32), 0.2, seed=1, smooth=2).values
    values = np.where(values > 0, values + 0.03, 0.0)  # or the floor would raise the smallest

    def film(factor):
        return GridFilm(GridField(factor * values, (1.0, 1.0), periodic=True), sides)

    flows = []
    leak = leak_rate(film(1.0), **FLUID, keep=flows.append)
    unit = leak_rate_of_square(values.max(), **FLUID)
    ceiling = Tuning().ceiling * film(1.0).constriction.gap / values.max()
    # Each term of an energy has a rounding error of 160 units at most (flow/energy.py).
    rounding = 160 * np.finfo(float).eps
    for factor in (1.0, 0.5, 0.1):
        lower = flows[-1].conductances_below(film(factor))
        higher = flows[-1].resistances_above(film(1 / factor))
        cubes = np.array([1.0, factor]) ** 3
        assert unit * lower == pytest.approx(leak.upper * cubes, rel=rounding)
        part = unit / higher / (leak.lower / cubes)
        assert (part <= 1 + rounding).all()
        assert (part >= 1 - rounding - np.array([0.0, (factor * ceiling) ** -3])).all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sides": "periodic"}, "need both linear on one grid"),
        ({"representation": "constant"}, "need both linear on one grid"),
        ({"gap": GridField(np.ones((5, 5)), (1.0, 2.0))}, "need both linear on one grid"),
        ({"gap": GridField(0.5 + np.eye(5), (1.0, 1.0))}, "gap is {} than .* at {} of 25 samples"),
    ],
)
def test_films_that_a_flow_does_not_bound(change, words):
    film, flows = GridFilm(GridField(np.ones((5, 5)), (1.0, 1.0))), []
    leak_rate(film, **FLUID, keep=flows.append)
    other = replace(film, **change)
    with pytest.raises(InvalidInput, match=words.format("smaller", 20)):
        flows[-1].resistances_above(other)
    with pytest.raises(InvalidInput, match=words.format("larger", 5)):
        flows[-1].conductances_below(other)
