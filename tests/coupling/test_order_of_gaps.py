"""Where the fluid presses more, no gap gets smaller: the theorem behind flow.lift = "range".

Half-space, periodic, one total load P₀: p_f <= p_f' everywhere and P₀ > mean(p_f') give g <= g'
everywhere (docs/theory/mathematics.md, theorem 10). The proof needs a stiffness that is negative
off its diagonal. The root of the five-point Laplacian is, and the theorem holds for it to the last
digit. The band-limited stiffness of the package is not; the theorem is tested for it on rough
surfaces.
"""

import numpy as np
import pytest
from lifted_scenes import problem_of, scene

N = 10


def stiffness(symbol):
    """Dense (n², n²) matrix of a periodic convolution with a symbol of the angles per sample."""
    angle = 2 * np.pi * np.fft.fftfreq(N)
    kernel = np.fft.ifft2(symbol(*np.meshgrid(angle, angle, indexing="ij"))).real
    shifts = [np.roll(kernel, (i, j), (0, 1)).ravel() for i in range(N) for j in range(N)]
    return np.array(shifts)


def root_of_laplacian(a, b):
    return np.sqrt(4 * np.sin(a / 2) ** 2 + 4 * np.sin(b / 2) ** 2)


def band_limited(a, b):
    return np.hypot(a, b)


def gap_of(stiffness, heights, load, fluid):
    """Gap g of 0 <= g, 0 <= p_c = P₀ + L (g + h) - p_f, g p_c = 0, by opening what is pulled.

    Chandrasekaran's pivots: a sample once open stays open, since opening others only pulls the
    rest more, by the signs of L. Exact after at most as many steps as there are samples.
    """
    rest = load - fluid + stiffness @ heights
    opened = np.zeros(len(heights), dtype=bool)
    gap = np.zeros(len(heights))
    for _ in range(len(heights)):
        pulled = ~opened & (rest + stiffness @ gap < 0)
        if not pulled.any():
            return gap
        opened |= pulled
        gap[opened] = np.linalg.solve(stiffness[np.ix_(opened, opened)], -rest[opened])
    raise AssertionError("all samples have opened, though the load exceeds the fluid's")


@pytest.mark.parametrize("seed", range(20))
def test_gaps_are_ordered_as_the_fluid_pressures(seed):
    """Any two ordered pressures, neither of them constant; exact, but for rounding."""
    rng = np.random.default_rng(seed)
    matrix = stiffness(root_of_laplacian)
    heights = rng.normal(size=N * N)
    low = rng.random(N * N) * rng.integers(0, 2, N * N)
    high = low + rng.random(N * N) * rng.integers(0, 2, N * N)
    load = high.mean() + rng.uniform(0.05, 1.0)
    gaps = [gap_of(matrix, heights, load, fluid) for fluid in (low, high)]
    for gap, fluid in zip(gaps, (low, high), strict=True):
        solid = load + matrix @ (gap + heights) - fluid
        assert min(gap.min(), solid.min()) > -1e-12
        assert np.abs(gap * solid).max() < 1e-12
        assert solid.mean() + fluid.mean() == pytest.approx(load)
    assert (gaps[1] - gaps[0]).min() > -1e-12
    assert (gaps[1] - gaps[0]).max() > 0.01
    # More load closes: the same theorem, with a uniform difference of the pressures.
    assert (gap_of(matrix, heights, load + 0.1, low) - gaps[0]).max() < 1e-12


def test_the_signs_are_needed():
    """High pressure at one sample: it opens the others, but not all with the wrong signs."""
    rng = np.random.default_rng(1)
    heights, load = rng.normal(size=N * N), 2.0
    least = {}
    for symbol in (root_of_laplacian, band_limited):
        matrix = stiffness(symbol)
        before = gap_of(matrix, heights, load, np.zeros(N * N))
        after = [gap_of(matrix, heights, load, 20 * load * one) for one in np.eye(N * N)[::7]]
        least[symbol] = min((gap - before).min() for gap in after)
    assert least[root_of_laplacian] > -1e-12
    assert least[band_limited] < -0.01


KINDS = {
    "step": lambda x, y, rng: (x > 0.5) * 1.0,
    "stripes": lambda x, y, rng: 0.5 + 0.5 * np.cos(8 * np.pi * y),
    "blocks": lambda x, y, rng: rng.random((8, 8)).repeat(4, axis=0).repeat(4, axis=1),
    "noise": lambda x, y, rng: rng.random(x.shape),
    "samples": lambda x, y, rng: (rng.random(x.shape) > 0.9) * 1.0,
    "falling": lambda x, y, rng: 1 - x + 0 * y,
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rough_gaps_lie_between_those_of_constant_pressures(seed, kind):
    """The package's stiffness: p_f = 0 <= p_f <= p_in.

    Each contact is that of heights to 1e-4 of the rms height (docs/theory/contact.md), which move
    a gap by that and its level by as much.
    """
    problem = problem_of(scene(seed=seed))
    rng = np.random.default_rng(seed)
    shape = problem.height.shape
    x, y = np.meshgrid(*(np.arange(n) / n for n in shape), indexing="ij")
    some = problem.inlet * KINDS[kind](x, y, rng)
    pressures = np.zeros(shape), some, np.full(shape, problem.inlet)
    gaps = [problem.contact_under(pressure).gap.values for pressure in pressures]
    slack = 4e-4 * problem.height.values.std()
    assert (gaps[1] - gaps[0]).min() > -slack
    assert (gaps[2] - gaps[1]).min() > -slack
    assert gaps[0].mean() < gaps[1].mean() < gaps[2].mean()
