"""What makes the bracket a certificate: shares, sharpening, refinement and sloppy solvers."""

import numpy as np
import pytest
from gaps import FLUID, represented

from fem_seal.flow import Tuning, leak_rate
from fem_seal.flow.bubbles import pressure_bubbles, stream_bubbles
from fem_seal.grid import GridField
from fem_seal.mesh.bisection import bisect
from fem_seal.mesh.nested import DEPTH, uniform_mesh


@pytest.mark.parametrize("representation", ["linear", "constant"])
def test_no_bubbles_where_halves_cannot_be_represented(representation):
    """At the depth of the integer coordinates a hypotenuse may have no middle: no hat there."""
    samples = np.ones((3, 3)) if representation == "linear" else np.ones((2, 2))
    gap = represented(GridField(samples, (1.0, 1.0)), representation)
    mesh = uniform_mesh((2, 2), 1, periodic_sides=False)
    values = gap.vertex_values(mesh)
    for _ in range(2 * DEPTH):
        step = bisect(mesh, (mesh.xy[mesh.cells] == 0).all(axis=2).any(axis=1))
        mesh, values = step.mesh, gap.refined_values(values, step.mesh, step.edge_ends)
    data = gap.cell_data(mesh, values)
    kept = np.ones(len(mesh.cells), dtype=bool)
    no_middle = (mesh.xy[mesh.cells[:, 1:]].sum(axis=1) % 2).any(axis=1)
    assert no_middle.any()
    for bubbles in (pressure_bubbles, stream_bubbles):
        bubble = bubbles(mesh, data, kept)
        assert (bubble[no_middle] == -1).all()
        assert (bubble >= 0).any()


def test_depth_ends_with_the_bounds_so_far():
    """A corner of four fields of contrast 1e6, p ~ r^0.0013: triangles of 2^-24 pixels do not do.
    The bounds reached by then are returned, and the reason. (A small θ keeps the mesh small.)"""
    gap = GridField(np.array([[1.0, 1e-2], [1e-2, 1.0]]), (1.0, 1.0))
    flow = leak_rate(
        gap,
        representation="constant",
        rtol=0.1,
        every_dual=True,
        tuning=Tuning(theta=0.1),
        **FLUID,
    )
    assert not flow.converged
    assert "2^-24" in flow.reason
    assert 0 < flow.lower <= 1e-3 <= flow.upper
    assert flow.field is None
