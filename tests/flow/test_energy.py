"""Energies of slender cells against exact arithmetic: rounding errors stay within their bound."""

from fractions import Fraction

import numpy as np
import pytest
from project import leak_rate

from fem_seal.film import GridFilm
from fem_seal.flow.energy import SUM_ROUNDING, Energy
from fem_seal.flow.hierarchical import BubbleForm, bubble_rows
from fem_seal.flow.quarters import QuarterShape
from fem_seal.flow.traces import POWER, one_contact_tensor, segment_moments
from fem_seal.grid import GridField


def exact_energy(corners, tensor, values) -> Fraction:
    """∫ ∇v·T·∇v over one triangle, from numbers as they are stored."""
    (ux, uy), (vx, vy) = [[Fraction(x) for x in corner] for corner in corners[1:]]
    xx, xy, yy = map(Fraction, tensor)
    b, c = (Fraction(value) - Fraction(values[0]) for value in values[1:])
    twice = ux * vy - uy * vx
    gx, gy = (b * vy - c * uy) / twice, (c * ux - b * vx) / twice
    return abs(twice) / 2 * (xx * gx**2 + 2 * xy * gx * gy + yy * gy**2)


def slender_cells(rng, aspect: float, count: int):
    """Right triangles with legs along the axes and halves of them, in any order of corners; on half
    of them the function varies along one axis alone, up to rounding."""
    shapes = np.array(
        [[(0, 0), (1, 0), (0, 1)], [(0, 0), (2, 0), (1, 1)], [(0, 0), (0, 2), (1, 1)]]
    )
    corners = shapes[rng.integers(3, size=count)] * (aspect, 1.0) * rng.random((count, 1, 1))
    corners = np.take_along_axis(corners, rng.permuted([[0, 1, 2]] * count, axis=1)[..., None], 1)
    slope = rng.normal(size=(count, 2)) / (aspect, 1.0)
    slope[np.arange(count // 2), rng.integers(2, size=count // 2)] = 0
    values = (corners * slope[:, None]).sum(axis=2) + rng.normal(size=(count, 1))
    return corners - corners[:, :1], values


@pytest.mark.parametrize("aspect", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_rounding_of_single_cells(aspect):
    """Each cell's energy errs by less than its bound. The values are rounded before the energy is
    asked for, so that only its own arithmetic counts."""
    rng = np.random.default_rng(1)
    corners, values = slender_cells(rng, aspect, 300)
    # Positive definite: [[xx, xy], [xy, yy]] with |xy| < √(xx yy).
    xx, yy = 10 ** rng.uniform(-3, 3, (2, 300))
    tensor = np.stack([xx, rng.uniform(-0.9, 0.9, 300) * np.sqrt(xx * yy), yy], axis=1)
    tensor[::2] = tensor[::2, :1] * (1.0, 0.0, 1.0)
    worst = 0.0
    for one in zip(corners, tensor, values, strict=True):
        found = Energy.of_cells(*(part[None] for part in one), blur=0.0)
        off = abs(float(Fraction(found.value) - exact_energy(*one)))
        assert off <= found.error, one
        worst = max(worst, off / found.value)
    # Not idle: in slender cells the error is far beyond that of a sum of positive terms.
    assert worst > 1e-3 * np.finfo(float).eps * max(aspect, 1 / aspect)


def test_a_function_of_one_coordinate_has_a_small_error():
    """The bound is that of the function at hand: slender cells as such cost no digits."""
    corners = np.array([[(0, 0), (1e6, 0), (0, 1)], [(0, 0), (0, 1), (-1e6, 0)]], dtype=float)
    found = Energy.of_cells(corners, np.ones((2, 3)) * (1, 0, 1), corners[..., 0], blur=0.0)
    assert found.error < 1e-13 * found.value


def test_room_without_a_drop():
    """The energy, its error and that of the averages."""
    energy = Energy(1.0, 1e-13, 1e6)
    assert energy.upper_bound() == pytest.approx(1 + SUM_ROUNDING + 1e-13, rel=1e-15)


def exact_drop(corners, c, v, s) -> Fraction:
    """Energy of v less that of v + Σ s φ: both are linear on the quarters of a triangle, which is
    halved from its first corner, and then its halves from the middle of the opposite side."""
    corners = [np.array([Fraction(x) for x in corner]) for corner in corners]
    v, (on_m, on_e, on_d) = [Fraction(x) for x in v], map(Fraction, s)
    points = {
        name: (corner, [value] * 2) for name, corner, value in zip("abc", corners, v, strict=True)
    }
    for name, ends, more in (("m", "bc", on_m), ("e", "ca", on_e), ("d", "ab", on_d)):
        (p, (u, _)), (q, (w, _)) = points[ends[0]], points[ends[1]]
        points[name] = (p + q) / 2, [(u + w) / 2, (u + w) / 2 + more]
    drop = Fraction(0)
    for quarter, coefficient in zip(("dma", "emc", "dbm", "eam"), c, strict=True):
        xy, values = zip(*(points[name] for name in quarter), strict=True)
        tensor = coefficient, 0.0, coefficient
        before, after = (
            exact_energy([corner - xy[0] for corner in xy], tensor, of_function)
            for of_function in zip(*values, strict=True)
        )
        drop += before - after
    return drop


@pytest.mark.parametrize("aspect", [1e-3, 1.0, 1e3])
def test_rounding_of_drops(aspect):
    """The drop of each cell errs by less than its bound, beside exact arithmetic on its quarters;
    their coefficients differ a thousandfold, and bubble functions go up and down at random."""
    rng = np.random.default_rng(2)
    count = 100
    corners, values = slender_cells(rng, aspect, count)
    c = 10 ** rng.uniform(-3, 0, (count, 4))
    share = []
    for one, v, of_quarters in zip(corners, values, c, strict=True):
        s = rng.normal(size=3) * np.ptp(v) * 10 ** rng.uniform(-3, 0)
        shape = QuarterShape.of(*one.T[:, :, None])
        rows = bubble_rows(shape, of_quarters[:, None], [v[None]])
        energies, terms = BubbleForm(rows, np.arange(3)[:, None], 3).drops([np.append(s, 0.0)])
        mean = of_quarters.mean()
        tensor = np.array([[mean, 0.0, mean]])
        energy = Energy.of_cells(one[None], tensor, v[None], blur=0.0)
        off = float(Fraction(energies.item()) - exact_drop(one, of_quarters, v, s))
        share.append(abs(off) / energy.error_of_drop(*terms[0]))
    assert max(share) <= 1
    # Not idle: of 160 roundings that are allowed for one cell has 30, and most of these cancel.
    assert max(share) > 1e-3


def exact_tensor(edges, moments):
    """Resistivity (xx, xy, yy) at a contact vertex, from numbers as they are stored.

    ∫ |m D d - D' r|²/g³ dτ along the opposite side r, with D = G·r and D' = G·d, for gradients G
    along x and y; r is linear in τ, and the moments are those of (1-τ)², τ(1-τ) and τ².
    """
    b, c = [[Fraction(x) for x in edge] for edge in edges]
    d, twice = [y - x for x, y in zip(b, c, strict=True)], b[0] * c[1] - b[1] * c[0]
    outer_b, mixed, outer_c = map(Fraction, moments)

    def vector(k, r):
        return [POWER * r[k] * d[i] - d[k] * r[i] for i in (0, 1)]

    def integral(k, m):
        terms = (b, b, outer_b), (b, c, mixed), (c, b, mixed), (c, c, outer_c)
        return sum(
            moment * sum(x * y for x, y in zip(vector(k, r), vector(m, s), strict=True))
            for r, s, moment in terms
        )

    scale = 2 / ((2 * POWER - 3) * twice**2)
    return [float(scale * integral(k, m)) for k, m in ((0, 0), (0, 1), (1, 1))]


@pytest.mark.parametrize("aspect", [1e-8, 1e-3, 1.0, 1e3, 1e8])
@pytest.mark.parametrize(
    "edges", [((1, 0), (1, 1)), ((0, 1), (1, 1)), ((1, 1), (-1, 1)), ((1, 0), (0, 1))]
)
def test_traces_of_slender_cells(aspect, edges):
    """Each component to 40 roundings, the mixed one beside the root of the other two."""
    edges, gaps = np.array(edges) * (aspect, 1.0), (np.array([0.7]), np.array([0.3]))
    found = one_contact_tensor(*edges[..., None], *gaps)[:, 0]
    xx, xy, yy = exact_tensor(edges, segment_moments(*gaps)[:, 0])
    rounding = 40 * np.finfo(float).eps / 2
    assert found[[0, 2]] == pytest.approx([xx, yy], rel=rounding)
    assert found[1] == pytest.approx(xy, rel=0, abs=rounding * np.sqrt(xx * yy))


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("sides", ["wall", "periodic"])
def test_bounds_of_a_uniform_film_leave_room_for_rounding(representation, sides):
    """Q = g³ Δp Ly/(12 η Lx) of the numbers as they are stored lies between them.

    Nothing else keeps them apart: the room is that of all sums and averages, with 80 rounding units
    for the terms of the cells, 2 % of it, and a few for the units.
    """
    g, eta, drop, *spacing = np.random.default_rng(0).uniform(0.5, 2, 5)
    field = GridField(np.full((7, 5), g), tuple(spacing), periodic=True)
    film = GridFilm(field, sides, representation)
    leak = leak_rate(film, viscosity=eta, pressure_drop=drop, rtol=1e-6)
    g, eta, drop, dx, dy = map(Fraction, (g, eta, drop, *spacing))
    exact = g**3 * drop * 5 * dy / (12 * eta * 7 * dx)
    for bound, side in ((leak.lower, -1), (leak.upper, 1)):
        room = side * float(Fraction(bound) / exact - 1)
        assert room == pytest.approx(SUM_ROUNDING, rel=0.03)
