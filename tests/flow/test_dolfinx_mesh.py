"""DOLFINx and back: the flow as functions on a mesh with tags, and a film given as such.

Integrals are those of forms written out as in a textbook.
"""

from dataclasses import replace

import numpy as np
import pytest
from dolfinx.mesh import CellType, create_unit_square, meshtags
from dolfinx_meshes import COARSE, MESHES, ends, function, lengths, rectangle, slanted, tagged
from project import leak_rate
from sample_gaps import FLUID, rough_gap

from fem_seal.errors import InvalidInput
from fem_seal.fenicsx import MPI, fem, ufl, vector_functionspace
from fem_seal.film import GridFilm
from fem_seal.flow import film_from_dolfinx, flow_functions
from fem_seal.grid import GridField
from fem_seal.leak_rate import FacetTag

SAME = 2 * np.sqrt(0.3 * 4e-8)  # bounds of one mesh, as in test_two_processes
WATER = {"viscosity": 1e-3, "pressure_drop": 1e5}


def integral(form) -> float:
    return MPI.COMM_WORLD.allreduce(fem.assemble_scalar(fem.form(form)))


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("contact", [0.0, 0.3])
def test_flux_of_the_functions(sides, contact):
    """On pixels a linear gap is a linear function of the mesh, and quadrature of order 3 is exact
    for its cube: the flux is -g³/(12 η) ∇p, cell by cell. What is left is rounding. That it carries
    the leak rate: test_leak_rate."""
    rough = rough_gap((16, 12), contact, 5)
    gap = GridField(rough.values * 1e-6, (2e-6, 1e-6), periodic=True)
    flow = leak_rate(GridFilm(gap, sides=sides), field=True, **COARSE, **WATER)
    found = flow_functions(flow.field)
    dx = ufl.Measure("dx", found.mesh, metadata={"quadrature_degree": 3})
    defect = found.flux + found.gap**3 / (12 * WATER["viscosity"]) * ufl.grad(found.pressure)
    means = ufl.TestFunction(vector_functionspace(found.mesh, ("DG", 0)))
    left = fem.petsc.assemble_vector(fem.form(ufl.inner(defect, means) * dx))
    total = np.sqrt(integral(ufl.inner(found.flux, found.flux) * dx))
    assert np.abs(left.array).max() < 1e-12 * total
    left.destroy()


@pytest.mark.parametrize("sides", ["wall", "periodic"])
@pytest.mark.parametrize("contact", [0.0, 0.3])
def test_every_exterior_facet_has_its_tag(sides, contact):
    """Inlet and outlet lie at x = 0 and Lx and have the pressures of the flow, walls or the seam at
    y = 0 and Ly, and along contact the gap is 0; together they are the boundary. What should be 0
    is a sum of terms of either sign: 1e-14 of their size, and the tolerance 1e-12."""
    gap = rough_gap((16, 12), contact, 3)
    found = flow_functions(
        leak_rate(GridFilm(gap, sides=sides), field=True, **COARSE, **FLUID).field
    )
    ds = ufl.Measure("ds", found.mesh, subdomain_data=found.facet_tags)
    x, y = ufl.SpatialCoordinate(found.mesh)
    Lx, Ly = (n - 1 for n in gap.vertices().shape)
    length = dict(zip(list(FacetTag)[1:], lengths(found), strict=True))
    one = fem.Constant(found.mesh, 1.0)
    assert sum(length.values()) == pytest.approx(integral(one * ufl.ds), rel=1e-12)
    off = {
        FacetTag.INLET: x**2 + (found.pressure - FLUID["pressure_drop"]) ** 2,
        FacetTag.OUTLET: (Lx - x) ** 2 + found.pressure**2,
        FacetTag.WALL: y * (Ly - y),
        FacetTag.CONTACT: found.gap**2,
        FacetTag.SEAM: y * (Ly - y),
    }
    for tag, square in off.items():
        assert integral(square * ds(int(tag))) == pytest.approx(0, abs=1e-12), tag
    side, other = FacetTag.WALL, FacetTag.SEAM
    if sides == "periodic":
        side, other = other, side
        assert integral(y * ds(int(side))) == pytest.approx(length[side] * Ly / 2, rel=1e-12)
    assert length[other] == 0
    if contact == 0:
        assert length == pytest.approx({**length, FacetTag.INLET: Ly, side: 2 * Lx}, rel=1e-12)
        assert length[FacetTag.CONTACT] == 0
    else:
        assert 0 < length[FacetTag.INLET] < Ly
        assert length[FacetTag.CONTACT] > Ly


LINE = np.ones((9, 9))
LINE[4, 4:6] = 0


@pytest.mark.parametrize(
    ("gap", "representation", "options"),
    [
        (rough_gap((32, 32), 0.3, 5), "linear", {"rtol": 0.2}),
        # Beside pixels in contact, whose sides have no gap.
        (rough_gap((32, 32), 0.3, 5), "constant", {"rtol": 0.2}),
        # A contact line of one edge parts no points: its facet is not exterior, and has no tag.
        (GridField(LINE, (1.0, 1.0)), "linear", COARSE),
    ],
)
def test_tags_are_those_of_the_exterior_facets(gap, representation, options):
    film = GridFilm(gap, representation=representation)
    found = flow_functions(leak_rate(film, field=True, **options, **FLUID).field, MPI.COMM_SELF)
    cells = np.diff(found.mesh.topology.connectivity(1, 2).offsets)
    assert np.array_equal(found.facet_tags.indices, np.flatnonzero(cells == 1))
    assert np.any(found.facet_tags.values == FacetTag.CONTACT) == (len(gap.values) > 9)


def test_field_without_tags():
    """Files of earlier versions have none."""
    flow = leak_rate(GridFilm(rough_gap((8, 8), 0.0, 5)), field=True, **COARSE, **FLUID)
    assert flow_functions(replace(flow.field, facet_tags=None)).facet_tags is None


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
        (msh, tagged(msh, *ends(2.0)[1:]), gap, "the boundary has 24 edges in none of the groups"),
        (msh, tagged(msh, *ends(2.0, inlet=9)), gap, "no inlet: no facet has the tag 1; its tags"),
        (msh, tagged(msh, *ends(2.0, outlet=9)), gap, "no outlet: no facet has the tag 2; its"),
        (msh, meshtags(msh, 2, *one), gap, "dimension 2"),
        (slope, tagged(slope, *ends(2.0)), function(slope, slanted), "not plane: z varies by 0.5"),
    ]
    for *arguments, words in bad:
        with pytest.raises(InvalidInput, match=words) as error:
            film_from_dolfinx(*arguments)
        assert "\n" not in str(error.value)
