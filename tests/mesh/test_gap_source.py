"""The gap of a shape by formulas and by samples on grids; mesh sizes that follow it."""

import numpy as np
import pytest

from fem_seal.errors import InvalidInput
from fem_seal.expression import evaluate
from fem_seal.grid import GridField
from fem_seal.mesh.gap_source import CartesianGrid, PolarGrid, channel_sizes
from fem_seal.mesh.gmsh_process import Box, SizeField

POINTS = np.random.default_rng(1).uniform(-1, 1, (50, 2))
X, Y = POINTS.T


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2", np.full(50, 2.0)),
        ("-x + 2 * y / 4 - 1e-3", -X + Y / 2 - 1e-3),
        ("x**2 + y**2 - r**2", X**2 + Y**2 - np.hypot(X, Y) ** 2),
        ("cos(theta) * r - x", np.zeros(50)),
        ("max(0, min(x, 0.5))", np.clip(X, 0, 0.5)),
        ("arctan2(y, x) - theta", np.zeros(50)),
        (
            "exp(log(abs(x))) * tanh(sqrt(y*y)) + sin(pi * x) / tan(1)",
            np.abs(X) * np.tanh(np.abs(Y)) + np.sin(np.pi * X) / np.tan(1),
        ),
        # No error where there is no value, and powers of integers that would fill the memory.
        ("1 / (pi - pi)", np.inf),
        ("pi / (pi - pi)", np.inf),
        ("pi**pi**pi**pi**pi", np.inf),
        ("(-pi)**pi", np.nan),
        ("1" + "0" * 400, np.inf),
        ("9**9**9**9", np.inf),
    ],
)
def test_formulas(text, expected):
    np.testing.assert_allclose(evaluate(text, POINTS), expected, atol=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        *("__import__('os').system('true')", "x.__class__", "x[0]", "[1, 2]", "lambda: 1"),
        *("open('a')", "z", "x if y else 1", "x < y", "'a'", "True", "f'{x}'", "x := 1", ""),
        *("x +", "exp()", "max(1)", "max(x, y, r)", "exp(x=1)", "exp(*[1])", "1j", "x @ y"),
        *("x // 2", "x % 2", "None", "import os", "(x for x in y)", "x and y", "not x"),
        *("1" * 1001, "(" * 500 + "x" + ")" * 500, "-" * 998 + "x"),
    ],
)
def test_only_arithmetic_is_evaluated(text):
    """Everything else is refused in one sentence, and not run."""
    with pytest.raises(InvalidInput) as error:
        evaluate(text, POINTS)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("periodic", [False, True])
def test_a_cartesian_grid_is_linear_on_its_pixel_triangles(periodic):
    """Compared with `GridField.refined`, which samples the same function exactly; a periodic grid
    repeats its first samples."""
    rng = np.random.default_rng(2)
    gap = GridField(rng.uniform(0, 1, (5, 4)), (0.5, 0.25), periodic)
    fine = GridField(gap.vertices(), gap.spacing).refined().refined()
    i, j = np.indices(fine.shape)
    steps = np.stack([i.ravel(), j.ravel()], axis=1)
    points = steps * fine.spacing + np.array([3.0, -1.0])
    values = CartesianGrid.of(gap, (3.0, -1.0))(points)
    np.testing.assert_allclose(values, fine.values.ravel(), atol=1e-15)


@pytest.mark.parametrize("start", [0.0, 0.7, -1.0])
def test_a_polar_grid_closes_after_a_full_turn(start):
    """r (2 + cos(angle)) sampled at 720 angles: the interpolation error is r (dtheta)²/8 at every
    angle, also where the turn closes."""
    n = 720
    r = 1 + np.arange(4) * 0.5
    theta = start + 2 * np.pi * np.arange(n) / n
    gap = GridField(r[:, None] * (2 + np.cos(theta)), (0.5, 2 * np.pi / n))
    radius, angle = np.random.default_rng(4).uniform((1, -7), (2.5, 7), (20_000, 2)).T
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    values = PolarGrid.of(gap, (1.0, start))(points)
    cross_term = 0.5 * 2 * np.pi / n / 4
    bound = 2.5 * (2 * np.pi / n) ** 2 / 8 + cross_term
    assert np.abs(values - radius * (2 + np.cos(angle))).max() < bound


def test_points_outside_a_polar_sector_are_refused():
    gap = GridField(np.ones((3, 5)), (0.5, 0.1))
    grid = PolarGrid.of(gap, (1.0, 0.0))
    assert grid(np.array([[1.0, 0.0], [np.cos(0.4), np.sin(0.4)]])) == pytest.approx([1, 1])
    with pytest.raises(InvalidInput, match="1 of 2 vertices of the mesh lie beyond the grid"):
        grid(np.array([[1.0, 0.0], [np.cos(0.5), np.sin(0.5)]]))
    with pytest.raises(InvalidInput, match=r"covers 1.273 turns"):
        PolarGrid.of(GridField(np.ones((3, 80)), (0.5, 0.1)), (1.0, 0.0))


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("kind", [CartesianGrid, PolarGrid])
def test_a_mesh_in_other_units_than_its_grid(factor, kind):
    """Millimetres taken for metres, and the reverse."""
    grid = kind.of(GridField(np.ones((5, 5)), (0.01, 0.01)), (0.0, 0.0))
    mesh = np.array([[0, 0], [0.04, 0], [0.03, 0.001]])
    assert (grid(mesh) == 1).all()
    with pytest.raises(InvalidInput, match=r"a ratio of .*: one of them is in another unit"):
        grid(mesh * factor)


def test_a_grid_that_does_not_cover_the_mesh():
    grid = CartesianGrid.of(GridField(np.ones((5, 5)), (1.0, 1.0)))
    with pytest.raises(InvalidInput, match=r"1 of 3 vertices .* x = 4.001 m, y = 0 m"):
        grid(np.array([[0, 0], [4.001, 0], [0, 4]]))
    # gmsh places its vertices to 1e-9 of the mesh.
    assert (grid(np.array([[-1e-8, 0], [4 + 1e-8, 0], [0, 4]])) == 1).all()


def test_sizes_grow_from_where_the_gap_is_a_tenth_of_its_mean():
    """A wedge g = y has the mean 1 on 0 <= y <= 2, so its bank lies at y = 0.1: the nearest raster
    point beyond it is at 0.11."""
    wedge = CartesianGrid.of(GridField(np.tile(np.arange(201) / 100, (201, 1)), (0.01, 0.01)))
    field = channel_sizes(wedge, Box(0, 2, 0, 2), smallest=0.01, largest=10.0)
    for y in (0.5, 1.0, 1.7):
        assert field(1.0, y) == pytest.approx(0.01 + (y - 0.1) / 2, rel=1e-9)
    assert field(1.0, 0.0) == pytest.approx(0.01 + 0.11 / 2, rel=1e-9)


def test_sizes_between_the_points_of_their_raster():
    """Bilinear, so exact for (1 + x)(2 + 3y); beyond the raster as on its rim."""
    x, y = 1.0 + 0.5 * np.arange(5), -1.0 + 0.25 * np.arange(4)
    field = SizeField(np.outer(1 + x, 2 + 3 * y), (1.0, -1.0), (0.5, 0.25))
    for a, b in ((1.0, -1.0), (1.7, -0.9), (2.9, -0.31), (3.0, -0.25)):
        assert field(a, b) == pytest.approx((1 + a) * (2 + 3 * b), rel=1e-14)
    assert field(9.0, -0.9) == field(3.0, -0.9)
    assert field(1.7, -9.0) == field(1.7, -1.0)
