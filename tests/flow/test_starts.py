"""The result does not depend on what the solver starts from."""

import numpy as np
import pytest
from gaps import level_problem, represented
from sample_gaps import rough_gap


@pytest.mark.parametrize("representation", ["linear", "constant"])
@pytest.mark.parametrize("height", [1.0, 1e4, 1e8, 1e12])
def test_a_start_of_any_energy(representation, height):
    """Noise has up to 1e24 times the energy of the minimum, far more than what double precision
    can tell from its neighbour: CG starts again from what is left of it. 2e-8 each, of minima from
    above: the energy is that of an admissible function."""
    gap = represented(rough_gap((12, 12), 0.2, 4), representation)
    problem = level_problem(gap, periodic_sides=True)
    pressure = problem.pressure(np.zeros(problem.unknowns))
    stream = problem.stream(np.zeros(len(problem.mesh.xy)))
    rng = np.random.default_rng(0)
    high = problem.pressure(height * rng.normal(size=problem.unknowns))
    steep = problem.stream(height * rng.normal(size=len(problem.mesh.xy)))
    assert high.energy == pytest.approx(pressure.energy, rel=4e-8, abs=0)
    assert steep.conductance == pytest.approx(stream.conductance, rel=4e-8, abs=0)
