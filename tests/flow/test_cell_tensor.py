"""The effective conductivity tensor of periodic cells: exact answers, symmetries, duality.

With η = 1/12 the film conductivity is gap³.
"""

import numpy as np
import pytest
from sample_gaps import rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.flow import Limits, Tuning
from fem_seal.flow.bounds import NO_FLOW, TensorBounds, geometric_mean
from fem_seal.flow.cell_tensor import conductivity_tensor
from fem_seal.flow.stopping import GROWTH_FOR_ORDER, MOST_UNKNOWNS, out_of_reach
from fem_seal.grid import GridField
from fem_seal.theory.closed_forms import four_phase_checkerboard

# CG stops at a relative energy error of 1e-8.
SOLVER = 1e-7


def tensor(gap, **options):
    return conductivity_tensor(gap, viscosity=1 / 12, **options)


def cell(values, spacing=(1.0, 1.0)):
    return GridField(values, spacing, periodic=True)


def on_first_mesh(gap, representation="linear"):
    """Bounds of the first mesh: discrete identities hold there to the solver's tolerance.

    The hierarchical correction depends on the minimiser itself, whose error is the root of that of
    the energy: 1e-7.
    """
    tuning = Tuning(tolerance=1e-14)
    return tensor(gap, representation=representation, rtol=1e6, tuning=tuning)


def holds(found, exact):
    """Whether lower <= exact <= upper as quadratic forms, up to rounding."""
    size = SOLVER * np.trace(exact)
    below = np.linalg.eigvalsh(exact - found.lower).min() >= -size
    return below and np.linalg.eigvalsh(found.upper - exact).min() >= -size


def rough(seed, contact=0.0, shape=(32, 32), spacing=(1.0, 1.0)):
    values = rough_gap(shape, contact, seed, 2).values
    return cell(values, spacing)


# --- exact answers -------------------------------------------------------------------------------


def test_four_phases():
    """Mortola and Steffé's formula."""
    k1, k2, k3, k4 = 1.0, 1.5, 2.0, 1.2  # around the corner
    exact = np.diag(four_phase_checkerboard(k1, k2, k3, k4))
    gap = cell(np.cbrt([[k1, k4], [k2, k3]]))
    found = tensor(gap, representation="constant", rtol=0.004)
    assert holds(found, exact)
    # Both lie between the bounds: an entry of their difference is at most √(W_ii W_jj).
    np.testing.assert_allclose(found.value, exact, atol=0.004 * exact.max())


def test_oblique_layers():
    """k(x + y): harmonic mean along the normal, arithmetic across it, so K_xy = (K_n - K_t)/2."""
    errors, rtol = [], 5e-4
    for n in (16, 32):
        i, j = np.indices((n, n))
        heights = 1 + 0.5 * np.cos(2 * np.pi * (i + j) / n)
        line = 1 + 0.5 * np.cos(2 * np.pi * np.arange(4096) / 4096)
        normal, parallel = 1 / np.mean(line**-3), np.mean(line**3)
        half_sum, half_difference = (normal + parallel) / 2, (normal - parallel) / 2
        exact = np.array([[half_sum, half_difference], [half_difference, half_sum]])
        found = tensor(cell(heights), rtol=rtol)
        errors.append(np.abs(found.value - exact).max() / parallel)
    # The next power is (2π/16)² of the second one; each error is known to half of rtol.
    slack = ((np.pi / 8) ** 2 + rtol / 2 / errors[1]) / np.log(2)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=slack)


# --- symmetries, on one mesh and therefore to the solver's tolerance -----------------------------


@pytest.mark.parametrize(
    ("contact", "representation"), [(0.0, "linear"), (0.3, "linear"), (0.3, "constant")]
)
def test_images(contact, representation):
    """Transposed, mirrored, and rolled by an even number of samples, as a cell has no beginning:
    the bounds turn with the cell."""
    gap = rough(1, contact, spacing=(1.0, 1.5))
    values, found = gap.values, on_first_mesh(gap, representation)
    # Sample 0 stays in place on a linear gap; pixels swap ends.
    mirrored = np.roll(values[::-1], 1 if representation == "linear" else 0, axis=0)
    images = [
        (cell(values.T, (1.5, 1.0)), np.array([[0.0, 1.0], [1.0, 0.0]])),
        (cell(mirrored, gap.spacing), np.diag([-1.0, 1.0])),
        (cell(np.roll(values, (6, 14), axis=(0, 1)), gap.spacing), np.eye(2)),
    ]
    for image, turn in images:
        other = on_first_mesh(image, representation)
        for bound in ("lower", "upper"):
            matrix = getattr(found, bound)
            size = np.abs(matrix).max() + 1e-300
            assert abs(matrix[0, 1] - matrix[1, 0]) <= 1e-12 * size
            expected = turn @ matrix @ turn
            np.testing.assert_allclose(getattr(other, bound), expected, atol=size * SOLVER)
    assert abs(found.upper[0, 1]) > 1e-3 * found.upper[0, 0]


# --- duality -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [1, 2])
def test_duality(seed):
    """K*(1/k) = K*(k)/det K*(k) (Keller 1964, Mendelson 1975), and so do the bounds, crossed.

    The primal problem of 1/k is the dual one of k turned by 90 degrees: upper(1/k) is
    lower(k)/det lower(k) on one mesh, up to the solver.
    """
    values = np.exp(np.random.default_rng(seed).normal(size=(16, 16)))
    k, inverse = (on_first_mesh(cell(v), "constant") for v in (values, 1 / values))
    for mine, other in (("upper", "lower"), ("lower", "upper"), ("value", "value")):
        partner = getattr(k, other)
        expected = partner / np.linalg.det(partner)
        np.testing.assert_allclose(
            getattr(inverse, mine), expected, atol=np.abs(expected).max() * 10 * SOLVER
        )


# --- contact -------------------------------------------------------------------------------------


def test_a_staircase_channel():
    """A channel that winds once along x while it winds twice along y flows along (1, 2) only."""
    n = 16
    values = np.zeros((n, 2 * n))
    i, j = np.indices(values.shape)
    values[((2 * i - j) % (2 * n)) < 8] = 1.0  # j = 2 i: once around each, as Ly = 2 Lx
    found = tensor(cell(values), representation="constant", rtol=0.1)
    direction = np.array([1.0, 2.0]) / np.sqrt(5)
    across = np.array([-2.0, 1.0]) / np.sqrt(5)
    strength = direction @ found.value @ direction
    assert strength > 0
    for matrix in (found.lower, found.upper):
        np.testing.assert_allclose(matrix @ across, 0, atol=NO_FLOW * strength)
    assert found.converged


def test_a_link_beside_an_oblique_channel():
    """A wide channel that winds around both axes, and a link a thousandth as high that closes a
    path of another direction: without the link K* has the rank one, with it both directions are
    known."""
    i, j = np.indices((16, 16))
    values = np.where((i - j) % 16 < 4, 1.0, 0.0)
    link = (np.abs(i - 8.5) < 1) & (values == 0)
    found, without = (
        tensor(cell(np.where(link, height, values)), representation="constant")
        for height in (1e-3, 0.0)
    )
    assert np.linalg.eigvalsh(without.upper)[0] < 1e-12
    assert found.converged
    # The drop along the weak direction lies across the link, 12 samples long and two wide.
    least = np.linalg.eigvalsh(found.lower)[0], np.linalg.eigvalsh(found.upper)[0]
    assert 0 < least[0] <= least[1] <= 1.052 * least[0]
    assert least[1] < 2 * 1e-9


def groove(seed):
    """A wide groove along x between samples of random decades."""
    values = 10 ** np.random.default_rng(seed).uniform(-4.5, -3, (4, 8))
    values[:, 2] = 1.0
    return values


@pytest.mark.parametrize("seed", [0, 7])
def test_every_direction_is_known(seed):
    """That across a groove conducts 1e-9 to 1e-13 of that along it, and is known to the tolerance
    all the same."""
    found = tensor(cell(groove(seed)), representation="constant", rtol=0.05)
    assert found.converged
    assert 1e-14 < found.upper[1, 1] / found.upper[0, 0] < 1e-9
    across = np.array([0.0, 1.0])
    low, high = (across @ bound @ across for bound in (found.lower, found.upper))
    # The bounds hold in every direction, and e·K*·e across is at most 1.05 times the lower one.
    assert 0 < low <= high <= 1.052 * low


def test_the_reason_names_the_direction():
    """At a limit: which direction is not known, how well it is, and how little flows there.

    The direction is an axis, to the rounding of a matrix whose other entry may be 1e9 times larger.
    """
    options = {"representation": "constant", "rtol": 0.01, "limits": Limits(unknowns=100)}
    along_x = tensor(cell(groove(0)), **options)
    assert not along_x.converged
    assert "along 90 degrees, where it is" in along_x.reason
    assert "e-1" in along_x.reason.split("where it is")[1].split("of its largest")[0]
    angle = float(
        tensor(cell(groove(0).T), **options).reason.split("along ")[1].split(" degrees")[0]
    )
    assert abs((angle + 90) % 180 - 90) < 1e-6


# --- ends and errors -----------------------------------------------------------------------------


def closed_both_ways(least):
    """A cell that a row and a column of small gaps cross."""
    values = 0.5 + 0.5 * np.random.default_rng(0).random((16, 16))
    values[3], values[:, 5] = least, least
    return cell(values)


def test_a_cell_closed_by_lines_of_tiny_gaps_ends():
    """To resolve a gap of 1e-30 all along a line takes 1e30 triangles: the bounds say how far."""
    meshes = []
    found = tensor(
        closed_both_ways(1e-30), rtol=0.1, progress=lambda unknowns, width: meshes.append(unknowns)
    )
    assert not found.converged
    assert f"needs more than {MOST_UNKNOWNS} unknowns" in found.reason
    assert "conducts 1e-90 of the largest gap" in found.reason
    assert np.linalg.eigvalsh(found.lower).min() > 0
    assert found.unknowns < 2 * GROWTH_FOR_ORDER * meshes[0]


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_nothing_winds(representation):
    found = tensor(closed_both_ways(0.0), representation=representation)
    assert found.converged
    assert not found.lower.any()
    assert not found.upper.any()
    assert found.width == found.excess == 0


@pytest.mark.parametrize("least", [1e-3, 1e-20])
def test_thin_lines_both_ways(least):
    """Of the cell's 16 rows one resists: 16 times its conductivity, less at the crossing.

    With p a function of x alone the flux is 16 least³ at most; with the flux along x, in 15 columns
    16 least³, less what rows of gaps above 0.5 resist, and least³ in the one that is closed.
    """
    found, finer = (
        tensor(closed_both_ways(least), representation="constant", rtol=rtol)
        for rtol in (0.1, 0.01)
    )
    assert found.converged
    most, at_least = 16 * least**3, (15 * 16 / (1 + 15 * (2 * least) ** 3) + 1) / 16 * least**3
    assert np.linalg.eigvalsh(found.lower).max() <= most
    assert np.linalg.eigvalsh(found.upper).min() >= at_least
    assert np.linalg.eigvalsh(found.upper - finer.lower).min() > 0
    assert np.linalg.eigvalsh(finer.upper - found.lower).min() > 0


def test_contrast_beyond_double_precision():
    """Where the tolerance is not reached the reason says that rounding may be why; a contrast whose
    cube no number holds is refused."""
    one_mesh = Limits(unknowns=1)
    found = tensor(closed_both_ways(1e-6), representation="constant", rtol=1e-3, limits=one_mesh)
    assert not found.converged
    assert "conducts 1e-18 of the largest gap; double precision" in found.reason
    with pytest.raises(InvalidInput, match="1e-70 of the largest gap; its cube is beyond double"):
        tensor(closed_both_ways(1e-70))


def history(order, width=1e6, start=1000, growth=1.5, rise=()):
    """Relative widths that fall as unknowns^-order from mesh to mesh."""
    unknowns = [round(start * growth**k) for k in range(8)]
    widths = [width * (n / start) ** -order for n in unknowns]
    return list(zip(unknowns, [*widths[: len(widths) - len(rise)], *rise], strict=True))


def test_what_is_out_of_reach():
    """From width w at n unknowns, order p takes n (w/rtol)^(1/p) of them."""
    slow = history(1)
    n, width = slow[-1]
    assert slow[-1][0] >= GROWTH_FOR_ORDER * slow[0][0]
    # Exactly as many as there are, and a little more.
    rtol = width * n / MOST_UNKNOWNS
    assert not out_of_reach(slow, 1.001 * rtol, 1.5)
    assert out_of_reach(slow, 0.999 * rtol, 1.5)
    assert not out_of_reach(history(3), 0.01, 1.5)
    # Too early to tell; new resistance that was just found; nothing known; done.
    assert not out_of_reach(slow[:-1], 1e-9, 1.5)
    assert not out_of_reach(history(1, rise=(2e6, 9e5)), 1e-9, 1.5)
    assert not out_of_reach(history(1, width=np.inf), 1e-9, 1.5)
    assert not out_of_reach(slow, width, 1.5)
    # Meshes that grew faster than usual: too few of them.
    assert not out_of_reach(slow, 0.999 * rtol, 1.3)


# --- small mathematics ---------------------------------------------------------------------------


def test_geometric_mean_in_small_units():
    """det would underflow: the mean of A and 4 A was then 4 A."""
    matrix = np.array([[2.0, 1.0], [1.0, 3.0]])
    for unit in (1.0, 1e-180):
        found = geometric_mean(unit * matrix, 4 * unit * matrix)
        np.testing.assert_allclose(found, 2 * unit * matrix)


def test_interval_of_an_off_diagonal_component():
    """All K between the bounds: extreme ones reach the interval's ends."""
    rng = np.random.default_rng(1)
    L = np.array([[2.0, 0.3], [0.3, 1.0]])
    factor = rng.normal(size=(2, 2)) / 3
    W = factor @ factor.T
    low, high = TensorBounds(L, L + W).interval(0, 1)
    angles = np.linspace(0, np.pi, 1000)
    # D = F u uᵀ Fᵀ with unit u are the extreme points of 0 <= D <= W of rank one.
    found = [
        L[0, 1] + (factor @ u)[0] * (factor @ u)[1]
        for u in np.stack([np.cos(angles), np.sin(angles)], 1)
    ]
    assert min(found) == pytest.approx(low, abs=1e-5)
    assert max(found) == pytest.approx(high, abs=1e-5)
