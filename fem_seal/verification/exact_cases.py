"""Gaps whose leak rate is known exactly, sampled on any grid.

Everywhere Δp = 1 and η = 1/12, so that the film conductivity is K = g³.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fem_seal.film import GridFilm
from fem_seal.grid import GridField
from fem_seal.theory import closed_forms

WAVE = 0.6  # amplitude of the cosine channels, over the mean gap
PHASES = (1.0, 5.0, 0.2, 3.0)  # conductivities of the four squares
RATIO = 10.0  # ratio of the two conductivities of the checkerboard
RADIUS = 0.3  # radius of the discs, in periods
SMOOTH = 0.5 * np.log(1e4)  # amplitude A of the smooth checkerboard, for a contrast of 1e4


@dataclass(frozen=True)
class ExactCase:
    """A gap whose leak rate is known, and its samples on any grid."""

    #: function from the number of squares along the flow to one or more films between side walls.
    #: `exact` is the geometric mean of their leak rates: for two dual films only the product is
    #: known
    films: Callable[[int], tuple[GridFilm, ...]]
    exact: float  #: leak rate at Δp = 1, η = 1/12
    #: expected order of convergence of each bound in the spacing; None if unknown
    order: float | None
    source: str  #: source of the exact value and of the order


GapFunction = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of x and y


def vertex_gap(
    function: GapFunction, shape: tuple[int, int], size: tuple[float, float] = (1.0, 1.0)
) -> GridField:
    """Samples of function(x, y) at the vertices of mx × my squares over a rectangle."""
    spacing = (size[0] / shape[0], size[1] / shape[1])
    i, j = np.meshgrid(*(np.arange(m + 1) for m in shape), indexing="ij")
    return GridField(np.broadcast_to(function(i * spacing[0], j * spacing[1]), i.shape), spacing)


def finer_film(film: GridFilm, times: int = 1) -> GridFilm:
    """Sample a film on a grid 2^times as fine; the gap between the samples does not change."""
    gap = film.gap
    if film.representation == "constant":
        pixels, (dx, dy) = 2**times, gap.spacing
        values = gap.values.repeat(pixels, axis=0).repeat(pixels, axis=1)
        return replace(film, gap=GridField(values, (dx / pixels, dy / pixels), gap.periodic))
    for _ in range(times):
        gap = gap.refined()
    return replace(film, gap=gap)


def _wave(position: np.ndarray) -> np.ndarray:
    return 1 + WAVE * np.cos(2 * np.pi * position)


# Gaps of the channel at equal distances; the gap is linear between them.
CHANNEL = np.array([1.0, 0.4, 0.9, 0.3, 0.7])


def _channel_of_steps(n: int) -> tuple[GridFilm, ...]:
    positions = np.linspace(0, 1, CHANNEL.size)
    shape = (n, n // 4)
    gap = vertex_gap(lambda x, y: np.interp(x, positions, CHANNEL), shape, (1.0, 0.25))
    return (GridFilm(gap),)


def block_film(conductivity: np.ndarray, n: int) -> GridFilm:
    """Film on the unit square, cut into k × k squares of constant conductivity K = g³.

    The first axis is along the flow. There are n × n pixels, n being k times a power of two.
    """
    rows, columns = conductivity.shape
    gap = GridField(np.cbrt(conductivity), (1 / rows, 1 / columns))
    return finer_film(GridFilm(gap, representation="constant"), round(np.log2(n / rows)))


def _smooth_checkerboard(n: int) -> tuple[GridFilm, ...]:
    conductivity = partial(closed_forms.smooth_checkerboard, amplitude=SMOOTH)
    return (GridFilm(vertex_gap(lambda x, y: np.cbrt(conductivity(x, y)), (n, n))),)


def _discs(n: int) -> tuple[GridFilm, ...]:
    """A quarter of the cell; no flow crosses its sides, which are mirror lines."""
    side = 0.5 / n
    centres = (np.arange(n) + 0.5) * side
    gap = np.where(np.hypot.outer(centres, centres) >= RADIUS, 1.0, 0.0)
    return (GridFilm(GridField(gap, (side, side)), representation="constant"),)


def _dual_pair(n: int) -> tuple[GridFilm, ...]:
    """Log-normal conductivity on 8 × 8 squares, and its reciprocal turned by a right angle."""
    log_K = 2 * np.random.default_rng(1).normal(size=(8, 8))
    return block_film(np.exp(log_K), n), block_film(np.exp(-log_K.T), n)


def corner_order(ratio: float) -> float:
    """Order 2a of an energy on uniform meshes around a corner of a checkerboard.

    The flux has the singularity r^(a-1) with a = (4/π) atan √(K1/K2), K1 <= K2.
    """
    return 8 / np.pi * float(np.arctan(np.sqrt(min(ratio, 1 / ratio))))


CASES: dict[str, ExactCase] = {
    "cosine-across": ExactCase(
        lambda n: (GridFilm(vertex_gap(lambda x, y: _wave(x), (n, n // 2), (1.0, 0.5))),),
        0.5 * closed_forms.cosine_channel(WAVE, across=True),
        2.0,
        "Sommerfeld's integrals; smooth: second order",
    ),
    "cosine-along": ExactCase(
        lambda n: (GridFilm(vertex_gap(lambda x, y: _wave(y), (n, n))),),
        closed_forms.cosine_channel(WAVE, across=False),
        2.0,
        "mean of g³; smooth: second order",
    ),
    "series-channel": ExactCase(
        _channel_of_steps,
        0.25 * closed_forms.piecewise_linear_channel(CHANNEL),
        2.0,
        "∫ dx/g³ of the linear gap; its kinks lie on the grid: second order",
    ),
    "checkerboard": ExactCase(
        lambda n: (block_film(np.array([[1, RATIO], [RATIO, 1]]), n),),
        closed_forms.checkerboard(1.0, RATIO),
        corner_order(RATIO),
        "Keller 1964, Dykhne 1971; corner singularity r^(a-1): order 2a",
    ),
    "four-phases": ExactCase(
        lambda n: (block_film(np.array([PHASES[::3], PHASES[1:3]]), n),),
        closed_forms.four_phase_checkerboard(*PHASES)[0],
        None,
        "Mortola and Steffé; Milton 2001",
    ),
    "smooth-checkerboard": ExactCase(
        _smooth_checkerboard,
        1.0,
        2.0,
        "duality: exp(A cos 2πx cos 2πy) conducts like 1; smooth: second order",
    ),
    "discs": ExactCase(
        _discs,
        closed_forms.disc_array(np.pi * RADIUS**2),
        None,
        "Perrins, McKenzie, McPhedran 1979; steps of the rim: about first order, not smoothly",
    ),
    "duality": ExactCase(
        _dual_pair,
        1.0,
        None,
        "Keller 1964: Q_x[K] Q_y[1/K] = 1, of which this is the square root",
    ),
}
