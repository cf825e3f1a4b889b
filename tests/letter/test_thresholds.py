"""Percolation thresholds: symmetry, order of the models, duality, and brackets that hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as hnp

from demos.letter.contacts import MODELS, RoughCase, pressed
from demos.letter.crossings import crossings
from demos.letter.events import EVENTS, PAIRS, REFERENCE, Event, Snapshot, euler_characteristic
from demos.letter.thresholds import DIFFERENCE, threshold_rows, thresholds
from fem_seal.contact import GapState
from fem_seal.errors import NotConverged
from fem_seal.film.clusters import label
from fem_seal.grid import GridField

CASE = RoughCase(64, short=4)
RESOLUTION = 0.004
SEEDS = (1, 2, 3, 4)


@pytest.fixture(scope="module")
def found():
    return [thresholds(CASE, m, seed, RESOLUTION) for m in MODELS for seed in SEEDS]


def cut_thresholds(surface):
    """A* of the bearing model by pair of connectivities, to one sample."""
    brackets = crossings(surface, "bearing", EVENTS, 1.5 / surface.values.size)
    of = {
        (event.phase, event.connectivity): 0.5 * (before.area + after.area)
        for event, (before, after) in zip(EVENTS, brackets, strict=True)
    }
    return {
        pair: 0.5 * (of["contact", contact] + of["open", open_])
        for pair, (contact, open_) in PAIRS.items()
    }


def test_turning_a_surface_over_swaps_the_phases():
    """A*(h) + A*(-h) = 1: contact of -h at A is the open part of h at 1 - A.

    Exact but for the width of the brackets, one sample each, and half of that in the middle.
    """
    surface = CASE.surface(1)
    over = GridField(-surface.values, surface.spacing, periodic=True)
    up, down = cut_thresholds(surface), cut_thresholds(over)
    mirrored = {"contact-8": "contact-4", "contact-4": "contact-8"}
    for pair, threshold in up.items():
        total = threshold + down[mirrored.get(pair, pair)]
        assert total == pytest.approx(1, abs=2 / surface.values.size)


def test_elastic_contact_percolates_earlier_than_one_half(found):
    """Cuts percolate at one half by the symmetry above; elastic contact below.

    To three standard errors of the mean, from the spread over the seeds, and the bracket. The
    letter's difference, 0.075 ± 0.015, is within them with contact 8 / open 4.
    """
    rows = {(row.model, row.pair): row for row in threshold_rows(found)}
    cut, lower = rows["bearing", REFERENCE], rows[DIFFERENCE, REFERENCE]
    assert cut.standard_error == pytest.approx(cut.deviation / 2)  # four seeds
    assert cut.standard_error < 0.02  # the test would not notice anything otherwise
    assert abs(cut.threshold - 0.5) < 3 * cut.standard_error + RESOLUTION
    assert lower.threshold > 3 * lower.standard_error
    assert lower.threshold == pytest.approx(
        cut.threshold - rows["elastic", REFERENCE].threshold, abs=1e-12
    )
    stencil = rows[DIFFERENCE, "contact-8"]
    assert abs(stencil.threshold - 0.075) < 3 * stencil.standard_error + 0.015
    # The correction takes pixels away from contact; the elastic threshold falls.
    elastic = rows["elastic", REFERENCE]
    assert elastic.corrected < elastic.threshold
    assert rows["bearing", REFERENCE].corrected is None


def test_connectivity_decides_who_percolates_first(found):
    """More neighbours join contact sooner and bar the open phase sooner."""
    for one in found:
        eight, four = (one.ends(pair) for pair in ("contact-8", "contact-4"))
        assert eight[0] <= four[0]
        assert eight[1] <= four[1]


def test_brackets_hold_what_they_say(found):
    """A contact pressed anew, without a warm start, spans after and not before."""
    one = next(one for one in found if one.model == "elastic")
    surface = CASE.surface(one.seed)
    for event in (Event("contact", "8"), Event("open", "triangulation")):
        before, after = one.brackets[str(event)]
        assert 0 < after.area - before.area <= RESOLUTION
        for end, expected in ((before, False), (after, True)):
            contact = pressed(surface, "elastic", end.load).contact
            assert event.occurred(contact) is expected


def test_perimeter_and_euler_characteristic_are_those_of_the_pixels():
    """3 x 5 samples in contact have 2 (3 + 5) edges; a line across the torus has two sides.

    The first is one piece without holes, the second has the Euler characteristic of a ring.
    """
    for part, edges, euler in (((slice(2, 5), slice(1, 6)), 16, 1), ((slice(None), 4), 16, 0)):
        gap = np.ones((8, 8))
        gap[part] = 0
        seen = Snapshot.of(GapState(GridField(gap, (1.0, 1.0), periodic=True)), 0.0)
        assert seen.perimeter == pytest.approx(edges / gap.size, rel=1e-12)
        assert seen.euler == euler


@given(hnp.arrays(bool, (12, 10)))
def test_euler_characteristic_is_pieces_less_holes(mask):
    """What is around the mask is one more cluster; the two phases of a torus cancel."""
    mask = np.pad(mask, 2)
    pieces, holes = label(mask, "triangulation")[1], label(~mask, "triangulation")[1] - 1
    assert euler_characteristic(mask) == pieces - holes == -euler_characteristic(~mask)


def test_a_jump_of_the_area_ends_the_bisection():
    """Two heights only: the area jumps from 1/16 to 1, and no load lies between."""
    heights = np.zeros((16, 16))
    heights[::4, ::4] = 1.0
    surface = GridField(heights, (1.0, 1.0), periodic=True)
    ((before, after),) = crossings(surface, "bearing", [Event("contact", "4")], 1e-3)
    assert (before.area, after.area) == (1 / 16, 1)


def test_ridges_across_the_flow_span_at_first_contact():
    heights = np.zeros((16, 16))
    heights[::4] = 1.0
    surface = GridField(heights, (1.0, 1.0), periodic=True)
    with pytest.raises(NotConverged, match="first contact"):
        crossings(surface, "bearing", EVENTS, 1e-3)
