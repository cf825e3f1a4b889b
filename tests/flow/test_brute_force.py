"""Every level from every start against bounds that share no code with the package."""

import numpy as np
import pytest
from brute_force import bounds_by_brute_force
from drawn_stripes import Case
from gaps import assert_enclosed, bracketed, corners, lines, rings, scattered

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.grid import GridField

# The independent energies are sums of up to 2e4 terms, one by one.
ROUNDING = 2e4 * np.finfo(float).eps
SIDES = ["wall", "periodic"]
REPRESENTATIONS = ["linear", "constant"]


@pytest.mark.parametrize("sides", SIDES)
@pytest.mark.parametrize("representation", REPRESENTATIONS)
def test_the_brute_force_itself(representation, sides):
    """Channels g(y) and g(x) in closed form, and a barrier."""
    n = 8
    g = 0.3 + np.random.default_rng(0).random(n)
    g[-1] = g[0]
    for kind in ("along", "across"):
        case = Case(kind, g, n, (1.0, 1.0), "wall", representation, "uniform")
        excess = []
        for parts in (4, 8):
            low, high = bounds_by_brute_force(
                case.values, case.spacing, representation, sides, parts
            )
            assert low * (1 - 1e-12) <= case.exact <= high * (1 + 1e-12)
            excess.append(high / low - 1)
        if representation == "constant":
            assert excess == pytest.approx([0, 0], abs=1e-9)
        else:
            # The excess is c δ² (1 + O(δ²)), with δ the largest step of ln g from one part to the
            # next, at most a quarter of ln(max g/min g): the order 2 shows to δ²/ln 2.
            slack = (np.log(g.max() / g.min()) / 4) ** 2 / np.log(2)
            assert np.log2(excess[0] / excess[1]) == pytest.approx(2, abs=slack)
    barrier = np.ones((n, n))
    barrier[3] = 0
    assert bounds_by_brute_force(barrier, (1.0, 1.0), representation, sides, 2)[0] == 0


def dots(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Single contacts on the corners of squares four samples wide."""
    kept = open_part.copy()
    kept[::4, ::4] = False
    return kept


# Pixels, decades of the gap, and its contact.
GAPS = [
    ((6, 6), 0.0, []),
    ((16, 8), 2.0, []),
    ((8, 16), 0.5, [scattered]),
    ((16, 16), 0.1, [lines, rings]),
    ((9, 7), 2.0, [corners]),
    ((16, 16), 0.5, [dots]),
]


# Squares of one pixel, of several, and as wide as they come; CG that stops early, or before it
# begins; with a ceiling below the constriction most cells are of one pressure, some of them from
# inlet to outlet.
RUNS = [
    ("uniform", Tuning()),
    ("uniform", Tuning(tolerance=10.0)),
    ("adaptive", Tuning(coarsest=4)),
    ("adaptive", Tuning(ceiling=0.3, tolerance=0.1)),
    ("adaptive", Tuning(coarsest=1, cut=0.9, floor=0.9, ceiling=1.5, tolerance=10.0)),
]


@pytest.mark.parametrize("seed", range(len(GAPS)))
def test_every_level_encloses_the_brute_force(seed):
    """Slender pixels and any tuning, which may change the cost of the bounds and never make them
    wrong: those of all levels meet the independent ones, and a mesh takes back nothing that the one
    before has proved."""
    rng, (shape, decades, contact) = np.random.default_rng((26, seed)), GAPS[seed]  # all leak
    representation, sides = REPRESENTATIONS[seed % 2], SIDES[seed // 2 % 2]
    shape = np.array(shape) + (representation == "linear")
    is_open = np.ones(shape, dtype=bool)
    for structure in contact:
        is_open = structure(is_open, rng)
    samples = np.where(is_open, 10 ** rng.uniform(-decades, 0, shape), 0.0)
    if representation == "linear" and sides == "periodic":
        samples[:, -1] = samples[:, 0]
    spacing = ((1.0, 1.0), (2.0, 1.0), (1.0, 3.0))[seed % 3]
    low, high = bounds_by_brute_force(samples, spacing, representation, sides, 6)
    film = GridFilm(GridField(samples, spacing), sides, representation)
    for method, tuning in RUNS:
        flow = bracketed(film, 0.01, 350, method=method, tuning=tuning)
        assert flow.state == "leaking"
        assert_enclosed(flow, low * (1 - ROUNDING), high * (1 + ROUNDING), (method, tuning))
        lower, upper = np.array([(v.lower, v.upper) for v in flow.levels]).reshape(-1, 2).T
        assert (np.diff(lower) >= 0).all()
        assert (np.diff(upper) <= 0).all()
