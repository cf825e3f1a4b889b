"""Small random gaps with all kinds of difficulties: the bounds hold and the topology agrees."""

from collections import deque

import numpy as np
from gaps import represented
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sample_gaps import FLUID

from fem_seal.film import GridFilm
from fem_seal.flow import Limits, leak_rate
from fem_seal.flow.topology import dual_numbering, open_cells
from fem_seal.grid import GridField
from fem_seal.mesh.nested import uniform_mesh


def scattered(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Single contacts anywhere, touching at corners, on the sides and at the ends."""
    return open_part & (rng.random(open_part.shape) > rng.uniform(0, 0.6))


def channel(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """All contact but for a random walk one sample wide, that may miss the outlet."""
    path = np.zeros_like(open_part)
    i, j = 0, int(rng.integers(open_part.shape[1]))
    for _ in range(3 * open_part.size):
        path[i, j] = True
        step = rng.integers(4)
        i = min(max(i + (step == 0) - (step == 1 and rng.random() < 0.5), 0), len(path) - 1)
        j = (j + (step == 2) - (step == 3)) % path.shape[1]
        if i == len(path) - 1:
            path[i, j] = rng.random() < 0.8
            return path
    return path


def lines(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Contact lines one sample wide, along and across, ending inside or on the rim."""
    kept = open_part.copy()
    for _ in range(rng.integers(1, 4)):
        i, j = (int(rng.integers(n)) for n in kept.shape)
        length = int(rng.integers(1, max(kept.shape) + 1))
        if rng.random() < 0.5:
            kept[i : i + length, j] = False
        else:
            kept[i, j : j + length] = False
    return kept


def rings(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Islands three samples wide; with an open centre, a pocket."""
    kept = open_part.copy()
    for _ in range(rng.integers(1, 3)):
        i, j = (int(rng.integers(-1, n)) for n in kept.shape)
        block = kept[max(i, 0) : i + 3, max(j, 0) : j + 3]
        block[...] = False
        if rng.random() < 0.5 and min(block.shape) == 3:
            block[1, 1] = True
    return kept


def rows(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A row all in contact, but perhaps for one sample."""
    kept = open_part.copy()
    i = int(rng.integers(len(kept)))
    kept[i] = False
    if rng.random() < 0.7:
        kept[i, rng.integers(kept.shape[1])] = True
    return kept


def corners(open_part: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Fields of a chessboard, each two samples wide or one, in contact."""
    i, j = np.indices(open_part.shape) // int(rng.integers(1, 3))
    return open_part & (((i + j) % 2 == 0) | (rng.random(open_part.shape) < 0.2))


STRUCTURES = [scattered, channel, lines, rings, rows, corners]


@st.composite
def random_gaps(draw) -> tuple[np.ndarray, str, str, tuple[float, float]]:
    """Samples, representation, sides and spacing; open gaps spread over up to three decades."""
    representation = draw(st.sampled_from(["linear", "constant"]))
    sides = draw(st.sampled_from(["wall", "periodic"]))
    smallest = 2 if representation == "linear" else 1
    shape = draw(st.tuples(*[st.integers(smallest, 7)] * 2))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    is_open = np.ones(shape, dtype=bool)
    for structure in draw(st.lists(st.sampled_from(STRUCTURES), max_size=2)):
        is_open = structure(is_open, rng)
    decades = draw(st.sampled_from([0.0, 0.3, 1.0, 3.0]))
    samples = np.where(is_open, 10 ** rng.uniform(-decades, 0, shape), 0.0)
    if representation == "linear" and sides == "periodic":
        samples[:, -1] = samples[:, 0]
    spacing = draw(st.sampled_from([(1.0, 1.0), (3.0, 1.0), (1.0, 3.0)]))
    return samples, representation, sides, spacing


def leaks(is_open: np.ndarray, representation: str, sides: str) -> bool:
    """Walk from the inlet over open samples to the outlet.

    Pixels are neighbours along their sides, vertices along the edges of the triangulation.
    """
    if representation == "linear" and sides == "periodic":
        is_open = is_open[:, :-1]
    nx, ny = is_open.shape

    def neighbours(i, j):
        yield from ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1))
        if representation == "linear" and (i + j) % 2 == 0:
            # Every diagonal joins two vertices with i + j even, and each of those has all four.
            # Across the seam of an odd number of columns the parity belongs to column ny, not 0.
            yield from ((i + 1, j + 1), (i - 1, j + 1), (i + 1, j - 1), (i - 1, j - 1))

    todo = deque((0, j) for j in range(ny) if is_open[0, j])
    seen = set(todo)
    while todo:
        i, j = todo.popleft()
        if i == nx - 1:
            return True
        # A vertex of the first column stands at j = 0 and at j = ny, with either parity.
        places = [j] if sides == "wall" else [j, j + ny, j - ny]
        for place in places:
            for k, m in neighbours(i, place):
                inside = 0 <= k < nx and (0 <= m < ny if sides == "wall" else 0 <= m <= ny)
                on_strip = 0 <= place <= ny
                if not (inside and on_strip):
                    continue
                there = (k, m % ny)
                if is_open[there] and there not in seen:
                    seen.add(there)
                    todo.append(there)
    return False


def bounds(samples, representation, sides, spacing, method):
    return leak_rate(
        GridFilm(GridField(samples, spacing), sides=sides, representation=representation),
        method=method,
        rtol=0.1,
        limits=Limits(unknowns=150),
        every_dual=True,
        **FLUID,
    )


def assert_overlap(one, other) -> None:
    """Both enclose the same number: every level of one meets every level of the other."""
    for level in one.levels:
        for image in other.levels:
            assert level.lower <= image.upper
            assert image.lower <= level.upper


MANY = settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@MANY
@given(random_gaps())
def test_sealed_exactly_when_no_path_is_open(case):
    """A walk over samples, the labelled lattice, the cells of the mesh and the patches of the
    stream function: four answers to one question."""
    samples, representation, sides, spacing = case
    open_path = leaks(samples > 0, representation, sides)
    gap = represented(GridField(samples, spacing), representation)
    mesh = uniform_mesh(gap.squares, 1, sides == "periodic")
    data = gap.cell_data(mesh, gap.vertex_values(mesh))
    kept = open_cells(mesh, data).kept
    assert kept.any() == open_path
    assert (dual_numbering(mesh, data, kept, merge_blocked=True) is not None) == open_path
    if not open_path:
        flow = bounds(samples, representation, sides, spacing, "adaptive")
        assert (flow.state, flow.lower, flow.upper, flow.levels) == ("sealed", 0.0, 0.0, ())


@MANY
@given(random_gaps(), st.integers(0, 1))
def test_brackets_enclose_one_number(case, axis):
    """Uniform and adaptive meshes, and the mirrored gap, bracket the same leak rate ever closer."""
    samples, representation, sides, spacing = case
    if not leaks(samples > 0, representation, sides):
        return
    uniform = bounds(samples, representation, sides, spacing, "uniform")
    adaptive = bounds(samples, representation, sides, spacing, "adaptive")
    assert uniform.state == adaptive.state == "leaking"
    assert_overlap(uniform, adaptive)
    for flow in (uniform, adaptive):
        assert all(0 < level.lower <= level.upper for level in flow.levels)
        widths = [level.half_width for level in flow.levels]
        assert all(np.diff(widths) <= 0)
        assert flow.converged or "unknowns" in flow.reason
    # The triangulation of an odd number of pixels is not its own mirror image.
    if representation == "constant" or samples.shape[axis] % 2:
        mirrored = bounds(np.flip(samples, axis), representation, sides, spacing, "adaptive")
        assert_overlap(uniform, mirrored)


@settings(MANY, max_examples=50)
@given(random_gaps(), st.integers(0, 2**32 - 1))
def test_another_contact_never_raises_the_leak_rate(case, seed):
    samples, representation, sides, spacing = case
    rng = np.random.default_rng(seed)
    more = samples.copy()
    more[rng.integers(len(more)), rng.integers(more.shape[1])] = 0.0
    if representation == "linear" and sides == "periodic":
        more[:, -1] = more[:, 0]
    before = bounds(samples, representation, sides, spacing, "adaptive")
    after = bounds(more, representation, sides, spacing, "adaptive")
    assert after.lower <= before.upper
    assert before.state == "leaking" or after.state == "sealed"


@settings(MANY, max_examples=50)
@given(random_gaps())
def test_turned_and_inverted_pixels(case):
    """Keller: walls, pixels, no contact: Q_x[K] Q_y[1/K] = 1 on any rectangle, so the brackets of
    the gap and of its inverse, turned by a right angle, enclose 1 together."""
    samples = np.where(case[0] > 0, case[0], 0.5)
    flow = bounds(samples, "constant", "wall", case[3], "adaptive")
    dual = bounds(1 / samples.T, "constant", "wall", case[3][::-1], "adaptive")
    assert flow.lower * dual.lower <= 1 <= flow.upper * dual.upper
