"""A film given as a DOLFINx mesh with facet tags and a gap, compared with closed forms."""

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_unit_square, meshtags
from dolfinx_meshes import (
    COARSE,
    MESHES,
    ends,
    function,
    rectangle,
    slanted,
    tagged,
    unstructured,
)
from project import leak_rate
from sample_gaps import FLUID, rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.fenicsx import MPI
from fem_seal.film import GridFilm
from fem_seal.flow import film_from_dolfinx, flow_functions
from fem_seal.leak_rate import FacetTag

SAME = 2 * np.sqrt(0.3 * 4e-8)  # bounds of one mesh, as in test_mpi


@pytest.mark.parametrize("make", [rectangle, unstructured])
@pytest.mark.parametrize("along", [True, False])
def test_linear_gap_has_the_closed_form(make, along):
    """g = 1 + x/2 along the flow resists by ∫dx/g³, g = 1 + y/2 across it conducts ∫g³ dy. The
    bounds enclose the closed form on any triangles; one of the two is exact but for the solver
    where the flow is as the mesh, 1 % is asked for."""
    msh, tags = make()
    gap = function(msh, lambda x: 1 + x[0 if along else 1] / 2)
    length = 2.0 if make is rectangle else 1.0
    flow = leak_rate(film_from_dolfinx(msh, tags, gap), rtol=0.01, **FLUID)
    resistance = 1 - 1 / (1 + length / 2) ** 2  # ∫ (1 + x/2)^-3 dx
    exact = 1 / resistance if along else (1.5**4 - 1) / 2 / length  # ∫ (1 + y/2)^3 dy
    assert flow.converged
    assert flow.lower * (1 - 1e-8) <= exact <= flow.upper * (1 + 1e-8)


@pytest.mark.parametrize("name", MESHES)
def test_gap_is_the_function_at_every_vertex(name):
    """Also where a ring is cut open, and where a wall between two outlets is halved: linear, so
    that rounding is all that is left."""
    msh, tags = MESHES[name]()
    film = film_from_dolfinx(msh, tags, function(msh, slanted))
    x = np.column_stack([film.mesh.xy, np.zeros(len(film.mesh.xy))]).T
    assert film.values == pytest.approx(slanted(x), rel=1e-14)
    whole = len(msh.geometry.x)
    assert (len(film.mesh.xy) > whole) == film.mesh.periodic == (name == "ring")


def test_there_and_back():
    """The mesh of a flow, with its tags and its gap, is a film again, of the same leak rate: its
    first mesh gives the same bounds but for what CG has left, 2e-8 on either side, which counts to
    the first order in the correction: 2 √(0.3 · 2 · 2e-8)."""
    gap = rough_gap((12, 10), 0.0, 3)
    flow = leak_rate(GridFilm(gap), field=True, **COARSE, **FLUID)
    functions = flow_functions(flow.field)
    walls = (FacetTag.WALL, FacetTag.CONTACT)
    film = film_from_dolfinx(functions.mesh, functions.facet_tags, functions.gap, wall=walls)
    back = leak_rate(film, **COARSE, **FLUID)
    assert (back.lower, back.upper) == pytest.approx((flow.lower, flow.upper), rel=SAME)


def test_tags_may_have_any_number():
    msh, _ = rectangle()
    tags = tagged(msh, *ends(2.0, inlet=12, outlet=7, wall=40))
    film = film_from_dolfinx(msh, tags, function(msh, slanted), inlet=12, outlet=7, wall={40, 41})
    assert film.mesh.xy[film.mesh.inlet][:, 0] == pytest.approx(0.0)
    assert film.mesh.xy[film.mesh.outlet][:, 0] == pytest.approx(2.0)


def test_bad_input():
    """In one line each; a slanted plane would be projected, and its areas with it."""
    msh, tags = rectangle()
    gap = function(msh, slanted)
    squares = create_unit_square(MPI.COMM_WORLD, 2, 2, CellType.quadrilateral)
    slope, _ = rectangle()
    slope.geometry.x[:, 2] = slope.geometry.x[:, 0] / 4
    one = np.array([0], dtype=np.int32), np.array([1], dtype=np.int32)
    bad = [
        (squares, meshtags(squares, 1, *one), function(squares, slanted), "type quadrilateral"),
        *(
            (msh, tags, function(msh, slanted, degree, family), "the gap is not linear")
            for family, degree in (("Lagrange", 2), ("DG", 1), ("DG", 0), ("CR", 1))
        ),
        (msh, tags, function(rectangle()[0], slanted), "another mesh"),
        (msh, tags, function(msh, lambda x: x[0] - 0.1), "negative"),
        (msh, tagged(msh, *ends(2.0)[1:]), gap, "24 boundary edges are in none of the groups"),
        (msh, tagged(msh, *ends(2.0, inlet=9)), gap, "no inlet: no facet has the tag 1; its tags"),
        (msh, tagged(msh, *ends(2.0, outlet=9)), gap, "no outlet: no facet has the tag 2; its"),
        (msh, meshtags(msh, 2, *one), gap, "dimension 2"),
        (slope, tagged(slope, *ends(2.0)), function(slope, slanted), "not plane: z varies by 0.5"),
    ]
    for *arguments, words in bad:
        with pytest.raises(InvalidInput, match=words) as error:
            film_from_dolfinx(*arguments)
        assert "\n" not in str(error.value)
