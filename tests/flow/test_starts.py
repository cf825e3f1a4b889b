"""Where the solver starts from does not show in what it finds."""

import numpy as np
import pytest
from gaps import level_problem, represented, rough_gap

from fem_seal.errors import NotConverged
from fem_seal.flow import linear


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


def test_an_indefinite_preconditioner_is_replaced(monkeypatch):
    """Jacobi's method overrelaxed by 2.5 is indefinite: CG with it ends, and the next setting
    finds the minimum, 1e-8 each; where there is no other the failure is told."""
    usual = linear._SETTINGS[0]
    kind, weight = "pc_hypre_boomeramg_relax_type_all", "pc_hypre_boomeramg_relax_weight_all"
    # Options stay in PETSc's table until they are given anew.
    sound = {**usual, kind: "symmetric-SOR/Jacobi", weight: 1.0}
    broken = {**usual, kind: "Jacobi", weight: 2.5}
    problem = level_problem(represented(rough_gap((12, 12), 0.2, 4)), periodic_sides=True)
    zero = np.zeros(problem.unknowns)
    try:
        monkeypatch.setattr(linear, "_SETTINGS", (broken, sound))
        replaced = problem.pressure(zero).energy
        monkeypatch.setattr(linear, "_SETTINGS", (sound,))
        assert replaced == pytest.approx(problem.pressure(zero).energy, rel=2e-8, abs=0)
        monkeypatch.setattr(linear, "_SETTINGS", (broken,))
        with pytest.raises(NotConverged, match="PETSc reason -8"):
            problem.pressure(zero)
    finally:
        for name in (kind, weight):
            linear.PETSc.Options("fem_seal_").delValue(name)
