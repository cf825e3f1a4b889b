"""The conductivity along the path of a seal, drawn at the middles of its steps."""

import numpy as np

from fem_seal.render.seal import _at_steps


def test_steps_of_a_straight_line_are_drawn_as_it():
    """From end to end, and nothing where the film is open."""
    x = np.arange(12.0)
    places, K = _at_steps(x, 2 + 3 * (x // 3))
    assert places.tolist() == [0, 1, 4, 7, 10, 11]
    assert (K[1:-1] == places[1:-1] + 1).all()
    assert (K[0], K[-1]) == (2, 11)
    _, K = _at_steps(x, [None, None, *[5.0] * 10])
    assert np.isnan(K[:3]).all()
    assert (K[3:] == 5).all()
