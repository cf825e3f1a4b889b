"""The pressure itself, not only the leak rate, where it is a closed form."""

import numpy as np
import pytest
from gaps import areas_and_slopes, bracketed
from project import observed_orders

from fem_seal.film import GridFilm
from fem_seal.flow import Tuning
from fem_seal.leak_rate import FlowField
from fem_seal.theory.closed_forms import cosine_channel
from fem_seal.verification.exact_cases import vertex_gap

WAVE = 0.6  # amplitude of the channel


def pressure_of_channel(x: np.ndarray) -> np.ndarray:
    """1 - I(x)/I(1) with I = ∫ dx/g³ from the inlet, where g = 1 + a cos 2πx and 0 <= x <= 1.

    With Sommerfeld's angle γ, tan(γ/2) = √((1 - a)/(1 + a)) tan(πx), I is proportional to
    ∫ (1 - a cos γ)² dγ.
    """
    a = WAVE
    γ = 2 * np.arctan2(np.sqrt(1 - a) * np.sin(np.pi * x), np.sqrt(1 + a) * np.cos(np.pi * x))
    integral = (1 + a**2 / 2) * γ - 2 * a * np.sin(γ) + a**2 / 4 * np.sin(2 * γ)
    return 1 - integral / (2 * np.pi * (1 + a**2 / 2))


def slope_of_channel(x: np.ndarray) -> np.ndarray:
    """dp/dx = -1/(g³ <g⁻³>)."""
    return -cosine_channel(WAVE, across=True) / (1 + WAVE * np.cos(2 * np.pi * x)) ** 3


def error_norms(field: FlowField) -> dict[str, float]:
    """‖p_h - p‖ and ‖∇(p_h - p)‖, by the middles of the sides (exact for quadratics)."""
    (area, slope), p = areas_and_slopes(field), field.pressure[field.cells]
    x = field.points[field.cells][..., 0]
    middle = (x + np.roll(x, 1, axis=1)) / 2
    error = (p + np.roll(p, 1, axis=1)) / 2 - pressure_of_channel(middle)
    along = slope[:, :1] - slope_of_channel(middle)
    squares = {"L2": error**2, "H1": along**2 + slope[:, 1:] ** 2}
    return {norm: np.sqrt((area * e.mean(axis=1)).sum()) for norm, e in squares.items()}


@pytest.fixture(scope="module")
def errors_of_the_channel() -> list[dict[str, float]]:
    """On three uniform meshes, each the last one halved; CG goes on until it adds nothing."""
    norms = []
    for n in (16, 32, 64):
        gap = vertex_gap(lambda x, y: 1 + WAVE * np.cos(2 * np.pi * x) + 0 * y, (n, n))
        exact = {"method": "uniform", "tuning": Tuning(tolerance=1e-14)}
        flow = bracketed(GridFilm(gap), 1e-3, 1, field=True, **exact)
        assert len(flow.levels) == 1
        norms.append(error_norms(flow.field))
    return norms


@pytest.mark.parametrize(("norm", "order"), [("L2", 2), ("H1", 1)])
def test_order_of_the_pressure(errors_of_the_channel, norm, order):
    """Linear elements: errors ∝ h² and h, times 1 + O((h/l)²), where l = min |p'/p''| =
    min |g/(3 g')| = √(1 - a²)/(6π a) = 1/14: 5 % on the coarser one of the last two meshes."""
    orders = observed_orders([norms[norm] for norms in errors_of_the_channel])
    assert orders[-1] == pytest.approx(order, abs=0.05)
    assert (np.diff(np.abs(orders - order)) < 0).all()
