"""GAMG in place of hypre's BoomerAMG: another way to the same bounds, which the result names."""

import os

import numpy as np
import pytest
from drawn_stripes import Case
from project import scene_of_samples
from scipy import sparse

from fem_seal.errors import InvalidInput
from fem_seal.fenicsx import HAS_HYPRE, PETSc
from fem_seal.flow import linear
from fem_seal.memory import memory_of
from fem_seal.results.words import flow_words
from fem_seal.scene import Scene
from fem_seal.solved import solve


@pytest.fixture
def gamg():
    """Ask for GAMG, as PETSC_OPTIONS="-fem_seal_pc_type gamg" does."""
    options = PETSc.Options("fem_seal_")
    options["pc_type"] = "gamg"
    yield
    options.delValue("pc_type")


@pytest.mark.parametrize("contrast", [1e3, 1e60, 1e177])
def test_bounds_by_gamg_hold_a_closed_form(contrast, gamg):
    """A narrow film across the flow, of so many times less conductivity than the rest.

    At the largest contrast GAMG cannot be set up, and the bounds stay those of the first guess.
    """
    narrow = np.abs((np.arange(32) + 0.5) / 32 - 0.5) < 0.1
    heights = np.where(narrow, contrast ** (-1 / 3), 1.0)
    case = Case("across", heights, 32, (1.0, 1.0), "wall", "linear", "adaptive")
    flow = case.solve(20_000, rtol=0.01)
    assert flow.converged == (contrast < 1e177)
    assert flow.converged or "no preconditioner" in flow.reason


@pytest.mark.parametrize(("has_hypre", "name"), [(True, "hypre")] * HAS_HYPRE + [(False, "gamg")])
def test_without_hypre_gamg_takes_its_place(has_hypre, name, monkeypatch):
    monkeypatch.setattr(linear, "HAS_HYPRE", has_hypre)
    matrix = PETSc.Mat().createAIJ((2, 2), nnz=1, comm=PETSc.COMM_SELF)
    solver = linear.preconditioned_cg(matrix)
    assert solver.getPC().getType() == linear.preconditioner() == name


def test_options_of_the_user_stay(gamg, monkeypatch):
    """What PETSC_OPTIONS says comes first; a preconditioner that PETSc lacks is named."""
    options, matrix = PETSc.Options("fem_seal_"), PETSc.Mat().createAIJ((2, 2), nnz=1)
    monkeypatch.setattr(linear, "_stated_options", lambda: {"pc_gamg_threshold"})
    options["pc_gamg_threshold"] = 0.5
    linear.preconditioned_cg(matrix)
    assert options.getReal("pc_gamg_threshold") == 0.5
    options.delValue("pc_gamg_threshold")
    options["pc_type"] = "bogus"
    with pytest.raises(InvalidInput, match="-fem_seal_pc_type bogus is no preconditioner"):
        linear.preconditioned_cg(matrix)


def test_the_result_names_the_preconditioner(gamg):
    """As it does not where nothing was solved by finite elements."""
    sections = scene_of_samples(16)
    assert solve(Scene.from_mapping(sections)).result().preconditioner is None
    sections["flow"]["method"] = "adaptive"
    result = solve(Scene.from_mapping(sections)).result()
    assert result.preconditioner == "gamg"
    assert "(preconditioner gamg)" in flow_words(result)


def test_solves_leave_no_vectors_behind():
    """Vectors that PETSc makes at each iteration of CG would stay until the process ends.

    The first solve sets the preconditioner up; four more may then keep less than a vector each.
    """
    exact = np.sin(np.linspace(0, 40, 100_000))
    line = sparse.csr_array(sparse.diags([-1.0, 2.0, -1.0], (-1, 0, 1), (exact.size, exact.size)))
    rows = line.indptr, line.indices, line.data
    matrix = PETSc.Mat().createAIJ(line.shape, csr=rows, comm=PETSc.COMM_SELF)
    solver, (x, right_side) = linear.preconditioned_cg(matrix), matrix.createVecs()
    right_side.setArray(line @ exact)
    twice_the_minimum = 2 * float(exact @ (line @ exact))
    sizes = []
    for _ in range(5):
        history, stalled = linear.minimise_by_cg(
            solver, right_side, x, twice_the_minimum, 1e-8, balanced=True
        )
        assert len(history) > 1
        assert not stalled
        sizes.append(memory_of(os.getpid()).resident)
    assert sizes[-1] - sizes[0] < 4 * exact.nbytes
