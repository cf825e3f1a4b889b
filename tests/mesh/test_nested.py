"""The nested family: every mesh of it tiles the rectangle by right isosceles triangles."""

import numpy as np
import pytest

from fem_seal.mesh.nested import PIXEL, coarsest_width, uniform_mesh


@pytest.mark.parametrize("width", [1, 2, 4])
def test_diagonals_join_even_vertices(width):
    """Pixel (i, j) is cut from (i, j) to (i+1, j+1) if i + j is even, else the other way."""
    mesh = uniform_mesh((4 * width, 5 * width), width, periodic_sides=False)
    ends = mesh.xy[mesh.cells[:, 1:]] // (width * PIXEL)
    assert (ends.sum(axis=2) % 2 == 0).all()
    assert len(np.unique(np.sort(ends[..., 0] * 100 + ends[..., 1], axis=1), axis=0)) == 20


@pytest.mark.parametrize(
    ("squares", "at_least", "width"),
    [
        ((256, 256), 32, 8),
        ((256, 64), 32, 2),  # the shorter side decides
        ((96, 96), 8, 8),  # 96 = 32 · 3: 12 squares; 6 would be too few
        ((255, 256), 8, 1),  # an odd side starts at the pixel
        ((24, 40), 3, 8),
        ((1, 7), 8, 1),
    ],
)
def test_coarsest_width(squares, at_least, width):
    assert coarsest_width(squares, at_least) == width
