"""Arrays and numbers as they come from elsewhere."""

from functools import partial

import numpy as np
import pytest
from gaps import bracketed
from project import leak_rate, refused_calls
from sample_gaps import FLUID, rough_gap
from triangulations import ring

from fem_seal.film import GridFilm, MeshFilm
from fem_seal.finite_difference import by_differences
from fem_seal.flow import FlowSettings, Limits, Tuning
from fem_seal.flow import leak_rate as flow_leak_rate
from fem_seal.flow.cell_tensor import conductivity_tensor
from fem_seal.flow.gap_on_mesh import VertexGap
from fem_seal.grid import GridField


def frozen(values, folder):
    copy = values.copy()
    copy.setflags(write=False)
    return copy


def mapped(values, folder):
    np.save(folder / "gap.npy", values)
    return np.load(folder / "gap.npy", mmap_mode="r")


LAYOUTS = {
    "Fortran order": lambda values, folder: np.asfortranarray(values),
    "read-only": frozen,
    "strided": lambda values, folder: np.repeat(values, 2, 0)[::2],
    "memory-mapped": mapped,
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_single_precision_in_any_layout(layout, tmp_path):
    """The bounds of the same numbers in double precision; sums may differ with the alignment."""
    values = rough_gap((16, 16), 0.3, 4).values.astype(np.float32)
    array = LAYOUTS[layout](values, tmp_path)
    writeable = array.flags.writeable
    leak, reference = (
        bracketed(GridFilm(GridField(one, (1.0, 1.0), periodic=True)), 0.05)
        for one in (array, values.astype(float))
    )
    assert leak.bounds == pytest.approx(reference.bounds, rel=1e-13)
    assert array.flags.writeable == writeable


ONES = np.ones((4, 4))


def film(values=ONES, spacing=(1.0, 1.0), periodic=False, **choices):
    return GridFilm(GridField(np.array(values), spacing, periodic), **choices)


def leak(values=ONES, spacing=(1.0, 1.0), representation="linear", **options):
    gap = film(values, spacing, representation=representation)
    return leak_rate(gap, **FLUID | options)


def tensor(values=ONES, periodic=True, **options):
    gap = GridField(np.array(values), (1.0, 1.0), periodic)
    return conductivity_tensor(gap, **{"viscosity": 1 / 12} | options)


def kept_flow():
    """The flow on the last mesh of a film."""
    flows = []
    leak(keep=flows.append)
    return flows[-1]


def on_a_ring(values):
    """Eight corners, and the ring is cut open at one of them: its two vertices are there twice."""
    return MeshFilm(ring(1, 8), np.array(values))


RANDOM = np.random.default_rng(0).random((4, 5))
# Whose cube no number holds, and other numbers that are not positive.
SIZES, BAD = (1e-310, 1e-120, 1e-70, 1e70, 1e120), (0.0, -1.0, np.inf, np.nan)
BEYOND = "beyond double precision; check the units"
NUMBERS = ("viscosity", "pressure_drop", "rtol", "decide")
SOLVERS = (
    partial(flow_leak_rate, settings=FlowSettings(**FLUID)),
    partial(by_differences, **FLUID),
)
test_bad_input_is_refused_in_one_sentence = refused_calls(
    *(
        (partial(film, [[1.0, bad], [1, 1]]), "1 of 4 grid values are not finite")
        for bad in (np.nan, np.inf, -np.inf)
    ),
    (partial(film, [[1.0, -1e-9], [1, 1]]), "negative"),
    *(
        (partial(film, np.ones(shape)), "needs a two-dimensional array")
        for shape in [(0, 4), (4,), (2, 2, 2)]
    ),
    *((partial(film, spacing=(1.0, bad)), "spacing must be .*positive") for bad in (*BAD, "1 um")),
    (partial(film, periodic="no"), "periodic must be True or False, got 'no'"),
    (partial(film, sides="open"), r"sides = 'open'.*wall, periodic"),
    (partial(film, representation="cubic"), r"representation = 'cubic'.*linear, constant"),
    (partial(film, RANDOM, sides="periodic"), "periodic"),
    (partial(film, np.ones((1, 7))), "two samples"),
    *(
        (partial(leak, **{name: bad}), rf"{name} = {bad} must be .*positive")
        for name in NUMBERS
        for bad in BAD
    ),
    (partial(leak, viscosity="1 mPa s"), "viscosity .*1 mPa s"),
    (partial(leak, method="adaptve"), r"method = 'adaptve'.*choose from.* adaptive, uniform"),
    (partial(leak, link_rule="median"), r"link_rule = 'median'.*linear-gap, arithmetic"),
    # A negative margin would narrow the bounds of a decision.
    (partial(leak, margin=-1.0), "margin = -1.0 must be a finite number >= 0"),
    (partial(leak, margin=0.1), "margin widens the bounds for decide alone"),
    (lambda: leak(limits=Limits(unknowns=-3)), "unknowns = -3 must be a finite number >= 0"),
    (lambda: leak(tuning=Tuning(theta=5)), "theta = 5 must lie between 0 and 1"),
    (lambda: leak(tuning=Tuning(cut=2)), "cut = 2 must lie between 0 and 1"),
    (lambda: leak(tuning=Tuning(ceiling=np.nan)), "ceiling = nan must be above 0"),
    # A bare gap does not say what lies at its sides, nor how to read it between its samples.
    *(
        (partial(solver, bare), f"{type(bare).__name__}; make it a GridFilm")
        for solver in SOLVERS
        for bare in (ONES, GridField(ONES, (1.0, 1.0)))
    ),
    *((partial(solver, film(size * ONES)), BEYOND) for solver in SOLVERS for size in SIZES),
    (partial(leak, [[1.0], [1e-61], [1.0]], representation="constant"), "constriction is 1e-61 of"),
    *((partial(tensor, size * ONES), BEYOND) for size in SIZES),
    (partial(tensor, np.eye(8) + 1, periodic=False), "periodic in both directions"),
    (partial(tensor, periodic=False, representation="constant"), "in both directions"),
    (partial(tensor, representation="cubic"), "choose from linear, constant"),
    (partial(tensor, viscosity=-1.0), "viscosity = -1.0 must be a positive number"),
    (partial(conductivity_tensor, ONES, viscosity=1.0), "ndarray; make it a GridField"),
    (partial(tensor, rtol=0), "rtol = 0 must be a positive number"),
    # The gap of a shape is that of its own vertices: the words say which argument to leave out.
    (
        lambda: kept_flow().start.through(VertexGap(np.ones(4), 1.0, 0.0, 0.0)),
        "VertexGap on a NestedMesh: leave out `start`",
    ),
    (lambda: leak(method="uniform", start=kept_flow().start), "'adaptive': leave out `start`"),
    (
        lambda: leak_rate(on_a_ring([1.0] * 18), **FLUID, keep=print),
        "on a grid alone: leave out `keep`",
    ),
    (partial(on_a_ring, [[1.0] * 8]), r"a gap of shape \(1, 8\) on a mesh of 18 vertices"),
    (
        partial(on_a_ring, np.arange(18.0)),
        "at 2 of 18 vertices .* is not that at the same point across the seam",
    ),
    (partial(on_a_ring, [-1.0] + [1.0] * 17), "at 1 of 18 vertices .* is negative"),
    (partial(on_a_ring, [np.nan] + [1.0] * 17), "at 1 of 18 vertices .* is not finite"),
)
