"""Percolation thresholds: symmetry, order of the models, duality, and files that survive."""

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from project import alone

from fem_seal.cli import main
from fem_seal.contact.state import GapState
from fem_seal.errors import InvalidInput, NotConverged
from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.letter import percolation as study
from fem_seal.letter.bisection import crossings
from fem_seal.letter.constriction import constriction_share
from fem_seal.letter.percolation import percolation
from fem_seal.letter.seed_thresholds import REFERENCE, Search, SeedThresholds
from fem_seal.letter.spanning import EDGES, PAIRS, Snapshot, criteria_of
from fem_seal.letter.surfaces import (
    MODELS,
    PRESSURE_DROP,
    VISCOSITY,
    Model,
    RoughCase,
    at_area,
)
from fem_seal.letter.threshold_rows import difference_rows, threshold_rows
from fem_seal.points import RecordFolder

CASE = RoughCase(64, short=4)
CONTACT_ONLY = Search(resolution=0.004, edges=("open",), flow=False)
SEEDS = range(1, 9)


@cache
def thresholds(model, seed):
    return study.seed_thresholds(CASE, model, seed, CONTACT_ONLY)


def cut_thresholds(surface, edges):
    """A* of the bearing model by pair of connectivities, to one sample."""
    criteria = criteria_of([edges])
    brackets = crossings(surface, MODELS["bearing"], criteria, 1.5 / surface.values.size)
    areas = {b.criterion: 0.5 * (b.before.area + b.after.area) for b in brackets}
    of = {(c.phase, c.connectivity): area for c, area in areas.items()}
    return {
        pair: 0.5 * (of["contact", contact] + of["open", open_])
        for pair, (contact, open_) in PAIRS.items()
    }


@pytest.mark.parametrize("edges", EDGES)
def test_turning_a_surface_over_swaps_the_phases(edges):
    """A*(h) + A*(-h) = 1: contact of -h at A is the open part of h at 1 - A.

    Exact but for the width of the brackets, one sample each, and half of that in the middle.
    """
    surface = CASE.surface(1)
    over = GridField(-surface.values, surface.spacing, periodic=True)
    up, down = cut_thresholds(surface, edges), cut_thresholds(over, edges)
    mirrored = {"contact-8": "contact-4", "contact-4": "contact-8"}
    for pair, threshold in up.items():
        total = threshold + down[mirrored.get(pair, pair)]
        assert total == pytest.approx(1, abs=2 / surface.values.size)


@cache
def letters_thresholds(model, seed):
    """Of the letter's own surfaces, λ_s = 1 sample, on 256²."""
    search = Search(resolution=0.004, edges=("open",), flow=False)
    return study.seed_thresholds(RoughCase(256), model, seed, search)


def test_elastic_deformation_lowers_the_threshold_by_what_the_letter_says():
    """0.075 ± 0.015 with contact 8 / open 4, what a five-point stencil conducts through.

    Three surfaces of 256² have it to a standard error of about 0.01; on the triangulation the
    difference is smaller, since there elastic contact at λ_s = 1 sample spans later.
    """
    points = [letters_thresholds(model, seed) for model in MODELS for seed in (1, 2, 3)]
    rows = {row.pair: row for row in difference_rows(points)}
    assert rows["contact-8"].seeds == 3
    assert rows["contact-8"].difference == pytest.approx(0.075, abs=0.02)
    assert 0.02 < rows[REFERENCE].difference < rows["contact-8"].difference
    cut, pressed = (
        np.array([point.of("contact-8", "open") for point in points if point.model == model])
        for model in MODELS
    )
    assert rows["contact-8"].difference == pytest.approx(float((cut - pressed).mean()), rel=1e-12)
    # The letter's 0.42(5), and its transition of ± 0.02 at most for either model.
    assert pressed.mean() == pytest.approx(0.42, abs=0.02)
    for model in MODELS:
        (row,) = (
            row
            for row in threshold_rows([p for p in points if p.model == model])
            if row.pair == "contact-8"
        )
        assert 0 <= row.half_width < 0.02 + 0.004


def test_bearing_contact_percolates_at_one_half():
    """Mean 1/2 by the symmetry above, for pairs that treat both phases alike.

    Tolerance: three standard errors of the mean, from the spread over the seeds themselves, and
    the bracket.
    """
    for pair in (REFERENCE, "both-4"):
        areas = [thresholds("bearing", seed).of(pair, "open") for seed in SEEDS]
        error = np.std(areas, ddof=1) / np.sqrt(len(areas))
        assert error < 0.02  # the test would not notice anything otherwise
        assert abs(np.mean(areas) - 0.5) < 3 * error + CONTACT_ONLY.resolution


def test_elastic_contact_percolates_earlier():
    """The letter's finding, in the mean over surfaces: beyond three standard errors from chance.

    Of single small surfaces it need not be true.
    """
    lower = [
        thresholds("bearing", seed).of(REFERENCE, "open")
        - thresholds("elastic", seed).of(REFERENCE, "open")
        for seed in SEEDS
    ]
    assert np.mean(lower) > 3 * np.std(lower, ddof=1) / np.sqrt(len(lower))


def test_connectivity_decides_who_percolates_first():
    """More neighbours join contact sooner and bar the open phase sooner."""
    for model in MODELS:
        threshold = thresholds(model, 1)
        eight, four = (threshold.between(pair, "open") for pair in ("contact-8", "contact-4"))
        assert eight[0] <= four[0]
        assert eight[1] <= four[1]


def test_brackets_hold_what_they_say():
    """A contact pressed anew, without a warm start, spans after and not before."""
    threshold = thresholds("elastic", 2)
    surface = CASE.surface(2)
    for bracket in threshold.brackets:
        assert 0 < bracket.after.area - bracket.before.area <= CONTACT_ONLY.resolution
        for end, expected in ((bracket.before, False), (bracket.after, True)):
            contact = MODELS["elastic"].press(surface, end.load, None, 1).contact
            assert bracket.criterion.crossed(contact) is expected


def test_perimeter_is_that_of_the_pixels():
    """A rectangle of 3 x 5 samples in contact has 2 (3 + 5) edges; one of width 1 over a side 2 n.

    On the torus: the second rectangle meets itself and has no ends.
    """
    for part, edges in (((slice(2, 5), slice(1, 6)), 16), ((slice(None), 4), 16)):
        gap = np.ones((8, 8))
        gap[part] = 0
        seen = Snapshot.of(GapState(GridField(gap, (1.0, 1.0), periodic=True)), 0.0)
        assert seen.perimeter == pytest.approx(edges / gap.size, rel=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_euler_characteristics_of_a_dual_pair_cancel(model):
    """The torus has characteristic 0, shared out between the phases of a dual pair."""
    state = at_area(CASE.surface(1), model, 0.4)
    seen = Snapshot.of(state, 0.0)
    for contact, open_ in (PAIRS[pair] for pair in (REFERENCE, "contact-8", "contact-4")):
        assert seen.euler_contact[contact] + seen.euler_open[open_] == 0


def test_euler_characteristic_tells_islands_from_swiss_cheese():
    """Few touching peaks are islands (positive), many are a sheet with holes (negative)."""
    surface = CASE.surface(1)
    light, heavy = (
        Snapshot.of(at_area(surface, "elastic", area), 0.0).euler_contact["triangulation"]
        for area in (0.1, 0.8)
    )
    assert light > 0 > heavy


def test_a_jump_of_the_area_ends_the_bisection():
    """Two heights only: the area jumps from 1/16 to 1, and no load lies between."""
    heights = np.zeros((16, 16))
    heights[::4, ::4] = 1.0
    surface = GridField(heights, (1.0, 1.0), periodic=True)
    brackets = crossings(surface, MODELS["bearing"], criteria_of(["periodic"]), 1e-3)
    contact = next(
        b for b in brackets if (b.criterion.phase, b.criterion.connectivity) == ("contact", "4")
    )
    assert contact.before.area == 1 / 16
    assert contact.after.area == 1


def test_ridges_across_the_flow_span_at_first_contact():
    heights = np.zeros((16, 16))
    heights[::4] = 1.0
    surface = GridField(heights, (1.0, 1.0), periodic=True)
    with pytest.raises(NotConverged, match="first contact"):
        crossings(surface, MODELS["bearing"], criteria_of(["open"]), 1e-3)


def test_a_criterion_that_is_never_met_is_an_error():
    never = Model(lambda *args: at_area(CASE.surface(1), "bearing", 0.2), 0.3, 0.7, 0.99)
    with pytest.raises(NotConverged, match="spanning"):
        crossings(CASE.surface(1), never, criteria_of(["open"]), 0.01)


# The critical constriction and the flow through it.


def neck(n=33, width=4e-8):
    """A wall across an even gap of 1 µm, with one narrow hole in it."""
    gap = np.full((n, n), 1e-6)
    gap[n // 2] = 0.0
    gap[n // 2, n // 2] = width
    return GridField(gap, (1e-6, 1e-6))


def test_the_hole_in_a_wall_takes_the_pressure_drop():
    """Resistances per square go with the cube: (1/0.04)³ here; all else is a few squares."""
    constriction = constriction_share(neck(), radius=3e-6)
    assert constriction.gap == pytest.approx(4e-8, rel=1e-9, abs=0)
    assert (constriction.x, constriction.y) == pytest.approx((0.5, 0.5))
    assert 0.99 < constriction.share <= 1


def test_an_even_gap_dissipates_evenly():
    """No constriction: the share is the disc's part of the area, up to the cells on its rim."""
    gap = GridField(np.full((65, 65), 1e-6), (1e-6, 1e-6))
    radius = 16e-6
    constriction = constriction_share(gap, radius)
    # The tightest place of an even gap is its first sample, a corner: a quarter of the disc.
    rim_cells = np.pi / 2 * 16 / 64**2 * 8
    assert constriction.share == pytest.approx(np.pi / 4 * 16**2 / 64**2, abs=rim_cells)


def test_dissipation_is_the_leak_rate_times_the_pressure_drop():
    """∫K|∇p|² = Q Δp where the pressure is exact: an even gap, K = g³/(12 η), Q = K Δp Ly/Lx."""
    from fem_seal.flow import leak_rate
    from fem_seal.quantities.constriction import cell_dissipation

    def dissipation(flow):
        return cell_dissipation(flow.field, flow.field.pressure).sum()

    gap = GridField(np.full((9, 17), 1e-6), (1e-6, 2e-6))
    options = {"viscosity": VISCOSITY, "pressure_drop": PRESSURE_DROP, "field": True}
    power = dissipation(leak_rate(GridFilm(gap), **options))
    flux = 1e-18 / (12 * VISCOSITY) * PRESSURE_DROP * 32 / 8
    assert power == pytest.approx(flux * PRESSURE_DROP, rel=1e-6)
    # Any continuous pressure dissipates more than the true one (Dirichlet's principle).
    rough = leak_rate(GridFilm(at_area(CASE.surface(1), "elastic", 0.2).gap), rtol=0.5, **options)
    assert dissipation(rough) >= rough.lower * PRESSURE_DROP


# Files.

TINY = RoughCase(16, short=4, long=0.5)


def run_tiny(out, seeds, **changes):
    search = replace(CONTACT_ONLY, resolution=0.02, **changes)
    return percolation([TINY], seeds, out, search=search)


def test_finished_seeds_are_not_repeated(tmp_path, monkeypatch):
    first = run_tiny(tmp_path, [1, 2])
    computed = []
    real = study.seed_thresholds

    def counted(case, model, seed, *args, **kwargs):
        computed.append((model, seed))
        return real(case, model, seed, *args, **kwargs)

    monkeypatch.setattr(study, "seed_thresholds", counted)
    assert run_tiny(tmp_path, [1, 2]) == first
    assert computed == []
    run_tiny(tmp_path, [1, 2, 3])
    assert computed == [("bearing", 3), ("elastic", 3)]


def test_an_interrupted_run_keeps_what_it_has(tmp_path, monkeypatch):
    real = study.seed_thresholds

    def interrupted(case, model, seed, *args, **kwargs):
        if seed == 2:
            raise KeyboardInterrupt
        return real(case, model, seed, *args, **kwargs)

    monkeypatch.setattr(study, "seed_thresholds", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_tiny(tmp_path, [1, 2])
    files = [path.name for path in (tmp_path / "points").iterdir()]
    assert files == [f"threshold-bearing-{TINY.name}-seed1.json"]
    record = json.loads((tmp_path / "percolation.json").read_text())
    assert [seed["seed"] for seed in record["seeds"]] == [1]


def test_a_write_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InvalidInput, match="No space left"):
        run_tiny(tmp_path, [1])
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_tables_hold_the_surfaces_of_all_writers(tmp_path):
    """Of other sizes and seeds, by whatever run, in whatever order they end."""
    other = replace(TINY, n=32)
    search = replace(CONTACT_ONLY, resolution=0.02)
    here = run_tiny(tmp_path, [1, 2])
    there = percolation([other], [1], tmp_path, search=search)
    run_tiny(tmp_path, [2])
    record = json.loads((tmp_path / "percolation.json").read_text())
    assert len(record["seeds"]) == len(here.seeds) + len(there.seeds)
    both = [(row.n, row.model, row.pair, row.threshold) for row in (*here.rows, *there.rows)]
    written = [(r["n"], r["model"], r["pair"], r["threshold"]) for r in record["rows"]]
    assert sorted(written) == sorted(both)
    assert len((tmp_path / "percolation.csv").read_text().splitlines()) == 1 + len(both)


def test_other_settings_are_refused(tmp_path):
    run_tiny(tmp_path, [1])
    with pytest.raises(InvalidInput, match="other settings"):
        run_tiny(tmp_path, [1], edges=("periodic",))


def test_a_damaged_point_is_computed_again(tmp_path):
    before = run_tiny(tmp_path, [1])
    point = tmp_path / "points" / f"threshold-elastic-{TINY.name}-seed1.json"
    point.write_text(point.read_text()[:100])
    assert run_tiny(tmp_path, [1]).rows == before.rows


def test_points_come_back_as_they_were(tmp_path):
    threshold = thresholds("elastic", 1)
    folder = RecordFolder(tmp_path, SeedThresholds)
    assert folder.point("point") is None
    folder.write("point", threshold)
    assert RecordFolder(tmp_path, SeedThresholds).point("point") == threshold


def test_a_surface_that_fails_does_not_stop_the_others(tmp_path, monkeypatch):
    real = study.seed_thresholds

    def failing(case, model, seed, *args, **kwargs):
        if seed == 2:
            raise NotConverged("on purpose")
        return real(case, model, seed, *args, **kwargs)

    monkeypatch.setattr(study, "seed_thresholds", failing)
    with pytest.raises(NotConverged, match=r"2 points .* bearing .* seed 2: on purpose"):
        run_tiny(tmp_path, [1, 2, 3])
    assert len(list((tmp_path / "points").iterdir())) == 4


def test_tables_are_the_same_for_jobs_and_parts(tmp_path, capsys):
    """To the last digit, whoever computes a surface; and what is missing is said."""
    options = "--n 16 --short 4 --long 0.5 --seeds 3 --edges open --resolution 0.02 --no-flow"

    def table(name, *how):
        out = tmp_path / name
        status = main(["percolation", *options.split(), *how, "--out", str(out)])
        return status, (out / "percolation.csv").read_text()

    whole = table("one")
    assert whole[0] == 0
    assert table("two", "--jobs", "2") == whole
    assert table("parts", "--part", "1/2")[0] == 0
    assert table("parts", "--gather")[0] == 3
    assert "3 of 6 surfaces are not computed yet" in capsys.readouterr().err
    assert table("parts", "--part", "2/2") == whole


@pytest.mark.slow
def test_a_killed_run_goes_on(tmp_path):
    """kill -9 after two points: they stay, whole, and are not computed again."""
    options = ["--n", "64", "--seeds", "3", "--edges", "open", "--no-flow"]
    arguments = ["percolation", *options, "--out", str(tmp_path)]
    code = f"from fem_seal.cli import main; main({arguments!r})"
    points = tmp_path / "points"
    with subprocess.Popen([sys.executable, "-c", code], env=alone()) as run:
        while len(list(points.glob("*.json"))) < 2 and run.poll() is None:
            time.sleep(0.01)
        run.kill()
    written = {path: path.stat().st_mtime_ns for path in points.glob("*.json")}
    assert 2 <= len(written) < 6
    assert main(arguments) == 0
    assert len(list(points.glob("*.json"))) == 6
    assert all(path.stat().st_mtime_ns == before for path, before in written.items())


def test_command(tmp_path, capsys):
    out = tmp_path / "out"
    options = "--n 16 --short 4 --long 0.5 --seeds 2 --edges open --resolution 0.02 --no-flow"
    assert main(["percolation", *options.split(), "--out", str(out)]) == 0
    assert "elastic  n 16 H 0.8 short 4 long 8 open" in capsys.readouterr().out
    assert (out / "thresholds.pdf").stat().st_size > 1000
    rows = (out / "percolation.csv").read_text().splitlines()
    assert len(rows) == 1 + len(MODELS) * len(PAIRS)
    record = json.loads((out / "percolation.json").read_text())
    assert [row["pair"] for row in record["rows"][: len(PAIRS)]] == list(PAIRS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--seeds 0", "--seeds"),
        ("--edges ajar", "ajar"),
        ("--short 0.5", "cut-offs"),
        ("--short 40", "cut-offs"),
        ("--n 4", "at least 8"),
        ("--resolution 0", "resolution"),
        ("--hurst 2", "hurst"),
    ],
)
def test_bad_input_is_one_line(options, message, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["percolation", "--n", "64", *options.split(), "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.exists()
