"""Two ranks give the bounds of one."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from bounds_on_ranks import CASES, solve
from dolfinx_meshes import MESHES, summary
from project import MPI_ENVIRONMENT, printed_by
from sample_gaps import rough_gap

SCRIPT = Path(__file__).with_name("bounds_on_ranks.py")
# Relative, of the bounds of one mesh: the first order of the correction in what CG leaves.
SAME = 2 * np.sqrt(0.3 * 4e-8)


# Of the small ones a rank has a single cell, or no unknown.
SMALL = {str(shape): shape for shape in [(1, 1), (3, 1)]}


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> tuple[dict[str, dict], dict[str, dict]]:
    """Leak rates from one rank and from two."""
    rng = np.random.default_rng(0)
    gaps = {name: rng.uniform(0.5, 1, shape) for name, shape in SMALL.items()}
    gaps["rough"] = rough_gap((16, 18), 0.25, 3).values
    path = tmp_path_factory.mktemp("ranks") / "gaps.npz"
    np.savez(path, **gaps)
    variables = MPI_ENVIRONMENT | {"PYTHONPATH": str(SCRIPT.parents[1])}  # for sample_gaps
    printed = printed_by("mpirun", "-n", "2", sys.executable, SCRIPT, path, **variables)
    answer = json.loads(printed.splitlines()[-1])
    assert answer["size"] == 2
    assert answer["alike"]
    return solve(gaps) | {"meshes": summary()}, answer["found"]


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["rough", *SMALL])
@pytest.mark.parametrize("case", CASES)
def test_two_ranks_give_the_bounds_of_one(results, name, case):
    """Uniform: the same problems. Their minima agree to 2e-8, and the bounds to SAME. Adaptive:
    marking may differ by a cell, but both brackets enclose one number."""
    one, two = (found[" ".join([name, *case])] for found in results)
    assert two["bounds"][0] <= one["bounds"][1]
    assert one["bounds"][0] <= two["bounds"][1]
    if case[0] == "uniform":
        assert two["bounds"] == pytest.approx(one["bounds"], rel=SAME)
        assert two["unknowns"] == one["unknowns"]
        assert two["field"] == one["field"]
        # Flows err as the square root of the energy, times the ratio of norms of test_leak_rate.
        assert two["flows"] == pytest.approx(one["flows"], rel=100 * np.sqrt(4e-8))


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["rough", *SMALL])
def test_two_ranks_give_the_tensor_of_one(results, name):
    """Marking may differ by a cell, but both pairs of forms enclose one tensor."""
    one, two = (found[f"{name} tensor"] for found in results)
    for below, above in ((one, two), (two, one)):
        difference = np.array(above["upper"]) - np.array(below["lower"])
        # Minima of both ranks agree to the solver's tolerance only.
        assert np.linalg.eigvalsh(difference).min() >= -1e-7 * np.trace(above["upper"])


@pytest.mark.mpi
def test_two_ranks_find_the_meshes_of_one(results):
    """Meshes are the same to the last digit, gaps and the lengths of inlet, outlet, wall, contact
    and seam to rounding, and bounds of the first mesh to what CG has left."""
    one, two = (found["meshes"] for found in results)
    assert two.keys() == one.keys()
    for name in MESHES:
        assert two[name]["mesh"] == one[name]["mesh"]
        assert two[name]["gap"] == pytest.approx(one[name]["gap"], rel=1e-14)
        assert two[name]["bounds"] == pytest.approx(one[name]["bounds"], rel=SAME), name
    for sides in ("wall", "periodic"):
        assert two[sides] == pytest.approx(one[sides], rel=1e-12)
